"""Loop closures of one robot: relative poses of two of its keyframes that saw the same place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial.errors import InputError

ROUNDING = 1e-9
"""Eigenvalues of 0 may come out negative by this share of the greatest, for rounding."""


@dataclass(frozen=True, eq=False)
class LoopEdges:
    """Relative poses of E pairs of keyframes, as scans show them; raises ``InputError`` where they make no sense."""

    keys: NDArray[np.int32]
    """``(E, 2) int32``: an older keyframe, and the one that saw its place again."""
    T_first_second: NDArray[np.float64]
    """``(E, 3)``: the second's pose in the frame of the first, metres and radians."""
    information: NDArray[np.float64]
    """``(E, 3, 3)``: inverse covariance of that pose, 1/m^2, 1/(m rad), 1/rad^2; no eigenvalue is below 0."""

    def __post_init__(self) -> None:
        count = self.keys.shape[0]
        shapes = (self.keys.shape, self.T_first_second.shape, self.information.shape)
        if shapes != ((count, 2), (count, 3), (count, 3, 3)):
            raise InputError(f"edges must be (E, 2), (E, 3) and (E, 3, 3), got {shapes}")
        if (self.keys[:, 0] < 0).any() or (self.keys[:, 0] >= self.keys[:, 1]).any():
            raise InputError("an edge must lead from an older keyframe to a newer one")
        if not (np.isfinite(self.T_first_second).all() and np.isfinite(self.information).all()):
            raise InputError("edges must be finite")
        least, _, most = np.linalg.eigvalsh(self.information).T
        if (least < -ROUNDING * most).any() or (most < 0.0).any():
            raise InputError("an edge's information must have no negative eigenvalue")

    @classmethod
    def empty(cls) -> LoopEdges:
        """Return no edges."""
        return cls(np.empty((0, 2), np.int32), np.empty((0, 3)), np.empty((0, 3, 3)))

    def __len__(self) -> int:
        return self.keys.shape[0]
