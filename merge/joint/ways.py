"""How far along their ways robots are from each other: what ties hold together agrees, the rest drifts apart.

A map of a large place is bent by a per cent, so that one robot's wall may lie metres beside another's where neither was
near a tie for long; that says nothing against the ties.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag, coo_matrix, csr_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.merge.joint.bend import Bend
from mrslam.merge.joint.ties import Tie
from mrslam.merge.joint.trail import Trail
from mrslam.spatial import TILE_CELLS, se2

HELD_M = 15.0
"""Path from another robot within which a map must agree with that one's, metres: a pose drifts by two per cent of it
(``DRIFT_M_PER_M``), and walls nearer than 0.3 m agree (``merge.contradiction_tolerance_m``)."""
SHOWN_M = 8.0
"""What lies farther from a keyframe was seen from afar, metres: its place is as uncertain as the keyframe's heading."""


class Ways:
    """All robots' keyframes as one net of ways, in which believed ties lead from robot to robot."""

    def __init__(self, trails: Mapping[str, Trail], ties: Sequence[Tie]) -> None:
        """``ties`` : those between robots without a trail lead nowhere."""
        cores = {name: trail.core for name, trail in sorted(trails.items())}
        self._lengths = {name: core.trail.lengths for name, core in cores.items()}  # not all of a core: it grows large
        self._follows = {name: core.follows for name, core in cores.items()}
        counts = [lengths.shape[0] for lengths in self._lengths.values()]
        self._starts = dict(zip(cores, np.cumsum([0, *counts]).tolist(), strict=False))
        self._ties = tuple(tie for tie in ties if tie.believed and {tie.a, tie.b} <= trails.keys())
        self._to: dict[str, dict[str, NDArray[np.float64]]] = {}

    @cached_property
    def _net(self) -> csr_matrix:
        """Length of every step from keyframe to keyframe, metres, of all robots' cores one after the other."""
        starts, follows = self._starts, self._follows
        own = block_diag(list(self._lengths.values()), format="coo")
        ends = [
            (starts[tie.a] + follows[tie.a][tie.match.i], starts[tie.b] + follows[tie.b][tie.match.j])
            for tie in self._ties
        ]
        first, second = np.array(ends, dtype=np.int64).reshape(-1, 2).T
        nothing = np.full(len(self._ties), 1e-6)  # a length of 0 would be no edge
        tied = coo_matrix((nothing, (first, second)), shape=own.shape)
        return (own + tied).tocsr()

    def to(self, robot_id: str) -> Mapping[str, NDArray[np.float64]]:
        """Return by robot: ``(K,)``, the shortest way from each keyframe to any of this robot's, metres."""
        if robot_id not in self._to:
            sources = self._starts[robot_id] + np.arange(self._lengths[robot_id].shape[0])
            away = dijkstra(self._net, directed=False, indices=sources, min_only=True)
            self._to[robot_id] = {name: away[self._starts[name] + follows] for name, follows in self._follows.items()}
        return self._to[robot_id]

    def held(self, robot_id: str, other: str) -> NDArray[np.bool_]:
        """Return which keyframes ``(K,)`` of a robot are held where they are beside another's, by ties near them."""
        return np.asarray(self.to(other)[robot_id] <= HELD_M)


def part_around(tiled: TiledGrid, bend: Bend, is_held: NDArray[np.bool_]) -> TiledGrid:
    """Return the tiles of a bent map around its keyframes that are held ``(K,)``."""
    if not (tiled.tiles and is_held.any()):
        return TiledGrid({}, tiled.resolution_m, tiled.offset_m)
    T_map_key = se2.compose(se2.inverse(bend.T_team_map), bend.T_team_key)
    indices = np.array(list(tiled.tiles))
    away_m, key = cKDTree(T_map_key[:, :2]).query(tiled.points_m(indices * TILE_CELLS + TILE_CELLS // 2))
    is_kept = (away_m <= SHOWN_M) & is_held[key]
    tiles = {index: tile for (index, tile), kept in zip(tiled.tiles.items(), is_kept, strict=True) if kept}
    return TiledGrid(tiles, tiled.resolution_m, tiled.offset_m)
