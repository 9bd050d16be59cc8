"""A map of the last few metres, in a frame of its own (``local``) that drifts slowly."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.front_end.prediction import PAUSE_MOST_M
from mrslam.spatial.hits.store import TileStore
from mrslam.spatial.hits.views import Tiles
from mrslam.spatial.poses import between
from mrslam.spatial.se2 import Transform

SCAN_DISTANCE_M, SCAN_TURN_RAD = 0.2, 0.15
"""A scan enters the map after this much motion: a robot at rest adds nothing."""
SCANS_MOST, SCANS_KEPT = 60, 30
"""The map is drawn again from its last ``SCANS_KEPT`` scans whenever it holds ``SCANS_MOST``: it covers 6 m of way or
more, and what has drifted is left behind."""
BEYOND_M = 2.0
"""The map reaches this much farther than the laser is used, metres."""


class RollingMap:
    """The newest scans, drawn where the robot was when it took them."""

    def __init__(self, config: MapperConfig) -> None:
        self._store = TileStore(1, config.resolution_m)
        self._reach_m = config.usable_range_m + BEYOND_M
        self._scans: list[tuple[Transform, NDArray[np.float64]]] = []  # T_local_base (3,), points (N, 5)

    @property
    def is_empty(self) -> bool:
        """Whether no scan was added yet."""
        return not self._scans

    def tiles_around(self, T_local_base: Transform) -> Tiles:
        """Return the map, with a window that holds all that can be seen from a pose ``(3,)``."""
        if self._is_out_of_sight(T_local_base, PAUSE_MOST_M):  # no motion that may be guessed, and given up, is longer
            self._restart(T_local_base)
        self._store.cover(T_local_base[:2] - self._reach_m, T_local_base[:2] + self._reach_m)
        return self._store.tiles(0)

    def clear(self) -> None:
        """Forget everything."""
        self._scans.clear()
        self._store.clear(0)

    def draw_again(self, other: RollingMap) -> None:
        """Become what the newest scans of another one show."""
        self._store.restart(other._scans[-1][0][:2])
        self._scans = other._scans[-SCANS_KEPT:]
        for T_local_base, points in self._scans:
            self._store.add_points(0, T_local_base, points)

    def _restart(self, T_local_base: Transform) -> None:
        self._store.restart(T_local_base[:2])
        self._scans.clear()

    def _is_out_of_sight(self, T_local_base: Transform, farther_m: float = 0.0) -> bool:
        """Return whether nothing in the map can be seen from a pose ``(3,)``, nor from ``farther_m`` nearer."""
        near_m, (x, y, _) = 2.0 * self._reach_m + farther_m, T_local_base.tolist()
        return all(abs(place[0] - x) > near_m or abs(place[1] - y) > near_m for place, _ in reversed(self._scans))

    def is_due(self, T_local_base: Transform) -> bool:
        """Return whether a scan from this pose ``(3,)`` should be added."""
        if not self._scans:
            return True
        since = between(self._scans[-1][0], T_local_base)
        return math.hypot(since[0], since[1]) > SCAN_DISTANCE_M or abs(since[2]) > SCAN_TURN_RAD

    def add(self, T_local_base: Transform, points: NDArray[np.float64]) -> None:
        """Draw a scan's ``points (N, 5)`` as seen from a pose ``(3,)``."""
        if self._is_out_of_sight(T_local_base):  # not before: a pose that is only guessed may be given up
            self._restart(T_local_base)
        self._scans.append((T_local_base.copy(), points.copy()))
        if len(self._scans) >= SCANS_MOST:
            self._scans = self._scans[-SCANS_KEPT:]
            self._store.restart(T_local_base[:2])  # its window would grow with the way driven
            for old, old_points in self._scans:
                self._store.add_points(0, old, old_points)
        else:
            self._store.add_points(0, T_local_base, points)

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed map needs."""
        return {"store": self._store.state(), "scans": [[pose, points] for pose, points in self._scans]}

    def restore(self, state: dict[str, Any]) -> None:
        """Become the map that was saved."""
        self._store.restore(state["store"])
        self._scans = [(pose, points) for pose, points in state["scans"]]
