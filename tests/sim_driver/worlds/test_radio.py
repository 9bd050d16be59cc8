import numpy as np
import pytest

from mrslam.sim_driver.worlds import World, load_world
from mrslam.sim_driver.worlds.canvas import Canvas
from mrslam.sim_driver.worlds.radio import Radio, RadioConfig, count_walls
from mrslam.spatial import InputError, OccupancyGrid

CLEAR = RadioConfig(shadowing_db=0.0)


@pytest.fixture(scope="module")
def rooms():
    return World("rooms", Canvas(40.0, 10.0).wall(10, 0, 10, 10).wall(12, 0, 12, 10).wall(20, 0, 20, 10).grid())


def naive_walls(is_wall, a, b):
    """Sample the line finely and count entries into wall."""
    line = a + np.linspace(0, 1, 20_001)[:, None] * (b - a)
    col, row = np.floor(line).astype(int).T
    inside = is_wall[row, col].astype(int)
    return int((np.diff(inside) == 1).sum() + inside[0])


def test_counts_walls_as_the_fine_line_does():
    world, rng = load_world("office:2"), np.random.default_rng(0)
    same = 0
    for _ in range(200):
        a, b = (world.free_start(rng)[:2] / world.resolution_m for _ in range(2))
        count = count_walls(world.is_wall, *a, *b)
        assert abs(count - naive_walls(world.is_wall, a, b)) <= 1  # corners that the samples step over
        same += count == naive_walls(world.is_wall, a, b)
    assert same > 190


def test_free_space_loss_and_walls(rooms):
    radio = Radio(rooms, CLEAR)
    assert radio.link((1, 5), (2, 5)).rssi_dbm == pytest.approx(15 - 40)
    assert radio.link((1, 5), (9, 5)).rssi_dbm == pytest.approx(15 - 40 - 20 * np.log10(8))
    assert [radio.link((1, 5), (x, 5)).walls for x in (9, 11, 15, 30)] == [0, 1, 2, 3]
    drop = radio.link((21, 5), (29, 5)).rssi_dbm - radio.link((5, 5), (13, 5)).rssi_dbm
    assert drop == pytest.approx(2 * 6.0)


def test_delivery_is_half_at_the_sensitivity_and_falls_smoothly(rooms):
    at_10_m = 15.0 - 40.0 - 20.0
    config = RadioConfig(shadowing_db=0.0, wall_loss_db=0.0, sensitivity_dbm=at_10_m)
    radio = Radio(rooms, config)
    assert radio.link((1, 5), (11, 5)).delivery == pytest.approx(0.5)
    deliveries = [radio.link((1, 5), (1 + d, 5)).delivery for d in (2, 5, 10, 15, 30)]
    assert deliveries == sorted(deliveries, reverse=True)
    assert deliveries[0] > 0.99
    link = radio.link((1, 5), (11, 5))
    assert link.quality == pytest.approx(0.25)


def test_a_dead_link(rooms):
    link = Radio(rooms, RadioConfig(power_dbm=-60.0)).link((1, 5), (30, 5))
    assert (link.delivery, link.quality) == (0.0, 0.0)
    assert Radio(rooms, RadioConfig(range_m=5.0)).quality((1, 5), (7, 5)) == 0.0


def test_links_are_the_same_both_ways_and_for_one_seed():
    world, rng = load_world("office"), np.random.default_rng(2)
    radio, twin, other = Radio(world, seed=4), Radio(world, seed=4), Radio(world, seed=5)
    differ = 0
    for _ in range(40):
        a, b = world.free_start(rng), world.free_start(rng)
        assert radio.quality(a, b) == pytest.approx(radio.quality(b, a))
        assert radio.link(a, b).walls == radio.link(b, a).walls
        assert radio.quality(a, b) == twin.quality(a, b)
        differ += radio.link(a, b).rssi_dbm != other.link(a, b).rssi_dbm
    assert differ > 30


def test_lines_that_graze_corners_are_the_same_both_ways_too():
    world, rng = load_world("office"), np.random.default_rng(2)
    rows, cols = np.nonzero(world.reachable)
    some = rng.integers(len(rows), size=8000)
    places = (np.stack([cols[some], rows[some]], axis=1) + 0.5) * world.resolution_m
    radio, pairs = Radio(world, CLEAR), np.arange(8000).reshape(-1, 2)
    assert radio.qualities(places, pairs) == radio.qualities(places, pairs[:, ::-1])


def test_all_links_at_once_are_those_asked_one_by_one():
    world, rng = load_world("office"), np.random.default_rng(2)
    radio = Radio(world, seed=4)
    places = np.array([world.free_start(rng)[:2] for _ in range(6)])
    places[1] = places[0]
    pairs = np.array([(i, j) for i in range(6) for j in range(6)])
    wanted = [radio.quality(places[i], places[j]) for i, j in pairs]
    assert radio.qualities(places, pairs) == wanted
    assert len(set(wanted)) > 10


def test_shadowing_has_its_spread_and_its_distance(rooms):
    config = RadioConfig(shadowing_db=4.0, shadowing_distance_m=3.0)
    at = [8.0, 9.0, 11.0, 20.0]
    field = []
    for seed in range(400):
        radio = Radio(rooms, config, seed)
        field.append([radio.shadowing_db(np.array([2.0, 2.0]), np.array([x, 5.0])) for x in at])
    field = np.array(field)
    assert field.std(axis=0) == pytest.approx([4.0] * 4, rel=0.12)
    correlation = np.corrcoef(field.T)[0]
    assert correlation[1] == pytest.approx(np.exp(-1 / 3), abs=0.1)
    assert correlation[2] == pytest.approx(np.exp(-3 / 3), abs=0.12)
    assert abs(correlation[3]) < 0.15


def test_shadowing_is_a_loss_that_fades_out_between_neighbours(rooms):
    radio, clear = Radio(rooms, seed=1), Radio(rooms, CLEAR)
    a, b = np.array([2.0, 2.0]), np.array([8.0, 5.0])
    shadow_db = radio.shadowing_db(a, b)
    assert abs(shadow_db) > 1.0
    assert radio.link(a, b).rssi_dbm == pytest.approx(clear.link(a, b).rssi_dbm - shadow_db)
    beside, away = a + np.array([0.001, 0.0]), a + np.array([1.0, 0.0])
    assert abs(radio.shadowing_db(a, beside)) < 0.05 < abs(radio.shadowing_db(a, away))


def test_walls_are_counted_where_they_are_in_the_worlds_frame(rooms):
    grid = rooms.grid
    moved = World("moved", OccupancyGrid(grid.cells, grid.resolution_m, (-20.0, 3.0)))
    assert Radio(moved).link((-19.0, 8.0), (-5.0, 8.0)).walls == Radio(rooms).link((1, 5), (15, 5)).walls == 2


def test_robots_side_by_side_always_hear_each_other():
    world = load_world("office")
    for seed in range(20):
        assert Radio(world, seed=seed).quality((5.0, 2.0), (5.4, 2.0)) > 0.99


def test_settings_are_checked():
    with pytest.raises(InputError, match=r"radio\.wall_loss_db must be in 0\.\.1000 dB, got -3"):
        RadioConfig(wall_loss_db=-3)
