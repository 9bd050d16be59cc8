"""The normal equations of a pose graph over SE(2): where their blocks go is worked out once, while its edges stay."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import SuperLU, splu

from mrslam.spatial.se2 import Transform

AXIS = np.arange(3)
LOOSE = 1e-6
"""Added to the diagonal, 1/m^2 and 1/rad^2: a node without edges stays where it is."""


class NormalEquations:
    """Those of all poses but the first, for edges between the same nodes."""

    def __init__(self, first: NDArray[np.int64], second: NDArray[np.int64], count: int) -> None:
        """Take the ends of the edges, ``(E,)`` indices of the ``count`` nodes."""
        self._first, self._second = first, second
        self._size = 3 * count - 3
        pairs = [(first, first), (first, second), (second, first), (second, second)]
        rows = np.concatenate([(3 * i[:, None, None] + AXIS[:, None] + 0 * AXIS).ravel() for i, _ in pairs])
        cols = np.concatenate([(3 * j[:, None, None] + 0 * AXIS[:, None] + AXIS).ravel() for _, j in pairs])
        free = np.flatnonzero((rows >= 3) & (cols >= 3))
        diagonal = np.arange(self._size)
        self._place(
            np.concatenate([rows[free] - 3, diagonal]),
            np.concatenate([cols[free] - 3, diagonal]),
            np.concatenate([free, rows.size + diagonal]),
        )
        self._ends = np.concatenate([(3 * ends[:, None] + AXIS).ravel() for ends in (first, second)])

    def _place(self, rows: NDArray[np.int64], cols: NDArray[np.int64], values: NDArray[np.int64]) -> None:
        """Lay the matrix out by columns: which of the ``values`` add up to each of its elements, and in which order."""
        by_column = np.argsort(cols, kind="stable")
        starts = np.concatenate([[0], np.cumsum(np.bincount(cols, minlength=self._size))])
        shape = (self._size, self._size)
        laid = csc_matrix((by_column, rows[by_column], starts), shape=shape)
        laid.sort_indices()
        column = cols[laid.data]
        begins = np.ones(column.size, dtype=np.bool_)
        begins[1:] = (laid.indices[1:] != laid.indices[:-1]) | (column[1:] != column[:-1])
        self._source, self._element = values[laid.data], np.cumsum(begins) - 1
        indptr = np.searchsorted(column[begins], np.arange(self._size + 1))
        self._indices, self._indptr = laid.indices[begins], indptr.astype(laid.indices.dtype)

    def factorised(
        self, poses: Transform, error: Transform, information: NDArray[np.float64]
    ) -> tuple[SuperLU, NDArray[np.float64]]:
        """Return the factorised equations at ``poses (K, 3)``, and their right side ``(3 K - 3,)``.

        ``error (E, 3)`` : residuals of the edges in the axes of their first node; ``information (E, 3, 3)`` weighted.
        """
        a, b = _jacobians(poses, self._first, self._second)
        wa, wb = information @ a, information @ b
        at, bt = a.transpose(0, 2, 1), b.transpose(0, 2, 1)
        blocks = [(at @ wa).ravel(), (at @ wb).ravel(), (bt @ wa).ravel(), (bt @ wb).ravel()]
        values = np.concatenate([*blocks, np.full(self._size, LOOSE)])[self._source]
        data = np.bincount(self._element, weights=values, minlength=self._indices.size)
        matrix = csc_matrix((data, self._indices, self._indptr), shape=(self._size, self._size))
        matrix.has_canonical_format = True
        pulls = [-np.einsum("eji,ej->ei", w, error).ravel() for w in (wa, wb)]
        sums = np.bincount(self._ends, weights=np.concatenate(pulls), minlength=self._size + 3)
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}, diag_pivot_thresh=0.0)
        return factors, np.asarray(sums[3:], dtype=np.float64)


def _jacobians(
    poses: Transform, first: NDArray[np.int64], second: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the residuals' derivatives ``(E, 3, 3)`` by the first and by the second pose."""
    cos, sin = np.cos(poses[first, 2]), np.sin(poses[first, 2])
    delta = poses[second, :2] - poses[first, :2]
    a, b = np.zeros((first.size, 3, 3)), np.zeros((first.size, 3, 3))
    b[:, 0, 0], b[:, 0, 1], b[:, 1, 0], b[:, 1, 1], b[:, 2, 2] = cos, sin, -sin, cos, 1.0
    a[:, :2, :2] = -b[:, :2, :2]
    a[:, 0, 2] = -sin * delta[:, 0] + cos * delta[:, 1]
    a[:, 1, 2] = -cos * delta[:, 0] - sin * delta[:, 1]
    a[:, 2, 2] = -1.0
    return a, b
