import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import ndimage

from mrslam.merge import warp
from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.merge.grids.wall_kernels import LINKS
from mrslam.merge.grids.warp import Warp, to_source
from mrslam.merge.grids.warp_kernels import warp_window
from mrslam.spatial import UNKNOWN, InputError, OccupancyGrid, se2

EIGHT = np.ones((3, 3))
angles = st.floats(-math.pi, math.pi)
shifts = st.floats(-3.0, 3.0)


def walls() -> dict[str, np.ndarray]:
    """Thin walls of all kinds in free space with unknown beyond."""
    out = {}
    for name in ("across", "up", "diagonal", "flat stairs", "steep stairs", "full stairs", "corner", "T", "half known"):
        cells = np.full((60, 60), UNKNOWN, dtype=np.int8)
        cells[2:58, 2:58] = 0
        out[name] = cells
    out["across"][30, 5:55] = 100
    out["up"][5:55, 30] = 100
    for i in range(5, 50):
        out["diagonal"][i, i] = 100
        out["flat stairs"][20 + i // 3, i] = 100
        out["steep stairs"][i, 20 + i // 2] = 100
        out["full stairs"][i, i : i + 2] = 100
    out["corner"][30, 5:31] = out["corner"][30:55, 30] = 100
    out["T"][30, 5:55] = out["T"][30:55, 30] = 100
    out["half known"][30, 5:55] = 100
    out["half known"][31:] = UNKNOWN
    return out


WALLS = walls()


@pytest.mark.parametrize("name", WALLS)
@pytest.mark.parametrize("fixed", [math.pi / 4, -math.pi / 4, 0.75 * math.pi, math.atan(0.5), 1e-7, None])
def test_thin_walls_stay_thin_and_whole_at_any_angle(name, fixed):
    grid = OccupancyGrid(WALLS[name], 0.05, (-1.5, -1.5))

    @settings(max_examples=25, deadline=None)
    @given(shifts, shifts, angles if fixed is None else st.just(fixed))
    def check(x, y, theta):
        turned = warp(grid, se2.transform(x, y, theta))
        wall = turned.is_occupied
        assert ndimage.label(wall, EIGHT)[1] == 1, "the wall is broken"
        thick = wall[:-1, :-1] & wall[1:, :-1] & wall[:-1, 1:] & wall[1:, 1:]
        assert not (thick[:-1, :-1] & thick[1:, 1:]).any(), "the wall is three cells thick"
        length = np.count_nonzero(grid.is_occupied)
        assert np.count_nonzero(wall) <= 1.6 * length
        # It lies where it should: every old wall cell has new wall next to it, and the other way round.
        old, new = se2.apply(se2.transform(x, y, theta), grid.centres(grid.is_occupied)), turned.centres(wall)
        apart = np.linalg.norm(old[:, None] - new[None], axis=-1)
        assert apart.min(axis=1).max() < 1.5 * 0.05
        assert apart.min(axis=0).max() < 1.5 * 0.05

    check()


@settings(max_examples=60, deadline=None)
@given(shifts, shifts, angles)
def test_free_space_keeps_its_extent_and_unknown_stays_unknown(x, y, theta):
    cells = np.full((80, 90), UNKNOWN, dtype=np.int8)
    cells[10:60, 20:75] = 0
    cells[60, 20:75] = 100  # a wall to the unknown
    cells[20:30, 30:45] = UNKNOWN  # never seen
    grid = OccupancyGrid(cells, 0.05, (-2.0, -2.0))
    T = se2.transform(x, y, theta)
    turned = warp(grid, T)
    free, was_free = np.count_nonzero(turned.is_free), np.count_nonzero(grid.is_free)
    assert abs(free - was_free) <= max(0.02 * was_free, 55)  # a row, where a shift is half a cell
    back = se2.apply(se2.inverse(T), turned.centres(turned.is_known))
    row, col = (back[:, 1] + 2.0) / 0.05, (back[:, 0] + 2.0) / 0.05
    far_inside_unknown = (row > 21) & (row < 29) & (col > 31) & (col < 44)
    outside = (row < 8.5) | (row > 62.5) | (col < 18.5) | (col > 76.5)
    assert not (far_inside_unknown | outside).any()


@pytest.mark.parametrize("quarter", range(-2, 5))
def test_quarter_turns_and_whole_cells_lose_nothing(quarter):
    rng = np.random.default_rng(quarter + 9)
    cells = rng.integers(-1, 101, size=(37, 52)).astype(np.int8)
    grid = OccupancyGrid.at_cell(cells, 0.05, -11, 4)
    turned = warp(grid, se2.transform(0.35, -1.25, quarter * math.pi / 2))
    np.testing.assert_array_equal(turned.cells, np.rot90(cells, -quarter))
    back = warp(turned, se2.inverse(se2.transform(0.35, -1.25, quarter * math.pi / 2)))
    np.testing.assert_array_equal(back.cells, cells)
    assert back.cell0 == (-11, 4)


def test_a_map_off_the_lattice_lands_on_it_where_it_belongs():
    grid = OccupancyGrid(WALLS["corner"], 0.05, (-1.513, 0.021))
    moved = warp(grid, se2.IDENTITY)
    assert moved.on_lattice
    shift = moved.centres(moved.is_known).mean(axis=0) - grid.centres(grid.is_known).mean(axis=0)
    assert np.abs(shift).max() < 0.0251


@settings(max_examples=30, deadline=None)
@given(angles, st.sampled_from([0.05, 0.07, 0.1, 0.2]))
def test_a_coarser_lattice_keeps_every_wall_whole(theta, resolution):
    cells = np.full((120, 120), UNKNOWN, dtype=np.int8)
    cells[4:116, 4:116] = 0
    cells[60, 20:100] = 100
    cells[30:32, 20:100] = 100
    cells[80:85, 20:100] = 100
    turned = warp(OccupancyGrid(cells, 0.02), se2.transform(0.3, 0.1, theta), resolution)
    assert ndimage.label(turned.is_occupied, EIGHT)[1] == 3 or resolution >= 0.2
    assert turned.resolution_m == resolution
    for row, length in ((60.5, 80), (31.0, 80), (82.5, 80)):
        along = np.stack([np.linspace(21, 99, length), np.full(length, row)], axis=-1) * 0.02
        target = se2.apply(se2.transform(0.3, 0.1, theta), along)
        near = np.linalg.norm(target[:, None] - turned.centres(turned.is_occupied)[None], axis=-1).min(axis=1)
        assert near.max() < 1.01 * resolution


@settings(max_examples=30, deadline=None)
@given(angles)
def test_a_finer_lattice_keeps_widths_in_metres(theta):
    grid = OccupancyGrid(WALLS["diagonal"], 0.1)
    fine = warp(grid, se2.transform(0.0, 0.0, theta), 0.05)
    assert ndimage.label(fine.is_occupied, EIGHT)[1] == 1
    assert fine.known_area_m2() == pytest.approx(grid.known_area_m2(), rel=0.02)
    assert np.count_nonzero(fine.is_occupied) * 0.05**2 == pytest.approx(0.45, rel=0.25)


@settings(max_examples=40, deadline=None)
@given(arrays(np.int8, (30, 40), elements=st.sampled_from([-1, 0, 0, 50, 100])), shifts, shifts, angles)
def test_a_tile_is_a_cut_of_the_whole(cells, x, y, theta):
    grid, T = OccupancyGrid(cells, 0.05, (0.1, -0.3)).cropped(), se2.transform(x, y, theta)
    whole = warp(grid, T)
    if min(whole.shape) < 6:
        return
    row0, col0 = whole.cell0
    tile = Warp(TiledGrid.of(grid), T, 0.05).square(row0 + 3, col0 + 5, 16)
    np.testing.assert_array_equal(tile[: whole.shape[0] - 3, : whole.shape[1] - 5], whole.cells[3:19, 5:21])


@settings(max_examples=60, deadline=None)
@given(
    arrays(np.int8, (12, 13), elements=st.sampled_from([-1, 0, 20, 50, 80, 100])),
    st.integers(-20, 20), st.integers(-20, 20), st.integers(-30, 30), st.integers(-30, 30),
)  # fmt: skip
def test_cells_of_one_lattice_are_copied_as_they_would_be_drawn(cells, cell_x, cell_y, row0, col0):
    grid, T = OccupancyGrid.at_cell(cells, 0.05, 7, -4), se2.transform(0.05 * cell_x, 0.05 * cell_y, 0.0)
    drawn = np.full((16, 16), UNKNOWN, dtype=np.int8)
    warp_window(grid.cells, to_source(grid.origin_m, 0.05, T, 0.05), 1.0, row0, col0, drawn)
    np.testing.assert_array_equal(Warp(TiledGrid.of(grid), T, 0.05).square(row0, col0, 16), drawn)


def test_single_cells_survive_any_angle():
    cells = np.zeros((21, 21), dtype=np.int8)
    cells[10, 10] = 100
    for theta in np.linspace(0, 2 * math.pi, 97):
        assert np.count_nonzero(warp(OccupancyGrid(cells, 0.05), se2.transform(0.01, 0.02, theta)).is_occupied) == 1


def naive_warp(grid: OccupancyGrid, T: np.ndarray, row0: int, col0: int, shape: tuple[int, int]) -> np.ndarray:
    """The same rules at one resolution, cell by cell in plain Python: sample, then draw thin walls as lines."""
    cells, res = grid.cells, grid.resolution_m
    height, width = cells.shape

    def wall(r, c):
        return 0 <= r < height and 0 <= c < width and cells[r, c] >= 65

    def thick(r, c):
        return any(wall(r + i, c) and wall(r, c + j) and wall(r + i, c + j) for i in (-1, 1) for j in (-1, 1))

    def beside(r, c, fx, fy):
        sx, sy = (1 if fx >= 0 else -1), (1 if fy >= 0 else -1)
        ways = [(0, sx), (sy, 0)] if abs(fx) >= abs(fy) else [(sy, 0), (0, sx)]
        for dr, dc in [*ways, *((-i, -j) for i, j in ways)]:
            if not (0 <= r + dr < height and 0 <= c + dc < width):
                return -1
            if not wall(r + dr, c + dc):
                return cells[r + dr, c + dc]
        return cells[r, c]

    out = np.full(shape, UNKNOWN, dtype=np.int8)
    for i, j in np.ndindex(shape):
        x, y = se2.apply(se2.inverse(T), np.array([col0 + j + 0.5, row0 + i + 0.5]) * res) - grid.origin_m
        c, r = math.floor(x / res), math.floor(y / res)
        if 0 <= r < height and 0 <= c < width:
            thin = wall(r, c) and not thick(r, c)
            out[i, j] = beside(r, c, x / res - c - 0.5, y / res - r - 0.5) if thin else cells[r, c]

    def put(row, col, value):
        if 0 <= row - row0 < shape[0] and 0 <= col - col0 < shape[1]:
            out[row - row0, col - col0] = max(out[row - row0, col - col0], value)

    def place(r, c):
        return se2.apply(T, np.array([c + 0.5, r + 0.5]) * res + grid.origin_m) / res

    turn = se2.transform(0.0, 0.0, T[2])
    for r, c in np.argwhere(cells >= 65):
        links = []
        for dr, dc in LINKS:
            if not wall(r + dr, c + dc):
                continue
            if dr and dc and (wall(r + dr, c) or wall(r, c + dc)):
                continue
            if not (dr and dc) and thick(r, c) and thick(r + dr, c + dc):
                continue
            links.append((dr, dc))
        for dr, dc in links:
            way = np.round(np.abs(se2.apply(turn, [dc, dr])), 9)
            axis = 0 if way[0] >= way[1] else 1
            start, end = sorted((place(r, c), place(r + dr, c + dc)), key=lambda p: p[axis])
            here_first = place(r, c)[axis] <= place(r + dr, c + dc)[axis]
            ends = (cells[r, c], cells[r + dr, c + dc])
            for step in range(math.ceil(start[axis] - 0.5), math.ceil(end[axis] - 0.5)):
                t = (step + 0.5 - start[axis]) / (end[axis] - start[axis])
                other = math.floor(start[1 - axis] + t * (end[1 - axis] - start[1 - axis]))
                value = ends[int((t >= 0.5) == here_first)]
                put(*((other, step) if axis == 0 else (step, other)), value)
        ways = [np.round(se2.apply(turn, [dc, dr]), 9) for dr, dc in links]
        axes = [0 if abs(way[0]) >= abs(way[1]) else 1 for way in ways]
        onward = len(links) == 2 and axes[0] == axes[1] and ways[0][axes[0]] * ways[1][axes[0]] < 0
        if (links or not thick(r, c)) and not (onward and not thick(r, c)):
            u, v = place(r, c)
            put(math.floor(v), math.floor(u), cells[r, c])
    return out


@settings(max_examples=40, deadline=None)
@given(arrays(np.int8, (12, 13), elements=st.sampled_from([-1, 0, 20, 50, 80, 100])), shifts, shifts, angles)
def test_the_kernel_does_what_its_slow_twin_does(cells, x, y, theta):
    grid, T = OccupancyGrid(cells, 0.05, (0.012, -0.3)), se2.transform(x, y, theta)
    at = se2.apply(T, grid.centres(np.ones(cells.shape, dtype=np.bool_))) / 0.05
    assume(np.abs(at - np.round(at)).min() > 1e-6)  # the twin takes another way for centres exactly between two cells
    row0, col0 = (int(v) - 12 for v in np.floor(se2.apply(T, [0.33, 0.0]) / 0.05)[::-1])
    found = Warp(TiledGrid.of(grid), T, 0.05).square(row0, col0, 24)
    wanted = naive_warp(grid, T, row0, col0, (24, 24))
    # Rounding decides points exactly between cells; the twin takes another way there.
    assert np.count_nonzero(found != wanted) <= 1


@pytest.mark.parametrize("shape", [(0, 0), (5, 5)])
def test_nothing_known_gives_nothing(shape):
    assert warp(OccupancyGrid(np.full(shape, UNKNOWN, dtype=np.int8), 0.05), se2.IDENTITY).shape == (0, 0)


def test_nonsense_is_refused_in_words():
    grid = OccupancyGrid(np.zeros((2, 2), dtype=np.int8), 0.05)
    with pytest.raises(InputError, match="three finite numbers"):
        warp(grid, [0.0, 0.0])
    with pytest.raises(InputError, match="three finite numbers"):
        warp(grid, [0.0, np.nan, 0.0])
    with pytest.raises(InputError, match="resolution_m must be > 0 m"):
        warp(grid, se2.IDENTITY, 0.0)
    with pytest.raises(InputError, match="too large"):
        warp(OccupancyGrid(np.zeros((100, 100), dtype=np.int8), 10.0), se2.IDENTITY, 0.01)
