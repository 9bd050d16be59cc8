import numpy as np
import pytest

from mrslam.sim_driver.robots import LASERS, ChassisConfig, Fleet, LaserModel, OdometryConfig, SimulatedRobot
from mrslam.sim_driver.worlds import World, load_world
from mrslam.sim_driver.worlds.canvas import Canvas
from mrslam.spatial import InputError, se2

PERFECT = OdometryConfig(
    translation_m_per_sqrt_m=0, rotation_rad_per_sqrt_m=0, rotation_rad_per_sqrt_rad=0,
    translation_m_per_sqrt_rad=0, scale_misfit=0, turn_misfit=0,
)  # fmt: skip
BRISK = ChassisConfig(
    max_acceleration_m_s2=1e6, max_turn_acceleration_rad_s2=1e6, max_speed_m_s=2.0, max_turn_rad_s=3.0
)


@pytest.fixture(scope="module")
def hall():
    return World("hall", Canvas(20.0, 10.0).grid())


def robot_in(world, pose=(5.0, 5.0, 0.3), laser="lidar-360", seed=0, odometry=PERFECT, config=BRISK):
    return SimulatedRobot(world, np.array(pose), LASERS[laser], np.random.default_rng(seed), config, odometry)


@pytest.mark.parametrize("command", [(1.0, 0.0), (0.0, 1.0), (0.8, 0.7), (-0.5, 0.4)])
def test_drives_arcs_and_perfect_wheels_tell_the_truth(hall, command):
    robot = robot_in(hall)
    start = robot.T_world_base
    for _ in range(20):
        assert not robot.step(command, 0.1)
    v, w = command
    t = 2.0
    expected = [v * t, 0, 0] if w == 0 else [v / w * np.sin(w * t), v / w * (1 - np.cos(w * t)), w * t]
    moved = se2.between(start, robot.T_world_base)
    assert np.allclose(moved, expected, atol=1e-6)
    assert np.allclose(robot.T_odom_base, moved, atol=1e-9)


def test_odometry_errs_as_its_figures_say(hall):
    config = OdometryConfig(scale_misfit=0.0, turn_misfit=0.0)
    errors = []
    for seed in range(200):
        robot = robot_in(hall, (2.0, 5.0, 0.0), seed=seed, odometry=config)
        for _ in range(40):
            robot.step((1.0, 0.0), 0.1)
        errors.append(robot.T_odom_base - (robot.T_world_base - (2.0, 5.0, 0.0)))
    spread = np.std(errors, axis=0)
    assert spread[0] == pytest.approx(0.02 * 2, rel=0.2)  # 4 m: twice the figure of 1 m
    assert spread[2] == pytest.approx(0.02 * 2, rel=0.2)
    assert (np.abs(np.mean(errors, axis=0)) < 0.3 * spread).all()


def test_standing_still_adds_no_error(hall):
    robot = robot_in(hall, odometry=OdometryConfig())
    for _ in range(50):
        robot.step((0.0, 0.0), 0.1)
    assert np.array_equal(robot.T_odom_base, np.zeros(3))


def test_limits_of_speed_and_acceleration(hall):
    robot = robot_in(hall, config=ChassisConfig())
    robot.step((9.0, 9.0), 0.1)
    assert robot.speed_m_s == pytest.approx(0.1)
    assert robot.turn_rad_s == pytest.approx(0.5)
    for _ in range(20):
        robot.step((9.0, 9.0), 0.1)
    assert (robot.speed_m_s, robot.turn_rad_s) == (0.5, 1.5)
    robot.step((np.nan, np.inf), 0.1)
    assert robot.speed_m_s == pytest.approx(0.4)


def test_a_wall_stops_it_and_it_can_leave(hall):
    robot = robot_in(hall, (19.0, 5.0, 0.0))
    hits = [robot.step((1.0, 0.0), 0.1) for _ in range(20)]
    assert not hits[0]
    assert hits[-1]
    assert robot.collisions == sum(hits)
    x = robot.T_world_base[0]
    assert x + robot.config.radius_m <= 19.9 + 0.03
    assert x > 19.6
    robot.step((0.0, 1.0), 1.0)  # turning on the spot is free
    assert robot.T_world_base[2] == pytest.approx(1.0)
    assert not robot.step((-1.0, 0.0), 0.1)
    assert np.hypot(*robot.T_world_base[:2]) > 0
    assert robot.T_world_base[1] < 5.0


def test_a_robot_that_hit_a_wall_starts_from_rest(hall):
    robot = robot_in(hall, (19.0, 5.0, 0.0), config=ChassisConfig())
    while not robot.step((0.5, 0.0), 0.1):
        pass
    assert robot.speed_m_s == 0.0
    assert not robot.step((-0.5, 0.0), 0.1)
    assert robot.speed_m_s == pytest.approx(-0.1)


def test_wheels_slip_where_a_robot_turns_on_the_spot(hall):
    config = OdometryConfig(scale_misfit=0.0, turn_misfit=0.0)
    places = []
    for seed in range(200):
        robot = robot_in(hall, seed=seed, odometry=config)
        robot.step((0.0, 2.0), 0.5)
        places.append(robot.T_odom_base[:2])
    along, across = np.std(places, axis=0)
    assert along == pytest.approx(config.translation_m_per_sqrt_rad, rel=0.2)  # by one radian
    assert 0.1 * along < across < 0.5 * along


def test_robots_block_each_other(hall):
    a, b = robot_in(hall, (5.0, 5.0, 0.0)), robot_in(hall, (7.0, 5.0, np.pi), seed=1)
    fleet = Fleet({"b": b, "a": a})
    for _ in range(40):
        fleet.step({"a": (1.0, 0.0), "b": (1.0, 0.0)})
    gap = np.hypot(*(a.T_world_base[:2] - b.T_world_base[:2]))
    assert 0.36 <= gap < 0.45
    assert a.collisions > 0


def test_a_robot_without_a_command_brakes(hall):
    robot = robot_in(hall, config=ChassisConfig())
    fleet = Fleet({"a": robot})
    for _ in range(10):
        fleet.step({"a": (0.5, 0.0)})
    for _ in range(10):
        fleet.step({})
    assert robot.speed_m_s == 0.0


def test_sees_the_hall_at_true_distances(hall):
    robot = robot_in(hall, (5.0, 5.0, 0.0))
    scan = robot.scan(7)
    assert scan.stamp_ns == 7
    assert scan.ranges_m.size == 400
    ahead = np.abs(scan.angles_rad) < 0.02
    assert np.isinf(scan.ranges_m[ahead]).all()  # 14.9 m away, farther than its 12 m
    behind = np.abs(np.abs(scan.angles_rad) - np.pi) < 0.05
    assert np.nanmedian(scan.ranges_m[behind]) == pytest.approx(4.9, abs=0.03)


def test_sees_others_as_discs(hall):
    a, b = robot_in(hall, (5.0, 5.0, 0.0)), robot_in(hall, (8.0, 5.0, 0.0), seed=1)
    seen = {o.robot_id: o for o in Fleet({"a": a, "b": b}).observe(0)}
    ahead = np.abs(seen["a"].scan.angles_rad) < 0.02
    assert np.nanmedian(seen["a"].scan.ranges_m[ahead]) == pytest.approx(3.0 - 0.18, abs=0.03)
    assert np.array_equal(seen["b"].T_world_base, b.T_world_base)


@pytest.mark.parametrize("name", sorted(LASERS))
def test_lasers_measure_as_their_figures_say(hall, name):
    laser = LASERS[name]
    truth = np.full(laser.beams, 3.0, dtype=np.float32)
    truth[0] = np.inf
    rng = np.random.default_rng(0)
    many = np.stack([laser.measure(truth, rng) for _ in range(200)])
    assert np.isnan(many).mean() == pytest.approx(laser.dropout, rel=0.3)
    assert np.isposinf(many[:, 0][~np.isnan(many[:, 0])]).all()
    sigma = max(laser.noise_m, 3.0 * laser.noise_per_m)
    assert np.nanstd(many[:, 1:]) == pytest.approx(sigma, rel=0.05)
    assert np.nanmean(many[:, 1:]) == pytest.approx(3.0, abs=sigma / 20)
    scan = robot_in(hall, laser=name).scan(0)
    assert scan.range_max_m == laser.range_max_m


def test_published_geometry():
    urg, sick = LASERS["urg-04lx"], LASERS["lms-200"]
    assert np.degrees(urg.angle_increment_rad * (urg.beams - 1)) == pytest.approx(240, abs=0.5)
    assert (urg.range_min_m, urg.range_max_m) == (0.02, 5.6)
    assert np.degrees(sick.angle_increment_rad * (sick.beams - 1)) == pytest.approx(180)


def test_one_seed_one_run():
    world = load_world("arena2")

    def run():
        rng = np.random.default_rng(5)
        robots = {f"r{i}": SimulatedRobot(world, world.free_start(rng), LASERS["urg-04lx"], rng) for i in range(3)}
        fleet, out = Fleet(robots), []
        for i in range(30):
            fleet.step({f"r{k}": (0.4, 0.5 * k) for k in range(3)})
            out += [np.concatenate([o.scan.ranges_m, o.T_odom_base]) for o in fleet.observe(i)]
        return np.concatenate(out).tobytes()

    assert run() == run()


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"beams": 0}, "laser.beams must be a whole number in 1..100000, got 0"),
        ({"range_max_m": 0.01}, "laser.range_max_m must be > range_min_m"),
        ({"dropout": 1.5}, r"laser.dropout must be in 0..1, got 1.5"),
    ],
)
def test_lasers_are_checked(values, text):
    good = {"beams": 4, "angle_min_rad": 0.0, "angle_increment_rad": 0.1, "range_min_m": 0.1, "range_max_m": 5.0}
    with pytest.raises(InputError, match=text):
        LaserModel(**(good | {"noise_m": 0.01} | values))


def test_settings_are_checked():
    with pytest.raises(InputError, match=r"robot\.radius_m must be in 0\.001\.\.1e\+09 m, got 0"):
        ChassisConfig(radius_m=0)
    with pytest.raises(InputError, match=r"odometry\.scale_misfit must be in 0\.\.10, got -0\.1"):
        OdometryConfig(scale_misfit=-0.1)
