import cv2
import numpy as np
import pytest

from mrslam.sim_driver.worlds import BUILT_IN, World, load_world
from mrslam.sim_driver.worlds.campus import YARD_M, _plant, building
from mrslam.sim_driver.worlds.canvas import Canvas
from mrslam.spatial import InputError, OccupancyGrid, write_map


@pytest.mark.parametrize(
    "name",
    [
        *BUILT_IN,
        "office:0",
        "office:1",
        "office:2",
        "office:3",
        *(f"hotel:{k}" for k in range(8)),
        "campus:0",
        "campus:1",
    ],
)
def test_every_world_is_closed_and_has_one_floor(name):
    world = load_world(name)
    assert set(np.unique(world.grid.cells)) == {0, 100}
    for side in (world.is_wall[0], world.is_wall[-1], world.is_wall[:, 0], world.is_wall[:, -1]):
        assert side.all()
    free = world.grid.cells == 0
    # All floor hangs together: nothing a robot could see but never reach.
    assert np.count_nonzero(world.reachable) >= 0.999 * np.count_nonzero(free)


@pytest.mark.parametrize(
    ("name", "width", "height"),
    [("arena1", 4.1, 4.6), ("arena2", 13.2, 9.2), ("corridor", 40.2, 6.2), ("block", 36.2, 26.2)],
)
def test_sizes(name, width, height):
    assert load_world(name).size_m == pytest.approx((width, height), abs=0.05)


def test_the_symmetric_house_is_symmetric_and_the_office_is_not():
    house, office = load_world("symmetric-house").grid.cells, load_world("office").grid.cells
    assert np.array_equal(house, house[::-1, ::-1])
    assert np.mean(office != office[::-1, ::-1]) > 0.01


def test_robots_pass_every_door_of_an_office():
    from scipy import ndimage

    for seed in range(12):
        world = load_world(f"office:{seed}")
        wide = world.clearance_cells * world.resolution_m > 0.3
        labels, _ = ndimage.label(wide)
        areas = np.bincount(labels.ravel())[1:]
        assert areas.max() > 0.97 * areas.sum(), seed


def test_one_seed_one_office():
    assert np.array_equal(load_world("office:7").grid.cells, load_world("office:7").grid.cells)
    assert load_world("office:7").grid.shape != load_world("office:8").grid.shape


def test_robots_pass_nearly_every_door_of_a_hotel():
    from scipy import ndimage

    for seed in range(12):
        world = load_world(f"hotel:{seed}")
        labels, _ = ndimage.label(world.clearance_cells * world.resolution_m > 0.25)
        areas = np.bincount(labels.ravel())[1:]
        assert areas.max() > 0.95 * areas.sum(), seed  # a single box may close one room


def moved_onto_itself(world: World, turn: np.ndarray) -> float:
    """Return the share of wall cells beside floor that lie on a wall cell, or beside one, when the plan is turned."""
    from scipy import ndimage

    inner = ndimage.binary_erosion(world.is_wall, np.ones((3, 3)))
    row, col = np.nonzero(world.is_wall & ~inner)
    middle = (np.array(world.is_wall.shape[::-1]) - 1) / 2
    x, y = ((np.stack([col, row], axis=-1) - middle) @ turn.T).T
    on = np.floor(np.stack([y, x]) + middle[::-1, None] + 0.5).astype(int)
    inside = ((on >= 0) & (on < np.array(world.is_wall.shape)[:, None])).all(axis=0)
    return float(ndimage.binary_dilation(world.is_wall & ~inner)[tuple(on[:, inside])].sum() / inside.size)


@pytest.mark.parametrize(("seed", "turn_deg", "least"), [(4, 90, 0.95), (5, 180, 0.95), (11, 180, 0.95), (4, 45, 0.0)])
def test_wings_of_a_hotel_are_equal(seed, turn_deg, least):
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    share = moved_onto_itself(load_world(f"hotel:{seed}"), np.array([[c, -s], [s, c]]))
    assert share > least if least else share < 0.5


def test_a_hotel_is_one_seeds_and_its_seed_is_checked():
    assert np.array_equal(load_world("hotel:7").grid.cells, load_world("hotel:7").grid.cells)
    assert load_world("hotel:7").grid.shape != load_world("hotel:8").grid.shape
    with pytest.raises(InputError, match="the seed after hotel: must be a whole number"):
        load_world("hotel:-1")


@pytest.mark.parametrize("clearance", [0.2, 0.5])
def test_starts_are_free_and_apart(clearance):
    world, rng = load_world("arena2"), np.random.default_rng(3)
    taken = np.empty((0, 2))
    for _ in range(5):
        start = world.free_start(rng, clearance, taken)
        assert world.clearance_m(start[:2]) >= clearance
        assert not len(taken) or np.hypot(*(taken - start[:2]).T).min() >= 2 * clearance
        taken = np.vstack([taken, start[:2]])
    same = world.free_start(np.random.default_rng(3), clearance)
    assert np.array_equal(same, world.free_start(np.random.default_rng(3), clearance))


@pytest.mark.parametrize("taken", [(2.0, 2.0), (0.5, 0.5), (3.6, 0.4)])  # also beside the outer walls
def test_starts_keep_away_from_a_robot_and_look_anywhere(taken):
    world, rng = load_world("arena1"), np.random.default_rng(0)
    starts = np.array([world.free_start(rng, 0.3, np.array([taken])) for _ in range(300)])
    assert 0.6 <= np.hypot(*(starts[:, :2] - taken).T).min() < 0.7
    assert np.ptp(starts[:, 2]) > 6.0
    in_cells = starts[:, :2] / world.resolution_m - 0.5  # robots stand in the middle of cells
    np.testing.assert_allclose(in_cells, np.rint(in_cells), atol=1e-6)


def test_no_place_left():
    with pytest.raises(InputError, match="no free place 9 m from every wall"):
        load_world("arena1").free_start(np.random.default_rng(0), 9.0)


def test_clearance_is_zero_in_walls_and_outside():
    world = load_world("arena1")
    assert world.clearance_m(np.array([[0.01, 0.01], [-5.0, 2.0], [99.0, 99.0]])).tolist() == [0, 0, 0]
    assert world.clearance_m(np.array([2.0, 2.2])) > 0.2
    pen = World("pen", OccupancyGrid(np.zeros((22, 42), dtype=np.int8), 0.1))  # 2 m between walls of one cell
    assert pen.clearance_m(np.array([2.05, 1.05])) == pytest.approx(0.95)


def test_a_plan_without_walls_is_closed_and_all_of_it_is_floor():
    world = World("yard", OccupancyGrid(np.zeros((30, 50), dtype=np.int8), 0.1))
    assert not world.is_wall[1:-1, 1:-1].any() and np.count_nonzero(world.is_wall) == 2 * 50 + 2 * 28
    np.testing.assert_array_equal(world.reachable, ~world.is_wall)


def test_rooms_without_a_door_between_them_are_not_joined():
    plan = Canvas(10.0, 4.0).wall(5.0, 0.0, 5.0, 4.0)
    one, other = np.array([2.0, 2.0]), np.array([8.0, 2.0])
    assert not World("closed", plan.grid()).is_joined(one, other)
    open_plan = World("open", plan.door(5.0, 2.0, 1.0, vertical=True).grid())
    assert open_plan.is_joined(one, other) and not open_plan.is_joined(one, np.array([5.0, 0.5]))


def test_pillars_are_as_wide_as_drawn_and_what_is_outside_is_cut_off():
    cells = Canvas(4.0, 3.0).disc(2.0, 1.5, 0.5).cells
    assert np.count_nonzero(cells[2:-2, 2:-2]) * 0.05**2 == pytest.approx(np.pi * 0.25, rel=0.02)
    assert cells[30, 40] == 100 and cells[30, 49] == 100 and cells[30, 51] == 0
    corner = Canvas(4.0, 3.0).box(-1.0, -1.0, 1.0, 0.5).cells
    assert (corner[:10, :20] == 100).all() and not corner[10:-2, 2:-2].any() and not corner[2:-2, 20:-2].any()


def test_starts_are_inside_the_building(tmp_path):
    image = np.full((120, 160), 255, dtype=np.uint8)
    cv2.rectangle(image, (40, 20), (110, 70), 0, 2)
    cv2.imwrite(str(tmp_path / "plan.png"), image)
    world = load_world(tmp_path / "plan.png", 0.1)
    assert world.size_m == pytest.approx((16.0, 12.0))
    rng = np.random.default_rng(0)
    for _ in range(20):
        x, y, _ = world.free_start(rng)
        assert 4 < x < 11.1
        assert 2 < 12 - y < 7.1  # rows of images go down


def test_what_is_transparent_in_a_plan_is_floor_whatever_colour_it_hides(tmp_path):
    image = np.zeros((40, 60, 4), dtype=np.uint8)
    image[20, 10:50, 3] = 255  # a black wall on a background of transparent black
    cv2.imwrite(str(tmp_path / "plan.png"), image)
    is_wall = load_world(tmp_path / "plan.png", 0.1).is_wall
    assert is_wall[19, 10:50].all() and not is_wall[1:19, 1:-1].any() and not is_wall[20:-1, 1:-1].any()


def test_map_server_yaml_keeps_its_frame(tmp_path):
    cells = np.zeros((30, 50), dtype=np.int8)
    cells[10, 20], cells[5, 5] = 100, -1
    write_map(tmp_path / "m.yaml", OccupancyGrid(cells, 0.1, (-1.0, 2.0)))
    world = load_world(tmp_path / "m.yaml")
    assert world.grid.origin_m == (-1.0, 2.0)
    assert world.is_wall[10, 20]
    assert world.is_wall[5, 5]  # what nobody knows is no floor
    assert not world.is_wall[11, 20]


def test_errors_name_the_choices(tmp_path):
    with pytest.raises(InputError, match=r"no built-in world; those are arena1, arena2, office"):
        load_world("nowhere")
    with pytest.raises(InputError, match="whole number >= 0"):
        load_world("office:x")
    with pytest.raises(InputError, match=r"scale must be in 0.001..100 m per pixel"):
        load_world("office", -1.0)
    (tmp_path / "a.png").write_bytes(b"no image")
    with pytest.raises(InputError, match="not a readable image"):
        load_world(tmp_path / "a.png")
    with pytest.raises(InputError, match="no free cell"):
        World("dark", OccupancyGrid(np.full((9, 9), 100, dtype=np.int8), 0.1))


@pytest.mark.parametrize(
    ("name", "scale"),
    [("stage/hospital_section.png", 0.05), ("ipa/office_c.png", 0.05), ("mrl_arena/mrl_arena.yaml", None)],
)
def test_real_floor_plans(data_dir, name, scale):
    world = load_world(data_dir / "worlds" / name, scale)
    floor_m2 = np.count_nonzero(world.reachable) * world.resolution_m**2
    assert floor_m2 > 10
    start = world.free_start(np.random.default_rng(0))
    assert world.clearance_m(start[:2]) > 0.25


def test_a_campus_is_large_and_robots_reach_all_of_it():
    from scipy import ndimage

    for seed in range(4):
        world = load_world(f"campus:{seed}")
        assert 10_000.0 <= world.grid.cells.size * world.resolution_m**2 <= 14_000.0
        labels, _ = ndimage.label(world.clearance_cells * world.resolution_m > 0.3)
        areas = np.bincount(labels.ravel())[1:]
        assert areas.max() > 0.98 * areas.sum(), seed
    assert not np.array_equal(load_world("campus:0").grid.cells, load_world("campus:1").grid.cells)
    assert np.array_equal(load_world("campus:1").grid.cells, load_world("campus:1").grid.cells)


def test_buildings_of_a_campus_are_entered_from_two_sides():
    for seed in range(5):
        cells = building(np.random.default_rng(seed))
        for side, rest in ((cells[:, 0], cells[0]), (cells[:, -1], cells[-1])):
            assert 1.5 <= 0.05 * np.count_nonzero(side == 0) <= 1.7 and (rest == 100).all()


def test_there_is_a_yard_all_around_a_campus():
    cells = load_world("campus:0").grid.cells
    yard = round(0.9 * YARD_M / 0.05)
    for strip in (cells[2:yard], cells[-yard:-2], cells.T[2:yard], cells.T[-yard:-2]):
        assert (strip != 0).mean(axis=1).max() < 0.2  # no wall, only trees


def test_trees_stand_in_yards_and_robots_pass_between_them():
    from scipy import ndimage

    plan = Canvas(30.0, 30.0)
    is_yard = plan.cells == 0
    is_yard[:300] = False
    _plant(plan, np.random.default_rng(0), is_yard)
    assert not plan.cells[2:300, 2:-2].any()
    _, count = ndimage.label(plan.cells)
    assert count > 5  # the outer wall is one
    assert ndimage.label(ndimage.binary_dilation(plan.cells, np.ones((19, 19))))[1] == count  # 0.45 m wider all around
