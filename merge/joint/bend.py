"""Where a map lies in the team frame once its keyframes are corrected: a rigid transform, and a displacement field."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.merge.joint.bent_map import BentMap
from mrslam.merge.joint.trail import rigid
from mrslam.spatial import Keyframes, OccupancyGrid, se2
from mrslam.spatial.se2 import Transform

SPREAD_M = 1.5
"""A node follows the keyframes around it, with weights that fall by this scale beyond the nearest one, metres."""
NEIGHBOURS = 12
"""Keyframes a node follows at most."""
PLACE_M, PLACE_RAD = 0.25, 0.01
"""Grid that the rigid part is rounded to, m and rad: a solution that differs by less leaves the map as it was."""


@dataclass(frozen=True, eq=False)
class Bend:
    """A robot's keyframes in its own map and, corrected, in the team frame; row k of both is one keyframe."""

    T_map_key: Transform
    """``(K, 3)``, K > 0, as published: metres, metres, radians."""
    T_team_key: Transform
    """``(K, 3)``, corrected by the joint solution."""

    @cached_property
    def T_rigid(self) -> Transform:
        """``(3,)``: the rigid transform from the map to the team frame that fits the corrected keyframes best."""
        return rigid(self.T_team_key, self.T_map_key)

    @cached_property
    def T_team_map(self) -> Transform:
        """``(3,)``: the rounded rigid transform with which the bent map (:meth:`bent`) is drawn into the team map."""
        x, y, theta = self.T_rigid
        return se2.transform(
            PLACE_M * round(x / PLACE_M), PLACE_M * round(y / PLACE_M), PLACE_RAD * round(theta / PLACE_RAD)
        )

    @cached_property
    def T_team_map_now(self) -> Transform:
        """``(3,)``: the rigid transform that is right at the newest corrected keyframe; elsewhere the map is bent."""
        return se2.compose(self.T_team_key[-1], se2.inverse(self.T_map_key[-1]))

    @cached_property
    def most_m(self) -> float:
        """Largest displacement of a keyframe by the bending, beyond the rigid transform, metres."""
        unbent = se2.apply(self.T_team_map, self.T_map_key[:, :2])
        return float(np.hypot(*(self.T_team_key[:, :2] - unbent).T).max())

    def bent(self, grid: OccupancyGrid) -> OccupancyGrid:
        """Return the map bent in its own frame, so that ``T_team_map`` places it where the corrected keyframes are."""
        return BentMap().draw(TiledGrid.of(grid), self.displacement).grid

    def displacement(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement ``(N, 2)`` of points ``(N, 2)``, both in the map's frame, metres."""
        count = min(NEIGHBOURS, len(self.T_map_key))
        away, near = self._tree.query(points, count)
        away, near = np.reshape(away, (-1, count)), np.reshape(near, (-1, count))
        weight = np.exp(-0.5 * (away**2 - away[:, :1] ** 2) / SPREAD_M**2)
        moved = se2.apply(self._T_bent[near], points[:, None, :]) - points[:, None, :]
        return np.asarray((weight[..., None] * moved).sum(axis=1) / weight.sum(axis=1)[:, None])

    def unbent(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points ``(N, 2)`` of the team frame in the map as published: followed back at the nearest keyframe."""
        _, k = cKDTree(self.T_team_key[:, :2]).query(points)
        return se2.apply(se2.compose(self.T_map_key[k], se2.inverse(self.T_team_key[k])), points)

    @cached_property
    def _T_bent(self) -> Transform:
        """``(K, 3)``: what each keyframe moves about it, in the map's frame."""
        T_map_corrected = se2.compose(se2.inverse(self.T_team_map), self.T_team_key)
        return se2.compose(T_map_corrected, se2.inverse(self.T_map_key))

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.T_map_key[:, :2])

    def extended(self, T_map_key: Transform) -> Transform:
        """Return keyframes ``(N, 3)`` of the map in the team frame; those newer than the solution follow rigidly."""
        later = se2.compose(self.T_team_map_now, T_map_key[len(self.T_team_key) :])
        return np.concatenate([self.T_team_key, later])[: len(T_map_key)]

    def corrected_at(self, key_stamps_ns: NDArray[np.int64], way: Keyframes) -> Keyframes:
        """Return a trajectory of any frame fixed to the robot (base, laser), given in its own map, in the team frame.

        ``key_stamps_ns (N,)`` : stamps of the map's keyframes, N may exceed K. Poses between two keyframes are
        interpolated between both corrections; those before the first or after the last follow it rigidly.
        """
        stamps_ns = key_stamps_ns[: len(self.T_map_key)]
        order = np.argsort(stamps_ns, kind="stable")  # a log's time may step backward
        rank = np.searchsorted(stamps_ns[order], way.stamps_ns, side="right") - 1
        key = order[np.clip(rank, 0, order.size - 1)]
        after = order[np.clip(rank + 1, 0, order.size - 1)]
        span_ns = np.maximum(stamps_ns[after] - stamps_ns[key], 1)
        share = np.clip((way.stamps_ns - stamps_ns[key]) / span_ns, 0.0, 1.0)
        return Keyframes(way.stamps_ns, self._between(key, after, share, way.T_map_base))

    def _between(
        self, key: NDArray[np.int64], after: NDArray[np.int64], share: NDArray[np.float64], T_map_x: Transform
    ) -> Transform:
        """Return poses ``T_map_x (N, 3)`` in the team frame; ``share (N,)`` 0..1 from keyframe ``key`` to ``after``."""
        by_last, by_next = (
            se2.compose(self.T_team_key[k], se2.between(self.T_map_key[k], T_map_x)) for k in (key, after)
        )
        turn = se2.wrap(by_next[:, 2] - by_last[:, 2])
        mixed = by_last[:, :2] + share[:, None] * (by_next[:, :2] - by_last[:, :2])
        return np.concatenate([mixed, se2.wrap(by_last[:, 2] + share * turn)[:, None]], axis=1)
