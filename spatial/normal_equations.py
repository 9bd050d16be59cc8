"""The normal equations of a pose graph over SE(2): their layout is worked out once, while its edges stay."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

from mrslam.spatial.block_cholesky import FillIn, factorise, fill_in, solve
from mrslam.spatial.normal_blocks import add_up
from mrslam.spatial.se2 import Transform

LOOSE = 1e-6
"""Added to the diagonal, 1/m^2 and 1/rad^2: a node without edges stays where it is."""


class NormalEquations:
    """Those of all poses but the first, for edges between the same nodes."""

    def __init__(self, first: NDArray[np.int64], second: NDArray[np.int64], count: int) -> None:
        """Take the ends of the edges, ``(E,)`` indices of the ``count`` nodes."""
        free = np.flatnonzero((first > 0) & (second > 0) & (first != second))
        place = np.concatenate([[-1], _order(first[free] - 1, second[free] - 1, count - 1)])
        self._first, self._second = np.ascontiguousarray(first), np.ascontiguousarray(second)
        self._place = place
        row, column = np.maximum(place[first], place[second]), np.minimum(place[first], place[second])
        keys, block = np.unique(row[free] * count + column[free], return_inverse=True)
        self._block = np.full(first.size, -1)
        self._block[free] = block
        self._row_starts, self._columns = np.searchsorted(keys, np.arange(count) * count), keys % count
        self._fill = fill_in(self._row_starts, self._columns)

    def factorised(
        self, poses: Transform, error: Transform, information: NDArray[np.float64], weight: NDArray[np.float64]
    ) -> tuple[Factors, Transform]:
        """Return the factorised equations at ``poses (K, 3)``, and their right side ``(K - 1, 3)``.

        ``error (E, 3)`` : residuals of the edges in the axes of their first node, with ``information (E, 3, 3)`` times
        ``weight (E,)``.
        """
        size = self._place.size - 1
        diagonal = np.tile(LOOSE * np.eye(3), (size, 1, 1))
        below, pull = np.zeros((self._columns.size, 3, 3)), np.zeros((size, 3))
        edges = (self._first, self._second, self._place, self._block, error, information, weight)
        add_up(poses, *edges, diagonal, below, pull)
        blocks = factorise(diagonal, below, self._row_starts, self._columns, *self._fill, LOOSE)
        return Factors(diagonal, blocks, self._fill, self._place[1:]), pull[self._place[1:]]


class Factors(NamedTuple):
    """The factor of a pose graph's normal equations."""

    diagonal: NDArray[np.float64]
    """``(N, 3, 3)``, in the order of elimination."""
    blocks: NDArray[np.float64]
    """``(B, 3, 3)`` below the diagonal."""
    fill: FillIn
    """Where these are."""
    place: NDArray[np.int64]
    """``(N,)``: the row of each pose but the first."""

    def solve(self, right: Transform) -> Transform:
        """Return the solution ``(N, 3)`` for a right side ``(N, 3)``."""
        x = np.empty_like(right)
        x[self.place] = right
        solve(self.diagonal, self.blocks, self.fill.starts, self.fill.rows, x)
        return x[self.place]


def _order(first: NDArray[np.int64], second: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Return ``(count,)``: where each node stands in an order of elimination that fills in little (minimum degree)."""
    ends, others = np.concatenate([first, second]), np.concatenate([second, first])
    nodes = np.arange(count)
    degree = 1.0 + np.bincount(ends, minlength=count)
    values = np.concatenate([np.full(ends.size, -1.0), degree])
    shape = (count, count)
    joined = coo_matrix((values, (np.append(ends, nodes), np.append(others, nodes))), shape=shape).tocsc()
    factors = splu(joined, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}, diag_pivot_thresh=0.0)
    return np.asarray(factors.perm_c, dtype=np.int64)
