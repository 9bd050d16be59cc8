"""The dissimilarity psi of two maps under a transform (Carpin, Birk and Jucikas 2005, section 3)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.alignment.kernels.walls import FREE, OCCUPIED
from mrslam.alignment.prepared import PreparedMap
from mrslam.spatial import se2
from mrslam.spatial.distance import manhattan
from mrslam.spatial.se2 import Transform

CELL_M = 0.4
"""Cell psi is computed at, metres; finer gains nothing but time."""


@njit(cache=True, nogil=True)
def mean_distance(
    points: NDArray[np.float64], T_t_s: NDArray[np.float64], field: NDArray[np.int32], x0: float, y0: float, cell: float
) -> float:  # pragma: no cover - compiled
    """Return the mean Manhattan distance, cells, from the transformed points to the nearest marked cell of ``field``.

    Points outside the field count their way to its edge and on from there.
    """
    height, width = field.shape
    cos, sin = math.cos(T_t_s[2]), math.sin(T_t_s[2])
    total = 0.0
    for i in range(points.shape[0]):
        c = int(math.floor((T_t_s[0] + cos * points[i, 0] - sin * points[i, 1] - x0) / cell))
        r = int(math.floor((T_t_s[1] + sin * points[i, 0] + cos * points[i, 1] - y0) / cell))
        rr, cc = min(max(r, 0), height - 1), min(max(c, 0), width - 1)
        total += abs(r - rr) + abs(c - cc) + field[rr, cc]
    return total / max(points.shape[0], 1)


class Dissimilarity:
    """psi as a function of ``T_a_b``, over free and occupied cells in both directions; unknown cells are ignored."""

    def __init__(self, a: PreparedMap, b: PreparedMap, cell_m: float = CELL_M) -> None:
        cell_m = max(cell_m, a.res)  # finer would but take memory: both maps have cells of this edge
        self.sides = (_Coarse(a, cell_m), _Coarse(b, cell_m))
        self.evaluations = 0

    def __call__(self, T_a_b: Transform) -> float:
        """Return psi, mean cells."""
        self.evaluations += 1
        a, b = self.sides
        T_b_a = se2.inverse(T_a_b)
        total = 0.0
        for k in range(2):
            total += mean_distance(a.points[k], T_b_a, b.fields[k], b.x0, b.y0, b.cell)
            total += mean_distance(b.points[k], T_a_b, a.fields[k], a.x0, a.y0, a.cell)
        return total


class _Coarse:
    """A map's free and occupied cells at psi's cell, as points and as Manhattan distance fields."""

    def __init__(self, side: PreparedMap, cell_m: float) -> None:
        self.cell = cell_m
        self.x0, self.y0 = side.x0, side.y0
        ratio = side.res / cell_m
        shape = tuple(int(n * ratio) + 1 for n in side.state.shape)
        masks = []
        for value in (FREE, OCCUPIED):
            rows, cols = np.nonzero(side.state == value)
            mask = np.zeros(shape, dtype=np.bool_)
            mask[(rows * ratio).astype(np.int64), (cols * ratio).astype(np.int64)] = True
            masks.append(mask)
        masks[0] &= ~masks[1]
        self.fields = [manhattan(mask) for mask in masks]
        self.points = []
        for mask in masks:
            rows, cols = np.nonzero(mask)
            at = np.stack([cols, rows], axis=-1) + 0.5
            self.points.append(np.ascontiguousarray(at * cell_m + (self.x0, self.y0)))
