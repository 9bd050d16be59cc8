"""Scans of keyframes that are kept to compare places with: memory grows with the area mapped, not with time."""

from __future__ import annotations

from bisect import bisect_right
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.rows import Rows
from mrslam.spatial import se2
from mrslam.spatial.hits.views import Beams
from mrslam.spatial.matching.scan_points import POINT_COLUMNS, spaced
from mrslam.spatial.se2 import Transform

KEPT_MOST, KEPT_WITHIN_M, KEPT_WITHIN_RAD = 12, 0.7, 0.5
"""Most scans that are kept of those taken within this distance and turn of each other: the newest."""
POINTS_OF_KEY, POINTS_APART_M = 90, 0.05
"""Points of one keyframe that are matched, at most, and their least distance across the beams, metres."""


class KeptScans:
    """Scans by keyframe, and how the keyframes follow each other."""

    def __init__(self) -> None:
        self.points: dict[int, NDArray[np.float32]] = {}
        """By keyframe, in the order of time: points ``(N, 5)`` in its base frame; not of all, see :meth:`forget`."""
        self._origins = Rows(2)
        self._way = Rows(1)
        self._starts = [0]  # keyframes to which no scan led from the one before, in the order of time

    @property
    def origins(self) -> NDArray[np.float64]:
        """``(K, 2)``, where the laser was on the base, metres."""
        return self._origins.rows

    @property
    def way_m(self) -> NDArray[np.float64]:
        """``(K,)``, way since the start, see ``mrslam.rbpf.front_end.motion``."""
        return self._way.rows[:, 0]

    @property
    def newest_start(self) -> int:
        """The last keyframe to which no scan led: the robot was carried there, or came by its wheels alone; else 0."""
        return self._starts[-1]

    def connected(self, first: int, last: int, key: int) -> range:
        """Return which of the keyframes ``first .. last - 1`` scans connect with ``key``, all the way."""
        k = bisect_right(self._starts, key)
        ends = [*self._starts, self._way.size]
        return range(max(first, ends[k - 1]), min(last, ends[k]))

    def add(self, beams: Beams, way_m: float, *, is_apart: bool = False) -> None:
        """Keep a keyframe's scan, taken ``way_m`` after the one before; ``is_apart`` : whether no scan led there."""
        if is_apart:
            self._starts.append(self._way.size)
        self.points[self._way.size] = beams.points.astype(np.float32)
        self._origins.add(beams.origin)
        self._way.add(way_m + (self.way_m[-1] if self._way.size else 0.0))

    def forget(self, T_map_key: Transform) -> None:
        """Drop the oldest scan near the newest keyframe of ``T_map_key (K, 3)`` where ``KEPT_MOST`` are exceeded."""
        kept, away_m, turned = self.from_newest(T_map_key)
        here = kept[(away_m < KEPT_WITHIN_M) & (turned < KEPT_WITHIN_RAD)]
        if here.size > KEPT_MOST:
            del self.points[int(here[0])]

    def from_newest(self, T_map_key: Transform) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Return which keyframes' scans are kept, and each one's distance (m) and turn (rad) from the newest keyframe.

        ``T_map_key (K, 3)`` : all keyframes.
        """
        kept = np.fromiter(self.points, np.int64, len(self.points))
        away_m = np.hypot(*(T_map_key[kept, :2] - T_map_key[-1, :2]).T)
        return kept, away_m, np.abs(se2.wrap(T_map_key[kept, 2] - T_map_key[-1, 2]))

    def joined(self, T_map_key: Transform, keys: range, frame: int) -> NDArray[np.float64]:
        """Return a subsample ``(N, 5)`` of the points of several keyframes, in the base frame of keyframe ``frame``."""
        parts = []
        for k in (k for k in keys if k in self.points):
            points = self.points[k].astype(np.float64)
            sample = np.empty((points.shape[0], POINT_COLUMNS))
            sample = sample[: spaced(points, self.origins[k], POINTS_APART_M, POINTS_OF_KEY, sample)]
            x, y, nx, ny, quality = sample.T
            T_frame_key = se2.between(T_map_key[frame], T_map_key[k])
            cos, sin = np.cos(T_frame_key[2]), np.sin(T_frame_key[2])
            place = [T_frame_key[0] + cos * x - sin * y, T_frame_key[1] + sin * x + cos * y]
            parts.append(np.stack([*place, cos * nx - sin * ny, sin * nx + cos * ny, quality]))
        return np.ascontiguousarray(np.concatenate(parts, axis=1).T)

    def state(self) -> dict[str, Any]:
        """Return all that is kept."""
        return {
            "kept": list(self.points), "points": list(self.points.values()),
            "origins": self.origins, "way": self._way.rows, "starts": list(self._starts),
        }  # fmt: skip

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from what :meth:`state` returned."""
        self.points = dict(zip(state["kept"], state["points"], strict=True))
        self._origins, self._way = Rows.of(state["origins"]), Rows.of(state["way"])
        self._starts = list(state["starts"])
