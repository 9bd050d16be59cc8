"""Small maps to align."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.prepared import PreparedMap, prepare, working_resolution
from mrslam.spatial import OccupancyGrid, se2


class House:
    """A made-up floor: rooms as walls on a lattice, from which partial maps in any frame are drawn."""

    def __init__(self, seed: int = 0) -> None:
        rng = np.random.default_rng(seed)
        self.res = 0.05
        cells = np.zeros((400, 520), dtype=np.int8)
        cells[:4], cells[-4:], cells[:, :4], cells[:, -4:] = 100, 100, 100, 100
        for c in (120, 250, 390):
            cells[:, c : c + 4] = 100
            for r in rng.integers(20, 360, 2):
                cells[r : r + 20, c : c + 4] = 0
        for c0, c1 in ((0, 120), (124, 250), (254, 390), (394, 520)):
            r = int(rng.integers(120, 280))
            cells[r : r + 4, c0:c1] = 100
            door = int(rng.integers(c0 + 10, c1 - 30))
            cells[r : r + 4, door : door + 18] = 0
        for _ in range(14):
            r, c = int(rng.integers(20, 370)), int(rng.integers(20, 490))
            h, w = rng.integers(5, 22, 2)
            cells[r : r + h, c : c + w] = 100
        self.cells = cells

    def part(self, rows: slice, cols: slice, T_map_world: se2.Transform, res: float | None = None) -> OccupancyGrid:
        """Return the part of the floor seen, in a frame of its own, walls only where they border free space."""
        res = res or self.res
        height, width = self.cells.shape
        corners = np.array(
            [[cols.start, rows.start], [cols.stop, rows.start], [cols.start, rows.stop], [cols.stop, rows.stop]]
        )
        at = se2.apply(T_map_world, corners * self.res)
        low = np.floor(at.min(axis=0) / res) * res
        shape = tuple(int(n) for n in (np.ceil((at.max(axis=0) - low) / res) + 1)[::-1])
        out = OccupancyGrid(np.full(shape, -1, dtype=np.int8), res, (float(low[0]), float(low[1])))
        back = se2.apply(se2.inverse(T_map_world), out.centres(np.ones(shape, dtype=np.bool_)))
        c, r = np.floor(back[:, 0] / self.res).astype(int), np.floor(back[:, 1] / self.res).astype(int)
        seen = (r >= rows.start) & (r < rows.stop) & (c >= cols.start) & (c < cols.stop)
        seen &= (r >= 0) & (r < height) & (c >= 0) & (c < width)
        values = np.full(len(back), -1, dtype=np.int8)
        values[seen] = self.cells[r[seen], c[seen]]
        grid = values.reshape(shape)
        solid = grid == 100
        near_free = np.zeros(shape, dtype=np.bool_)
        free = np.pad(grid == 0, 1)
        for dr in range(3):
            for dc in range(3):
                near_free |= free[dr : dr + shape[0], dc : dc + shape[1]]
        grid[solid & ~near_free] = -1
        return OccupancyGrid(grid, res, out.origin_m)


@pytest.fixture(scope="session")
def house() -> House:
    return House()


T_A = se2.transform(3.0, -2.0, 0.4)
T_B = se2.transform(-7.0, 4.5, math.radians(160.0))
T_A_B = se2.compose(T_A, se2.inverse(T_B))


@pytest.fixture(scope="session")
def pair(house: House) -> tuple[OccupancyGrid, OccupancyGrid, se2.Transform]:
    """Two maps that share about half, and their true ``T_a_b``."""
    a = house.part(slice(0, 400), slice(0, 330), T_A)
    b = house.part(slice(0, 400), slice(170, 520), T_B)
    return a, b, T_A_B


@pytest.fixture(scope="session")
def sides(pair: tuple[OccupancyGrid, OccupancyGrid, se2.Transform]) -> tuple[PreparedMap, PreparedMap]:
    """The same two maps, prepared."""
    a, b = pair[0].cropped(), pair[1].cropped()
    res = working_resolution(a, b, AlignmentConfig())
    return prepare(a, res), prepare(b, res)
