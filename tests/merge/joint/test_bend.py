import numpy as np
import pytest
from scipy import ndimage

from mrslam.merge import Bend
from mrslam.merge.joint.bend_kernels import bend_tiles, displaced
from mrslam.spatial import Keyframes, OccupancyGrid, se2
from tests.merge.plans import building

KEYS = np.stack([np.linspace(0.0, 20.0, 41), np.full(41, 5.0), np.zeros(41)], axis=1)


def wave(keys: np.ndarray, amount_m: float = 0.3) -> np.ndarray:
    out = keys.copy()
    out[:, 1] += amount_m * np.sin(keys[:, 0] / 20.0 * np.pi)
    out[:, 2] += np.arctan(amount_m * np.pi / 20.0 * np.cos(keys[:, 0] / 20.0 * np.pi))
    return out


def test_a_rigid_move_does_not_bend():
    T = se2.transform(3.25, -1.5, 0.3)
    bend, grid = Bend(KEYS, se2.compose(T, KEYS)), building(3)
    assert bend.T_team_map == pytest.approx(T, abs=1e-9)
    bent = bend.bent(grid)
    assert np.array_equal(bent.cells, grid.cropped().cells) and bent.origin_m == pytest.approx(grid.cropped().origin_m)


def test_keyframes_come_to_lie_where_they_were_corrected_to():
    bend = Bend(KEYS, wave(KEYS))
    moved = KEYS[:, :2] + bend.displacement(KEYS[:, :2])
    assert np.hypot(*(se2.apply(bend.T_team_map, moved) - wave(KEYS)[:, :2]).T).max() < 0.05
    assert bend.most_m == pytest.approx(0.3, abs=0.15)


def test_a_wall_follows_the_way_along_it_and_stays_whole():
    cells = np.full((240, 460), -1, dtype=np.int8)
    cells[90:130, 20:440] = 0
    cells[130, 20:440] = 100  # a wall 6.5 m up, 1.5 m beside the way
    bend = Bend(KEYS, wave(KEYS))
    bent = bend.bent(OccupancyGrid(cells, 0.05))
    rows, cols = np.nonzero(bent.cells >= 65)
    x = (cols + 0.5) * 0.05 + bent.origin_m[0]
    y = (rows + 0.5) * 0.05 + bent.origin_m[1]
    inside = (x > 2.0) & (x < 18.0)
    off = y + bend.T_team_map[1] - (6.525 + 0.3 * np.sin(x / 20.0 * np.pi))
    assert np.abs(off[inside]).max() < 0.12
    assert np.unique(cols).size == cols.max() - cols.min() + 1  # no gap
    assert np.bincount(cols).max() <= 2


def test_slightly_other_keyframes_leave_the_map_as_it_was():
    grid = building(3)
    rng = np.random.default_rng(0)
    one = Bend(KEYS, wave(KEYS)).bent(grid)
    two = Bend(KEYS, wave(KEYS) + rng.normal(0.0, 1e-6, KEYS.shape)).bent(grid)
    assert (one.cells == two.cells).mean() > 0.999


def test_the_place_now_is_where_the_newest_keyframe_says():
    bend = Bend(KEYS, wave(KEYS))
    assert se2.compose(bend.T_team_map_now, KEYS[-1]) == pytest.approx(wave(KEYS)[-1])


def test_later_keyframes_go_on_rigidly_from_the_last_corrected_one():
    bend = Bend(KEYS[:30], wave(KEYS)[:30])
    poses = bend.extended(KEYS)
    assert np.array_equal(poses[:30], wave(KEYS)[:30])
    assert se2.between(poses[29], poses[35]) == pytest.approx(se2.between(KEYS[29], KEYS[35]))


def test_of_a_robot_that_came_back_with_fewer_keyframes_there_are_no_more():
    assert np.array_equal(Bend(KEYS, wave(KEYS)).extended(KEYS[:10]), wave(KEYS)[:10])


def test_a_map_of_few_keyframes_is_bent_too():
    few = KEYS[::20]
    bend = Bend(few, wave(few))
    moved = few[:, :2] + bend.displacement(few[:, :2])
    assert se2.apply(bend.T_team_map, moved) == pytest.approx(wave(few)[:, :2], abs=0.01)


def test_where_a_logs_time_leaps_back_each_pose_joins_the_keyframes_of_its_own_time():
    bend, stamps = Bend(KEYS, wave(KEYS)), np.roll(10 * np.arange(41), 20)
    assert bend.corrected_at(stamps, Keyframes(stamps, KEYS)).T_map_base == pytest.approx(wave(KEYS))


def test_poses_between_keyframes_join_both_and_go_on_beyond():
    bend, stamps = Bend(KEYS, wave(KEYS)), 10 * np.arange(41)
    way = Keyframes(stamps[:-1] + 5, KEYS[:-1] + np.array([0.25, 0.0, 0.0]))
    between = bend.corrected_at(stamps, way)
    assert np.array_equal(between.stamps_ns, way.stamps_ns)
    assert between.T_map_base[:, :2] == pytest.approx(0.5 * (wave(KEYS)[:-1] + wave(KEYS)[1:])[:, :2], abs=0.01)
    assert bend.corrected_at(stamps, Keyframes(stamps, KEYS)).T_map_base == pytest.approx(wave(KEYS))
    beyond = bend.corrected_at(stamps, Keyframes(np.array([500]), KEYS[-1:] + np.array([1.0, 0.0, 0.0]))).T_map_base[0]
    assert se2.between(wave(KEYS)[-1], beyond) == pytest.approx([1.0, 0.0, 0.0], abs=1e-9)


def test_displacement_is_bilinear_and_clamped():
    field = np.zeros((3, 3, 2), dtype=np.float32)
    field[1, 1] = (4.0, -2.0)
    assert displaced(field, 32.0, 32.0) == pytest.approx((4.0, -2.0))
    assert displaced(field, 16.0, 32.0) == pytest.approx((2.0, -1.0))
    assert displaced(field, 16.0, 16.0) == pytest.approx((1.0, -0.5))
    assert displaced(field, -100.0, 500.0) == pytest.approx((0.0, 0.0))


def test_no_wall_is_lost_where_a_map_is_pressed_together():
    """A wall one cell thick, anywhere on ground that is pressed together by 2 cells in 32."""
    field = np.zeros((3, 3, 2), dtype=np.float32)
    field[1, :, 1], field[2, :, 1] = -2.0, -4.0
    for row in range(64):
        cells = np.zeros((64, 64), dtype=np.int8)
        cells[row] = 100
        one, everywhere, out = (
            np.zeros((1, 1), dtype=np.int32),
            np.ones((2, 2), dtype=np.bool_),
            np.zeros((1, 64, 64), dtype=np.int8),
        )
        bend_tiles(cells[None], one, field, np.zeros((1, 2), dtype=np.int64), everywhere, out)
        landed = int((row + 0.5) * 30 / 32)
        assert (out[0, landed] == 100).all() and (
            np.delete(out[0], [landed - 1, landed, landed + 1], axis=0) < 65
        ).all()


@pytest.mark.parametrize("amount_m", [0.03, 0.3, 1.0])
def test_walls_stay_as_thick_as_they_are_and_whole(amount_m):
    """Twice as thick they would take their floor away, and contradict what others saw of it."""
    grid = building(3)
    bent = Bend(KEYS, wave(KEYS, amount_m)).bent(grid)
    before, after = (np.count_nonzero(one.is_occupied) for one in (grid, bent))
    whole, pieces = (ndimage.label(one.is_occupied, np.ones((3, 3)))[1] for one in (grid, bent))
    assert after == pytest.approx(before, rel=0.05) and pieces <= whole
    assert np.count_nonzero(bent.is_free) == pytest.approx(np.count_nonzero(grid.is_free), rel=0.03)
