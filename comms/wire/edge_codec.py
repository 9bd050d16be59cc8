"""Loop edges as whole numbers: poses as those of keyframes, information as its Cholesky factor.

A rounded factor is still one of a positive definite matrix, which a rounded information matrix need not be.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import LoopEdges

COLUMNS = 11
"""The newer keyframe, how many keyframes before it the older one is, pose (mm, 0.1 mrad), and six of the factor."""
POSE_SCALE = np.array([1e3, 1e3, 1e4])
"""Units per metre, metre, radian: ``keyframe_codec.SCALE``, which imports this module."""
FACTOR_SCALE = 100.0
"""Units of the factor per 1/m or 1/rad: a deviation of 1 cm or 0.01 rad is 10 000, coded to 0.01 %."""
POSE_MOST = 2**30
"""Bound of a pose's numbers, mm and 0.1 mrad: ``keyframe_codec.POSE_LIMIT``."""
FACTOR_MOST, FACTOR_LEAST = 2**17, 1
"""Bounds of the factor's numbers: deviations from 0.8 mm to 100 m, beyond which no edge within a map is of use."""
JITTER = 2e-9
"""Added to the information, as a share of its trace: a direction of which nothing is known has a factor, too."""
ROWS, COLS = np.tril_indices(3)
"""Places of the factor's six numbers, row by row."""


def to_rows(edges: LoopEdges) -> NDArray[np.int64]:
    """Return edges as rows ``(E, 11)``, by the newer keyframe; equal ones keep their order."""
    # Half a squared unit: the diagonal of the factor of an edge that knows nothing rounds to 1, not to 0.
    known = JITTER * np.trace(edges.information, axis1=1, axis2=2)[:, None, None] + 0.5 / FACTOR_SCALE**2
    factor = np.round(np.linalg.cholesky(edges.information + known * np.eye(3))[:, ROWS, COLS] * FACTOR_SCALE)
    factor = np.clip(factor, np.where(ROWS == COLS, FACTOR_LEAST, -FACTOR_MOST), FACTOR_MOST)
    poses = np.clip(np.round(edges.T_first_second * POSE_SCALE), -POSE_MOST, POSE_MOST)
    keys = edges.keys.astype(np.int64)
    values = np.concatenate([poses, factor], axis=1).astype(np.int64)
    rows = np.concatenate([keys[:, 1:], keys[:, 1:] - keys[:, :1], values], axis=1)
    return rows[np.argsort(rows[:, 0], kind="stable")]


def are_edges(rows: NDArray[np.int64], first: int, last: int) -> bool:
    """Return whether rows ``(E, 11)`` are edges to the keyframes ``first .. last - 1``, in their order."""
    newer, back, poses, factor = rows[:, 0], rows[:, 1], rows[:, 2:5], rows[:, 5:]
    ordered = (newer[1:] >= newer[:-1]).all() and (newer >= first).all() and (newer < last).all()
    bounded = all(
        (-most <= part).all() and (part <= most).all() for part, most in ((poses, POSE_MOST), (factor, FACTOR_MOST))
    )
    positive = (factor[:, ROWS == COLS] >= FACTOR_LEAST).all()
    return bool(ordered and (back >= 1).all() and (back <= newer).all() and bounded and positive)


def from_rows(rows: NDArray[np.int64]) -> LoopEdges:
    """Return the edges that these rows ``(E, 11)`` stand for."""
    factor = np.zeros((rows.shape[0], 3, 3))
    factor[:, ROWS, COLS] = rows[:, 5:] / FACTOR_SCALE
    keys = np.stack([rows[:, 0] - rows[:, 1], rows[:, 0]], axis=-1).astype(np.int32)
    return LoopEdges(keys, rows[:, 2:5] / POSE_SCALE, factor @ factor.transpose(0, 2, 1))
