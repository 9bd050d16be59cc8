"""What other robots' maps show of the floor that one robot's map lies on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.grids.shown import Shown
from mrslam.merge.joint.bend import Bend
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform
from mrslam.spatial.tiles import distinct

COARSE_M = 0.4
"""Edge of the squares of which one displacement is asked, metres: a map that is bent by a hundredth errs by 2 mm."""


@dataclass(frozen=True, eq=False)
class Elsewhere:
    """The other maps in the team frame, and how the one map is laid on them."""

    shown: Shown
    """The others, as they are drawn into the team map."""
    resolution_m: float
    """Edge of their cells, metres."""
    T_team_map: Transform
    """``(3,)``: where the one map lies."""
    bend: Bend | None
    """How it is bent to fit; None where it is not, or no joint solution has come yet."""

    def count(self, points_m: NDArray[np.float64], is_wall: NDArray[np.bool_]) -> NDArray[np.int16]:
        """Return ``(N,)`` how many of the others show the same at points ``(N, 2)`` of the one map, metres.

        ``is_wall (N,)`` : whether the one map has a wall there, else it is free.
        """
        T_team_map = self.T_team_map if self.bend is None else self.bend.T_team_map
        if self.bend is not None and len(points_m):
            points_m = points_m + self._displacement(points_m)
        x_y = np.floor(se2.apply(T_team_map, points_m) / self.resolution_m).astype(np.int64)
        return self.shown.count(x_y[:, ::-1], is_wall)

    def _displacement(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement of points, asked once for all of them in one square of ``COARSE_M``."""
        assert self.bend is not None
        squares = np.floor(points_m / COARSE_M)
        first, which = distinct(squares.astype(np.int64))
        return self.bend.displacement((squares[first] + 0.5) * COARSE_M)[which]
