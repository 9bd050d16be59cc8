"""Where in a large map a few scans may lie: all poses of a wide window are tried, most of them in one look."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import se2
from mrslam.spatial.matching.branch_and_bound import ALIKE, CELL_M, branch_and_bound
from mrslam.spatial.se2 import Transform

TURN_STEP_RAD = 0.02
"""Step of the heading: moves a wall 12 m away by a cell."""
HIT, BESIDE = 2, 1
"""Score of a point on a wall's cell, and on one next to it."""
LEVELS = 7
"""Squares of up to 2^(LEVELS - 1) cells, 16 m."""
LOOKS_MOST = 100_000
"""Most squares that are looked at: bounds the time of one search, some 15 ms."""


class WallGrid(NamedTuple):
    """Walls as scores, and their maxima over larger squares."""

    levels: NDArray[np.uint8]
    """``(LEVELS, rows, cols)``: level h at (r, c) is the largest score of rows r .. r + 2^h - 1, columns likewise."""
    low_m: NDArray[np.float64]
    """``(2,)``, map frame: corner of cell (0, 0)."""


class Spot(NamedTuple):
    """A pose that scans fit."""

    T_map_scan: Transform
    """``(3,)``, metres and radians, to half a cell."""
    share: float
    """0..1: score as a share of a perfect one."""


class Search(NamedTuple):
    """What a search found."""

    spots: list[Spot]
    """Distinct places that are good enough, the best one first."""
    is_complete: bool
    """Whether nothing was passed over for lack of time."""

    @property
    def spot(self) -> Spot | None:
        """The best place, None where none is good enough."""
        return self.spots[0] if self.spots else None


def wall_grid(walls: NDArray[np.float64]) -> WallGrid:
    """Return the grid of points on walls, ``(N, 2)``, map frame, metres."""
    pad = 1 << LEVELS  # scoring relies on a rim without walls
    low = np.floor(walls.min(axis=0) / CELL_M).astype(np.int64) - pad
    size = np.floor(walls.max(axis=0) / CELL_M).astype(np.int64) - low + pad
    cells = np.floor(walls / CELL_M).astype(np.int64) - low
    levels = np.zeros((LEVELS, size[1], size[0]), dtype=np.uint8)
    base = levels[0]
    for row in (-1, 0, 1):
        for col in (-1, 0, 1):
            base[cells[:, 1] + row, cells[:, 0] + col] = BESIDE
    base[cells[:, 1], cells[:, 0]] = HIT
    for h in range(1, LEVELS):
        half, below, level = 1 << (h - 1), levels[h - 1], levels[h]
        level[:] = below
        np.maximum(level[:-half], below[half:], out=level[:-half])
        across = level.copy()
        np.maximum(level[:, :-half], across[:, half:], out=level[:, :-half])
    return WallGrid(levels, low * CELL_M)


def find(
    grid: WallGrid,
    points: NDArray[np.float64],
    centre: Transform,
    half_m: float,
    half_rad: float,
    share_least: float,
    other_than: Sequence[Transform] = (),
    looks_most: int = LOOKS_MOST,
    most: int = 1,
) -> Search:
    """Return the pose that most of ``points (N, >= 2)`` fit, none where fewer than ``share_least`` would.

    Poses up to ``half_m`` and ``half_rad`` from ``centre (3,)`` are tried, but for those near ``other_than (3,)``;
    ``looks_most`` squares of them at most. With it are returned up to ``most`` places in all that fit ``ALIKE``.
    """
    steps = math.ceil(half_rad / TURN_STEP_RAD)
    turns = (TURN_STEP_RAD * np.arange(-steps, steps + 1)).astype(np.float64)
    theta = centre[2] + turns
    c, s = np.cos(theta)[:, None], np.sin(theta)[:, None]
    x, y = points[:, 0], points[:, 1]
    cols = np.floor((centre[0] + c * x - s * y - grid.low_m[0]) / CELL_M).astype(np.int32)
    rows = np.floor((centre[1] + s * x + c * y - grid.low_m[1]) / CELL_M).astype(np.int32)
    perfect = HIT * points.shape[0]
    half = math.ceil(half_m / CELL_M)
    banned = np.zeros((len(other_than), 3))
    for k, other in enumerate(other_than):
        away = other - centre
        banned[k] = away[0] / CELL_M, away[1] / CELL_M, se2.wrap(away[2])
    spots = np.zeros((most, 4), dtype=np.int64)
    least = int(share_least * perfect)
    is_complete = branch_and_bound(grid.levels, rows, cols, turns, half, banned, looks_most, least, spots)
    found = []
    for score, turn, row, col in spots[spots[:, 0] > int(ALIKE * spots[0, 0])]:
        pose = np.array([centre[0] + col * CELL_M, centre[1] + row * CELL_M, se2.wrap(theta[turn])])
        found.append(Spot(pose, float(score) / perfect))
    return Search(found, is_complete)
