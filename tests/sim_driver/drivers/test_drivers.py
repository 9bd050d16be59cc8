import numpy as np
import pytest

from mrslam.sim_driver.drivers import DRIVERS, DriverConfig, Explorer, IdleDriver, TrajectoryDriver, WaypointDriver
from mrslam.sim_driver.drivers.costmap import UNKNOWN_PENALTY, make_costmap
from mrslam.sim_driver.drivers.follow import slow_for_obstacles, steer
from mrslam.sim_driver.drivers.goals import find_goals
from mrslam.sim_driver.drivers.plan import path_between, seen_obstacles
from mrslam.sim_driver.drivers.recovery import Recovery
from mrslam.sim_driver.worlds import World, load_world
from mrslam.sim_driver.worlds.canvas import Canvas
from mrslam.spatial import InputError, OccupancyGrid, Scan, se2
from tests.sim_driver.rehearsal import rehearse

S = 1_000_000_000


def scan_of(ranges):
    ranges = np.asarray(ranges, dtype=np.float32)
    step = 2 * np.pi / ranges.size
    return Scan(stamp_ns=0, ranges_m=ranges, angle_min_rad=-np.pi, angle_increment_rad=step, range_max_m=10.0)


def roll(driver, seconds, grid=None, T=(0.0, 0.0, 0.0), teammates=None):
    """Drive a robot that obeys at once and knows where it is."""
    T = np.array(T, dtype=float)
    track = [T]
    for step in range(round(seconds * 10)):
        v, w = driver.command(step * S // 10, T, grid, teammates or {})
        T = se2.compose(T, (v * 0.1 * np.cos(w * 0.05), v * 0.1 * np.sin(w * 0.05), w * 0.1))
        track.append(T)
        if driver.finished:
            break
    return np.array(track)


def test_waypoints_are_reached_in_order():
    points = np.array([[2.0, 0.0], [2.0, 2.0], [-1.0, 1.0]])
    driver = WaypointDriver(points)
    track = roll(driver, 60)
    assert driver.finished
    gaps = np.linalg.norm(track[:, None, :2] - points[None], axis=-1)
    first = [int(np.argmax(gaps[:, i] < 0.25)) for i in range(3)]
    assert 0 < first[0] < first[1] < first[2]
    assert driver.command(99 * S, track[-1], None, {}) == (0.0, 0.0)


def test_waypoints_go_around_walls():
    cells = np.zeros((80, 120), dtype=np.int8)
    cells[:60, 60] = 100  # a wall at x = 3 up to y = 3
    driver = WaypointDriver([[5.0, 1.0]])
    track = roll(driver, 60, OccupancyGrid(cells, 0.05), (1.0, 1.0, 0.0))
    assert driver.finished
    wall = np.abs(track[:, 0] - 3.025) < 0.15
    assert track[wall, 1].min() > 3.1


@pytest.mark.parametrize("goal", [(5.0, 1.0), (9.0, 1.0)], ids=["in the map", "beyond it"])
def test_waypoints_behind_walls_are_reached_through_what_is_not_known(goal):
    cells = np.full((80, 120), -1, dtype=np.int8)
    cells[:60, :60] = 0
    cells[:60, 60] = 100  # a wall at x = 3 up to y = 3, and nobody knows what is behind it
    driver = WaypointDriver([goal])
    track = roll(driver, 60, OccupancyGrid(cells, 0.05), (1.0, 1.0, 0.0))
    assert driver.finished
    wall = np.abs(track[:, 0] - 3.025) < 0.15
    assert track[wall, 1].min() > 3.1 or track[wall, 1].max() < -0.1


def test_a_longer_way_that_is_known_is_better_than_a_short_one_that_is_not():
    cells = np.zeros((80, 120), dtype=np.int8)
    cells[:60, 60] = 100
    cells[20:30, 58:63] = -1  # something in the wall that was never seen
    driver = WaypointDriver([[5.0, 1.0]])
    track = roll(driver, 60, OccupancyGrid(cells, 0.05), (1.0, 1.0, 0.0))
    assert driver.finished and track[np.abs(track[:, 0] - 3.025) < 0.15, 1].min() > 3.1


def test_steps_where_nothing_is_known_are_dearer():
    cells = np.zeros((40, 40), dtype=np.int8)
    cells[:, 20:] = -1
    known, unknown = (
        make_costmap(OccupancyGrid(cells, 0.1), DriverConfig(), through_unknown=through).weight[20, [5, 35]]
        for through in (False, True)
    )
    assert list(known) == [1.0, np.inf] and list(unknown) == [1.0, UNKNOWN_PENALTY]


def test_a_frontier_is_whoever_is_nearer_to_it():
    cells = np.full((60, 200), -1, dtype=np.int8)
    cells[20:40, 20:180] = 0  # a corridor from x = 1 to 9 m, open at both ends
    cells[[19, 40], 20:180] = 100
    costmap = make_costmap(OccupancyGrid(cells, 0.05), DriverConfig())
    for mates, mine in (
        (np.empty((0, 2)), {"west": True, "east": True}),
        ([[6.0, 1.5]], {"west": True, "east": False}),
    ):
        _, goals = find_goals(costmap, np.array([4.0, 1.5, 0.0]), np.reshape(mates, (-1, 2)), DriverConfig())
        assert {"west" if goal.xy_m[0] < 5.0 else "east": goal.is_mine for goal in goals} == mine


def test_looping_waypoints_never_finish():
    driver = WaypointDriver([[1.0, 0.0], [0.0, 0.0]], loop=True)
    track = roll(driver, 40)
    assert not driver.finished
    assert (np.diff((track[:, 0] > 0.5).astype(int)) == 1).sum() >= 3


def test_a_trajectory_is_followed_in_time():
    t = np.arange(0, 30, 0.5)
    poses = np.stack([0.3 * t, np.sin(0.3 * t), np.zeros_like(t)], axis=-1)
    driver = TrajectoryDriver((t * S).astype(np.int64), poses)
    track = roll(driver, 60)
    assert driver.finished
    at = np.stack([np.interp(np.arange(len(track)) * 0.1, t, poses[:, k]) for k in (0, 1)], axis=-1)
    assert np.linalg.norm(track[:, :2] - at, axis=-1).max() < 0.6


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: WaypointDriver([1.0, 2.0]), "waypoints must be a list of"),
        (lambda: WaypointDriver([[1.0, np.nan]]), "waypoints must be a list of"),
        (lambda: TrajectoryDriver([0, 1], [[0, 0, 0]]), "needs N stamps"),
        (lambda: TrajectoryDriver([1, 0], [[0, 0, 0]] * 2), "must not run backward"),
        (lambda: DriverConfig(speed_m_s=0), r"driver\.speed_m_s must be in 0\.001\.\.100 m/s, got 0"),
        (lambda: DriverConfig(margin_m=-1), r"driver\.margin_m must be in 0\.\.10 m, got -1"),
    ],
)
def test_bad_input(make, text):
    with pytest.raises(InputError, match=text):
        make()


def test_idle_and_the_table_of_drivers():
    assert IdleDriver().command(0, np.zeros(3), None, {}) == (0.0, 0.0)
    assert set(DRIVERS) == {"explore", "waypoints", "trajectory", "idle"}


def test_brakes_for_what_the_scan_shows_ahead():
    config = DriverConfig()
    ranges = np.full(360, 5.0)
    assert slow_for_obstacles((0.5, 0.2), scan_of(ranges), config) == (0.5, 0.2)
    ranges[180] = config.robot_radius_m + 0.1
    speed, turn = slow_for_obstacles((0.5, 0.2), scan_of(ranges), config)
    assert 0.0 < speed < 0.4
    assert turn == 0.2
    ranges[180] = config.robot_radius_m + 0.02
    assert slow_for_obstacles((0.5, 0.0), scan_of(ranges), config)[0] == 0.0
    ranges[180], ranges[0] = 5.0, 0.2  # behind
    assert slow_for_obstacles((0.5, 0.0), scan_of(ranges), config)[0] == 0.5
    assert slow_for_obstacles((-0.2, 0.0), scan_of(np.full(360, 0.2)), config)[0] == -0.2


def test_steering_turns_first_when_it_looks_away():
    path = np.array([[0.1 * i, 0.0] for i in range(30)])
    assert steer(np.array([0.0, 0.0, np.pi]), path, DriverConfig())[0] == 0.0
    assert steer(np.array([0.0, 0.0, 0.0]), path, DriverConfig())[0] == pytest.approx(0.5)
    assert steer(np.array([0.0, 0.1, 0.0]), path, DriverConfig())[1] < 0
    assert steer(np.zeros(3), np.empty((0, 2)), DriverConfig()) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("name", "robots", "seed", "limit_s"), [("arena1", 2, 0, 60), ("arena2", 2, 3, 150), ("symmetric-house", 1, 1, 150)]
)
def test_explores_a_world_to_its_end(name, robots, seed, limit_s):
    outcome = rehearse(load_world(name), robots, seed, limit_s)
    assert outcome.coverage[-1][1] > 0.97
    assert len(outcome.finished_s) == robots
    assert sum(outcome.collisions.values()) <= 5


def test_robots_that_do_not_know_of_each_other_still_get_done():
    outcome = rehearse(load_world("arena2"), 3, 2, 200, laser="urg-04lx", share_map=False)
    assert outcome.coverage[-1][1] > 0.97
    assert len(outcome.finished_s) == 3


def test_frontiers_are_shared_out():
    """Two robots right of the middle of a corridor with a frontier at each end."""
    cells = np.full((60, 400), -1, dtype=np.int8)
    cells[20:40, 20:380] = 0
    cells[[20, 39], 20:380] = 100
    grid = OccupancyGrid(cells, 0.05)
    left, right = np.array([11.0, 1.5, 0.0]), np.array([12.5, 1.5, np.pi])
    one, two = Explorer(), Explorer()
    one.command(0, left, grid, {"two": right})
    two.command(0, right, grid, {"one": left})
    assert one.goal_m[0] < 2.0
    assert two.goal_m[0] > 18.0
    alone = Explorer()
    alone.command(0, left, grid, {})
    assert alone.goal_m[0] > 18.0  # nearer, when nobody else is


def test_a_frontier_that_never_clears_is_given_up():
    """The map never changes, whatever the robot does: it must not stay for ever."""
    cells = np.full((80, 80), -1, dtype=np.int8)
    cells[20:60, 20:60] = 0
    driver = Explorer(DriverConfig(progress_timeout_s=5.0, finish_after_s=2.0))
    track = roll(driver, 300, OccupancyGrid(cells, 0.05), (2.0, 2.0, 0.0))
    assert driver.finished
    assert len(track) < 2500
    # The team's map shows something new: on it goes.
    cells = cells.copy()
    cells[60:75, 30:50] = 0
    driver.command(400 * S, track[-1], OccupancyGrid(cells, 0.05), {})
    assert not driver.finished


def test_who_is_finished_looks_for_something_new_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    cells = Canvas(5.0, 5.0).grid().cells
    driver, looks = Explorer(DriverConfig(finish_after_s=6.0, plan_interval_s=1.5)), []
    plan = driver._plan
    monkeypatch.setattr(driver, "_plan", lambda now_ns, *rest: (looks.append(now_ns / S), plan(now_ns, *rest)))
    for tenth in range(400):  # the team's map changes all the time
        driver.command(tenth * S // 10, np.array([2.0, 2.0, 0.0]), OccupancyGrid(cells.copy(), 0.05), {})
    assert looks[:5] == [0.0, 1.5, 3.0, 4.5, 6.0]
    assert looks[5:] == [12.0, 18.0, 24.0, 30.0, 36.0]


def test_a_known_world_is_finished_at_once():
    world = World("hall", Canvas(5.0, 5.0).grid())
    driver = Explorer(DriverConfig(finish_after_s=2.0))
    roll(driver, 10, world.grid, (2.0, 2.0, 0.0))
    assert driver.finished


def test_without_a_map_it_looks_around():
    assert Explorer().command(0, np.zeros(3), None, {})[1] > 0
    empty = OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05)
    assert Explorer().command(0, np.zeros(3), empty, {})[1] > 0


def test_a_robot_that_cannot_move_wriggles_and_in_the_end_gives_up():
    cells = np.full((80, 80), -1, dtype=np.int8)
    cells[20:60, 20:60] = 0
    grid, driver = OccupancyGrid(cells, 0.05), Explorer(DriverConfig(finish_after_s=2.0))
    commands = [driver.command(i * S // 10, np.array([2.0, 2.0, 0.0]), grid, {}) for i in range(3000)]
    assert any(v < 0 for v, _ in commands)
    assert driver.finished


def test_one_seed_one_run():
    def run():
        outcome = rehearse(load_world("arena1"), 2, 4, 20)
        return np.concatenate([np.array(t).ravel() for t in outcome.tracks.values()]).tobytes()

    assert run() == run()


def test_a_robot_in_a_map_does_not_close_a_room_for_good():
    cells = np.full((60, 120), -1, dtype=np.int8)
    cells[:, :70] = 0
    cells[[0, -1], :] = 100
    cells[:, 0] = 100
    cells[:, 60] = 100
    cells[22:38, 60] = 0  # a door of 0.8 m
    cells[26:34, 57:60] = 100  # in which a teammate stood when it was last seen
    grid = OccupancyGrid(cells, 0.05)
    closed = make_costmap(grid, DriverConfig())
    hopeful = make_costmap(grid, DriverConfig(), hopeful=True)
    here, there = np.array([1.0, 1.5]), np.array([3.3, 1.5])
    assert path_between(closed, here, there, 0.3) is None
    path = path_between(hopeful, here, there, 0.3)
    assert path is not None and abs(path[-1][0] - 3.3) < 0.2
    assert not hopeful.is_frontier[:, 50:60].any()  # what a speck hides is not worth a visit
    driver = Explorer()
    driver.command(0, np.array([1.0, 1.5, 0.0]), grid, {})
    assert driver.goal_m is not None and driver.goal_m[0] > 3.0


def test_a_robot_that_sees_nothing_left_looks_around_before_it_stops():
    cells = np.zeros((60, 60), dtype=np.int8)
    cells[[0, -1], :] = 100
    cells[:, [0, -1]] = 100
    driver, grid = Explorer(), OccupancyGrid(cells, 0.05)
    commands = [driver.command(round(t * 1e8), np.array([1.5, 1.5, 0.0]), grid, {}) for t in range(100)]
    assert commands[0][1] != 0.0 and commands[0][0] == 0.0
    assert driver.finished and commands[-1] == (0.0, 0.0)


def wall_ahead(away_m):
    """A scan of a piece of wall of 1 m across the way, and of nothing else nearer than 5 m."""
    ranges = np.full(720, 5.0)
    angles = np.linspace(-np.pi, np.pi, 720, endpoint=False)
    hit = (np.abs(angles) < 1.5) & (away_m * np.abs(np.tan(angles)) < 0.5)
    ranges[hit] = away_m / np.cos(angles[hit])
    return scan_of(ranges)


def test_a_robot_that_is_held_on_its_way_to_a_waypoint_backs_off():
    driver = WaypointDriver([[5.0, 0.0]])
    commands = [driver.command(i * S // 10, np.zeros(3), None, {}) for i in range(80)]
    assert commands[0][0] > 0.0 and min(v for v, _ in commands) < 0.0


@pytest.mark.parametrize(
    "driver",
    [WaypointDriver([[5.0, 0.0]]), TrajectoryDriver([0, 10 * S], [[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]])],
    ids=["waypoints", "trajectory"],
)
def test_on_given_ways_too_a_robot_stops_before_what_it_sees(driver):
    free, blocked = (driver.command(0, np.zeros(3), None, {}, wall_ahead(m)) for m in (4.0, 0.2))
    assert free[0] > 0.2 and blocked[0] == 0.0


def test_the_way_to_a_waypoint_leads_around_what_the_map_does_not_show():
    hall = OccupancyGrid(np.zeros((120, 160), dtype=np.int8), 0.05)

    def first_turn(away_m):
        driver, start = WaypointDriver([[7.0, 3.0]]), np.array([1.0, 3.0, 0.0])
        return abs(driver.command(0, start, hall, {}, wall_ahead(away_m))[1])

    assert first_turn(4.0) < 0.3 and first_turn(1.6) > 0.8


def test_teammates_that_are_seen_are_no_obstacles_for_plans_for_they_move_on():
    config, T_map_base = DriverConfig(), np.array([2.0, 1.0, np.pi / 2])
    for mates, count in ((np.empty((0, 2)), 1), (np.array([[2.0, 2.1]]), 0), (np.array([[2.0, 1.2]]), 1)):
        ranges = np.full(360, 5.0)
        ranges[180] = 1.0  # at (2, 2)
        seen = seen_obstacles(scan_of(ranges), T_map_base, mates, config)
        assert np.allclose(seen, np.full((count, 2), 2.0), atol=1e-6) and len(seen) == count


def test_a_way_leads_around_a_teammate_rather_than_through_it():
    grid = OccupancyGrid(np.zeros((80, 80), dtype=np.int8), 0.1)
    teammates = (None, np.full((1, 2), 4.0))
    free, crowded = (make_costmap(grid, DriverConfig(), teammates=mates).weight for mates in teammates)
    there = crowded > free + 5.0
    assert there[crowded.shape[0] // 2, crowded.shape[1] // 2] and 0.01 < there.mean() < 0.1


def test_a_recorded_robot_that_stood_at_first_is_followed_to_the_end():
    driver = TrajectoryDriver([0, 4 * S, 10 * S], [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    track = roll(driver, 30)
    assert driver.finished and track[-1][0] > 1.7


def test_a_robot_that_got_free_and_drove_on_has_all_its_tries_again():
    recovery = Recovery(DriverConfig(), np.random.default_rng(0))
    for _ in range(2):
        recovery.start(0)
    assert not recovery.is_stuck(5 * S, np.zeros(3))
    assert not recovery.is_stuck(6 * S, np.array([0.2, 0.0, 0.0])) and recovery.in_a_row == 2
    assert not recovery.is_stuck(7 * S, np.array([1.0, 0.0, 0.0])) and recovery.in_a_row == 0


def test_frontiers_that_were_given_up_get_a_whole_second_chance():
    cells = np.full((80, 80), -1, dtype=np.int8)
    cells[20:60, 20:60] = 0

    def seconds(forgiven):
        driver = Explorer(DriverConfig(progress_timeout_s=5.0, finish_after_s=2.0, blacklist_forgiven=forgiven))
        track = roll(driver, 300, OccupancyGrid(cells, 0.05), (2.0, 2.0, 0.0))
        assert driver.finished
        return len(track) / 10

    assert seconds(1) - seconds(0) > 3.0  # it stands there, which counts threefold, and plans every 1.5 s


def test_a_door_that_closes_on_coarse_cells_is_gone_through_where_nothing_else_is_left():
    cells = np.full((100, 120), -1, dtype=np.int8)
    cells[30:90, :70] = 0
    cells[[30, 89], :] = 100
    cells[30:90, [0, 60]] = 100
    cells[52:68, 60] = 0  # a door of 0.8 m, and the unknown behind it
    cells[20:31, 10:26] = 0  # another, nearer
    cells[31:34, 14:22] = 100  # in which something stands
    grid, config = OccupancyGrid(cells, 0.05), DriverConfig(max_plan_cells=500)
    robot_m = np.array([0.9, 2.2])
    assert path_between(make_costmap(grid, config), robot_m, np.array([3.3, 3.0]), 0.3) is None
    driver = Explorer(config)
    driver.command(0, np.append(robot_m, -0.5 * np.pi), grid, {})
    assert driver.goal_m is not None and driver.goal_m[0] > 3.0
