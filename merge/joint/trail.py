"""One robot's way: its keyframes with what was seen at each, and how stiff the way is between them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from mrslam.spatial import KeyScans, LocalMap, se2
from mrslam.spatial.matching.scan_points import POINT_COLUMNS, scan_points
from mrslam.spatial.pose_graph import Edges
from mrslam.spatial.se2 import Transform

STEP_M, STEP_RAD = 0.01, 0.0015
"""Standard deviation of the motion between keyframes at one place: the noise of a scan match (as in the mapper)."""
STEP_PER_M, TURN_PER_M = 0.03, 0.003
"""Its growth for each metre between them (1, rad/m): the mapper's own motion model."""
STEP_PER_RAD, TURN_PER_RAD = 0.01, 0.01
"""And for each radian (m/rad, 1)."""
SEEN_AGAIN_M, SEEN_AGAIN_RAD = 0.03, 0.005
"""How well two keyframes of one place lie to each other (standard deviations): both were matched with one map of it.
Measured: three times as much changes no error between robots by more than 1 %."""
NEAR_M = 2.0
"""Keyframes closer to each other than this saw the same place, metres."""
OLD_WAY_M = 12.0
"""A place is an old one when at least this much way lies between, metres: more than a scan's usual reach indoors."""
EVERY_M = 2.0
"""Old places are looked for once in so much way, metres: as far apart as ``NEAR_M``, so that no stretch is left out."""


@dataclass(frozen=True, eq=False)
class Trail:
    """Keyframes of one robot in its own map, and their scans."""

    T_map_key: Transform
    """``(K, 3)``, as the robot published them."""
    scans: KeyScans
    """What was seen at each."""
    stamps_ns: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    """``(K,)`` where they are known."""

    @classmethod
    def of(cls, local: LocalMap) -> Trail:
        """Return the way behind a robot's map: those of its keyframes that have scans."""
        count = min(len(local.key_scans), len(local.keyframes.stamps_ns))
        poses = np.asarray(local.keyframes.T_map_base[:count], dtype=np.float64)
        return cls(poses, local.key_scans.part(0, count), local.keyframes.stamps_ns[:count])

    def __len__(self) -> int:
        """Return the number of keyframes."""
        return self.T_map_key.shape[0]

    @cached_property
    def way_m(self) -> NDArray[np.float64]:
        """``(K,)``: length of the way to each keyframe, metres."""
        steps = np.hypot(*np.diff(self.T_map_key[:, :2], axis=0).T)
        return np.concatenate([np.zeros(min(len(self), 1)), np.cumsum(steps)])

    @cached_property
    def edges(self) -> Edges:
        """Motion from keyframe to keyframe, and places the robot came back to: its map, as stiff as it is."""
        chain = np.arange(max(len(self) - 1, 0))
        pairs = np.concatenate([np.stack([chain, chain + 1], axis=1), self._seen_again])
        T = se2.between(self.T_map_key[pairs[:, 0]], self.T_map_key[pairs[:, 1]])
        length, turn = np.hypot(T[:, 0], T[:, 1]), np.abs(T[:, 2])
        sigma_m = STEP_M + STEP_PER_M * length + STEP_PER_RAD * turn
        sigma_rad = STEP_RAD + TURN_PER_M * length + TURN_PER_RAD * turn
        sigma_m[chain.size :], sigma_rad[chain.size :] = SEEN_AGAIN_M, SEEN_AGAIN_RAD
        information = np.zeros((len(pairs), 3, 3))
        information[:, 0, 0] = information[:, 1, 1] = sigma_m**-2
        information[:, 2, 2] = sigma_rad**-2
        return Edges(pairs[:, 0], pairs[:, 1], T, information)

    @cached_property
    def _seen_again(self) -> NDArray[np.int64]:
        """``(E, 2)``: keyframes, the earlier first, between which the robot went far and came back."""
        found, last_m = [], -np.inf
        for j in range(len(self)):
            old = int(np.searchsorted(self.way_m, self.way_m[j] - OLD_WAY_M))  # keyframes before this one are old
            if old == 0 or self.way_m[j] - last_m < EVERY_M:
                continue
            away = np.hypot(*(self.T_map_key[:old, :2] - self.T_map_key[j, :2]).T)
            nearest = int(np.argmin(away))
            if away[nearest] < NEAR_M:
                found.append((nearest, j))
                last_m = self.way_m[j]
        return np.array(found, dtype=np.int64).reshape(-1, 2)

    def way_from(self, keys: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return ``(len(keys), K)``: length of the shortest way from these keyframes, through places seen again."""
        edges = self.edges
        length = np.hypot(*edges.T_first_second[:, :2].T) + 1e-6  # a length of 0 would be no edge
        graph = coo_matrix((length, (edges.first, edges.second)), shape=(len(self), len(self)))
        return np.asarray(dijkstra(graph.tocsr(), directed=False, indices=keys))

    def points(self, k: int) -> NDArray[np.float64]:
        """Return ``(n, 5)``: the scan of keyframe ``k`` as points with normals, in the keyframe's frame."""
        held = self._points.get(k)
        if held is None:
            held = self._points[k] = with_normals(self.scans.of(k), self.scans.origins[k])
        return held

    @cached_property
    def _points(self) -> dict[int, NDArray[np.float64]]:
        return {}


def with_normals(points: NDArray[np.float32], origin: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return points ``(n, 2)``, metres, with the normals of the surface they lie on: ``(n, 5)``.

    Normals come from the points' neighbours, looked at from the laser at ``origin (2,)``, and point toward it.
    """
    laser = origin.astype(np.float64)
    away = points.astype(np.float64) - laser
    ranges = np.hypot(away[:, 0], away[:, 1])
    cos, sin = (away / np.maximum(ranges, 1e-9)[:, None]).T
    out = np.empty((len(points), POINT_COLUMNS))
    T_base_laser = np.array([laser[0], laser[1], 0.0])
    count = scan_points(
        ranges.astype(np.float32), np.ascontiguousarray(cos), np.ascontiguousarray(sin), T_base_laser, np.inf, out
    )
    return out[:count]
