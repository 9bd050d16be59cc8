import numpy as np
import pytest
from scipy import ndimage

from mrslam.mutual_detection import clear_ghosts, ghosts
from mrslam.spatial import OccupancyGrid


def room():
    cells = np.zeros((80, 120), dtype=np.int8)
    cells[[0, -1], :] = 100
    cells[:, [0, -1]] = 100
    cells[:30, 60] = 100
    cells[60:, :20] = -1
    return cells


def ring(cells, x, y, radius=0.18, resolution=0.05):
    """Draw a teammate's outline."""
    angles = np.linspace(0, 2 * np.pi, 60)
    rows = ((y + radius * np.sin(angles)) / resolution).astype(int)
    cells[rows, ((x + radius * np.cos(angles)) / resolution).astype(int)] = 100


def test_specks_on_a_path_go_and_walls_stay():
    clean, cells = room(), room()
    for x in (1.0, 1.8, 2.4, 4.0, 5.0):
        ring(cells, x, 2.5)
    path = np.stack([np.arange(0.5, 5.6, 0.5), np.full(11, 2.52)], axis=-1)
    grid, cleared = clear_ghosts(OccupancyGrid(cells, 0.05), [path], 0.18)
    assert cleared == np.count_nonzero(cells != clean)
    assert np.array_equal(grid.cells, clean)


def test_without_a_path_there_nothing_is_touched():
    cells = room()
    ring(cells, 2.0, 2.5)
    for paths in ([], [np.empty((0, 2))], [np.array([[5.0, 1.0], [np.nan, 1.0]])], [np.array([[99.0, -9.0]])]):
        grid, cleared = clear_ghosts(OccupancyGrid(cells, 0.05), paths, 0.18)
        assert cleared == 0
        assert np.array_equal(grid.cells, cells)


def test_places_that_are_not_numbers_are_left_out_of_a_path():
    cells = room()
    ring(cells, 2.0, 2.5)
    for nothing in (np.nan, np.inf, -np.inf):
        path = np.array([[1.5, 2.5], [nothing, 2.5], [2.5, 2.5], [2.5, nothing]])
        grid, _ = clear_ghosts(OccupancyGrid(cells, 0.05), [path], 0.18)
        assert np.array_equal(grid.cells, room())


def test_a_path_close_along_a_wall_leaves_the_wall():
    cells = room()
    path = np.stack([np.full(20, 3.0 - 0.22), np.linspace(0.3, 1.4, 20)], axis=-1)
    assert clear_ghosts(OccupancyGrid(cells, 0.05), [path], 0.18)[1] == 0


def test_a_ghost_that_touches_a_wall_loses_what_lies_in_the_way():
    cells = room()
    cells[10:14, 55:60] = 100  # sticks to the wall at x = 3
    path = np.array([[2.3, 0.6], [2.7, 0.6]])
    grid, cleared = clear_ghosts(OccupancyGrid(cells, 0.05), [path], 0.18)
    assert cleared >= 4
    assert (grid.cells[:30, 60] == 100).all()
    assert (grid.cells[12, 55:57] == 0).all()


def test_a_pillar_beside_the_path_stays():
    cells = room()
    ring(cells, 2.0, 2.5, radius=0.25)
    path = np.array([[1.0, 2.0], [3.0, 2.0]])  # passes it at 0.25 m
    assert clear_ghosts(OccupancyGrid(cells, 0.05), [path], 0.18)[1] == 0


def test_unknown_cells_and_gaps_in_the_path():
    cells = room()
    ring(cells, 2.0, 2.5)
    far_apart = np.array([[1.0, 2.5], [3.2, 2.5]])
    grid, cleared = clear_ghosts(OccupancyGrid(cells, 0.05), [far_apart], 0.18)
    assert cleared == 0
    assert np.array_equal(grid.cells == -1, cells == -1)


def naive(grid, paths, radius):
    """Measure the distance to the paths of every cell, and take groups of occupied cells as wholes."""
    beside = 20  # cells outside of the map from where a body reaches into it
    swept = np.zeros(np.array(grid.shape) + 2 * beside, dtype=bool)
    for path in paths:
        for a, b in zip(path, [*path[1:], path[-1]], strict=True):
            joined = np.hypot(*(b - a)) <= ghosts.LONGEST_STEP_M
            for share in np.linspace(0, 1, 400) if joined else (0.0,):
                col, row = beside + np.floor((a + share * (b - a) - grid.origin_m) / grid.resolution_m).astype(int)
                if 0 <= row < swept.shape[0] and 0 <= col < swept.shape[1]:
                    swept[row, col] = True
    away = ndimage.distance_transform_edt(~swept) * grid.resolution_m if swept.any() else np.full(swept.shape, np.inf)
    away = away[beside:-beside, beside:-beside]
    gone = grid.is_occupied & (away <= radius - ghosts.INSIDE_M)
    left = {tuple(cell) for cell in np.argwhere(grid.is_occupied)}
    while left:
        speck, todo = set(), [left.pop()]
        while todo:
            cell = todo.pop()
            speck.add(cell)
            near = {c for c in left if max(abs(c[0] - cell[0]), abs(c[1] - cell[1])) <= ghosts.GAP_CELLS}
            left -= near
            todo += near
        if max(away[cell] for cell in speck) <= radius + ghosts.AROUND_M:
            for cell in speck:
                gone[cell] = True
    return np.where(gone, 0, grid.cells)


def test_a_path_just_beside_the_map_clears_what_the_body_reached():
    cells = room()[20:, :]  # the map ends below the robot's way, which leads along its first row
    cells[0, 20:60:20] = 100
    path = np.array([[0.5, -0.03], [1.5, -0.03], [2.5, -0.03]])
    grid, cleared = clear_ghosts(OccupancyGrid(cells, 0.05), [path], 0.18)
    assert cleared == 2 and not grid.is_occupied[0, 20:60].any()


@pytest.mark.parametrize("seed", range(6))
def test_clears_what_the_slow_twin_clears(seed):
    rng = np.random.default_rng(seed)
    cells = np.where(rng.random((70, 90)) < 0.01, 100, room()[:70, :90]).astype(np.int8)
    grid = OccupancyGrid(cells, 0.05, (-1.0, 0.5))
    paths = [np.cumsum(rng.normal(0, 0.3, (12, 2)), axis=0) + np.array([1.0, 2.0]) for _ in range(2)]
    cleared, count = clear_ghosts(grid, paths, 0.18)
    expected = naive(grid, paths, 0.18)
    # The paths are sampled once a cell here and finely there: cells whose corner alone is passed may differ.
    assert np.count_nonzero(cleared.cells != expected) <= 0.1 * np.count_nonzero(expected != cells)
    assert count == np.count_nonzero(cleared.cells != cells) > 2


@pytest.mark.parametrize("step_m", [0.02, 0.05, 0.4, 2.0])
def test_marks_the_whole_body_at_every_cell_it_passes(step_m):
    """Steps of less than a cell, of several, and points that are not joined."""
    rng = np.random.default_rng(3)
    heading = np.cumsum(rng.normal(0, 0.7, 80))
    path = 20.0 + np.cumsum(step_m / 0.05 * np.stack([np.cos(heading), np.sin(heading)], axis=1), axis=0)
    rows, cols, disc = ghosts._disc(0.18, 0.05)
    longest = ghosts.LONGEST_STEP_M / 0.05
    marks = np.zeros((60, 70), dtype=np.uint8)
    cells = np.where(rng.random((60, 70)) < 0.2, 100, 0).astype(np.int8)
    found = np.empty(cells.size, dtype=np.int64)
    fresh = ghosts._fresh(rows, cols, disc)
    count = 0
    for part in (path[:40], path[39:]):
        count = ghosts.mark(marks, part, longest, rows, cols, disc, *fresh, cells, 65, found, count)
    expected = np.zeros_like(marks)
    for a, b in zip(path, [*path[1:], path[-1]], strict=True):
        length = float(np.hypot(*(b - a)))
        steps = int(length) + 1 if length <= longest else 0
        for k in range(steps + 1):
            col, row = np.floor(a + (k / steps if steps else 0.0) * (b - a)).astype(int)
            r, c = row + rows, col + cols
            inside = (r >= 0) & (c >= 0) & (r < 60) & (c < 70)
            np.maximum.at(expected, (r[inside], c[inside]), disc[inside])
    np.testing.assert_array_equal(marks, expected)
    assert sorted(found[:count]) == np.flatnonzero((expected > 0) & (cells > 65)).tolist()
