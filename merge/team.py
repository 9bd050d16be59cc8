"""The team map, kept up to date as maps grow and alignments are added and withdrawn."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.config import MergeConfig
from mrslam.merge.contradictions import Contradictions
from mrslam.merge.elsewhere import Elsewhere
from mrslam.merge.graph.edges import AlignmentLike, Pair, make_edge
from mrslam.merge.grids.fusion_tree import FusionTree
from mrslam.merge.grids.layers import Layer
from mrslam.merge.grids.published_map import PublishedMap, as_it_is, is_same
from mrslam.merge.grids.shown import Shown
from mrslam.merge.grids.tiled_grid import TiledGrid, Tiles
from mrslam.merge.joint.bend import Bend
from mrslam.merge.joint.bent_map import BentMap
from mrslam.merge.joint.bent_team import BentTeam
from mrslam.merge.joint.trail import Trail
from mrslam.merge.team_graph import Conflict, Placement, TeamGraph
from mrslam.spatial import TILE_CELLS, InputError, OccupancyGrid, se2
from mrslam.spatial.tiles import MOST_CELLS, TileIndex, assembled, box_cells

ELSEWHERE_CELLS = 2
"""Cells by which maps may differ and show the same: 0.1 m, what joined maps are good to."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TeamMap(Placement):
    """All placed robots' maps as one, and how they fit together."""

    grid: OccupancyGrid
    """The fused map in the team frame; 0 x 0 where nothing is placed."""
    layers: Mapping[str, Tiles] = field(default_factory=dict)
    """By robot: its map, bent where it is, as tiles of the team map's lattice; none where nothing was fused."""


class TeamMapper:
    """Builds team maps from robots' maps and accepted alignments; the result does not depend on their order.

    The team frame is the anchor's map frame, for good: growth never moves it. Without an anchor it is the frame of the
    first robot (by id) of the largest component; ``keeps_frame``: of the robot that had it before, while it is in the
    largest component.
    """

    def __init__(
        self, anchor: str | None = None, config: MergeConfig | None = None, *, keeps_frame: bool = False
    ) -> None:
        self.anchor, self.keeps_frame = anchor, keeps_frame
        self.frame: str | None = anchor
        """The robot whose map frame was the team frame when maps were placed last."""
        self.config = config or MergeConfig()
        self.graph = TeamGraph(self.config)
        self.bent = BentTeam()
        """How the maps are bent to fit each other, by the last joint solution."""
        self._maps: dict[str, PublishedMap] = {}
        self._scanned: set[str] = set()
        """Robots whose maps came with keyframes' scans; only these can be joined and bent."""
        self._tiled_maps: dict[str, TiledGrid] = {}
        """By robot: its map in tiles (a cache)."""
        self._bent: dict[str, tuple[TiledGrid, Bend, TiledGrid]] = {}
        """By robot: its map, a bend, and the map bent by it (a cache)."""
        self._bent_maps: dict[str, BentMap] = {}
        """By robot: its map as it was drawn bent last, of which only what changed is drawn again."""
        self._judged_maps: dict[str, tuple[se2.Transform, TiledGrid, se2.Transform]] = {}
        """By robot: its ``T_team_key``, the map bent when that solution came, and ``T_team_map`` then (a cache)."""
        self._contradictions = Contradictions(self.config)
        self._layers: dict[str, Layer] = {}
        self._tree = FusionTree(self.config.fusion)

    @property
    def tiles_warped(self) -> int:
        """Tiles rewritten into the team's lattice so far."""
        return sum(layer.warped for layer in self._layers.values())

    @property
    def fusions(self) -> int:
        """Fusions of two tiles done so far."""
        return self._tree.fusions

    def set_map(self, robot_id: str, known: PublishedMap, trail: Trail | None = None) -> None:
        """Set a robot's map, and its trail where it has one; a map with the same cells changes nothing."""
        (self._scanned.add if trail is not None and len(trail) else self._scanned.discard)(robot_id)
        if trail is not None:
            self.bent = self.bent.corrected(robot_id, trail)
        held = self._maps.get(robot_id)
        if held is None or not is_same(held, known):
            self._maps[robot_id] = known
            self._tiled_maps.pop(robot_id, None)
            self.graph.set_map(robot_id, as_it_is(known))

    def remove_map(self, robot_id: str) -> None:
        """Forget a robot's map."""
        for held in (self._maps, self._tiled_maps, self._bent, self._bent_maps, self._judged_maps, self._layers):
            held.pop(robot_id, None)
        self._scanned.discard(robot_id)
        self._contradictions.forget(robot_id)
        self.bent = self.bent.without(robot_id)
        self.graph.remove_map(robot_id)

    def placement(self, alignments: Mapping[Pair, AlignmentLike]) -> Placement:
        """Return where every map lies by these accepted alignments ``T_a_b``, without fusing anything."""
        before = self.frame if self.keeps_frame else None
        placement = self.graph.place(alignments, self.anchor, self._conflict(alignments), before, self.bent.tied)
        self.frame = placement.anchor
        return replace(placement, **self._bent_places(placement))

    def _bent_places(self, placement: Placement) -> dict[str, Any]:
        """Return the fields ``bends`` and ``T_team_map`` of the placement where the last joint solution applies, or {}.

        It applies only while every robot that it ties is placed, and every alignment believed that its ties came of:
        what was withdrawn may have bent the others wrongly.
        """
        bends, places = self.bent.bends, placement.T_team_map
        if placement.anchor not in bends or not bends.keys() <= places.keys():
            return {}
        if not self.bent.rests_on({edge.pair for edge in placement.edges}):
            return {}
        at_last_key = {
            x: bends[x].T_team_map_now if x in bends and x != placement.anchor else T for x, T in places.items()
        }
        return {"bends": dict(bends), "T_team_map": at_last_key}

    def team_map(self, alignments: Mapping[Pair, AlignmentLike]) -> TeamMap:
        """Return the team map by these accepted alignments; only what changed since the last call is fused again."""
        placement, resolution_m = self._fused(alignments)
        layers = {robot_id: dict(layer.tiles) for robot_id, layer in self._layers.items()}
        return TeamMap(grid=_assembled(self._tree.cells, resolution_m), layers=layers, **vars(placement))

    def team_area(self, alignments: Mapping[Pair, AlignmentLike]) -> tuple[Placement, float]:
        """Return where the maps lie, and the known area of :meth:`team_map`, square metres, without assembling it."""
        placement, resolution_m = self._fused(alignments)
        return placement, float(sum(self._tree.known_cells.values())) * resolution_m**2

    def elsewhere(self, robot_id: str, others: Collection[str], alignments: Mapping[Pair, AlignmentLike]) -> Elsewhere:
        """Return what the maps of ``others`` show of the floor that a placed robot's map lies on."""
        placement = self.placement(alignments)
        resolution_m = self._resolution(placement)
        maps = [self._layer(x, placement, resolution_m).tiles for x in sorted(others) if x in placement.T_team_map]
        T_team_map, bend = placement.T_team_map[robot_id], placement.bends.get(robot_id)
        return Elsewhere(Shown(maps, ELSEWHERE_CELLS), resolution_m, T_team_map, bend)

    def _fused(self, alignments: Mapping[Pair, AlignmentLike]) -> tuple[Placement, float]:
        """Return the placement by these alignments, and the edge of the fused tiles' cells, metres.

        The fused tiles are brought up to date with it.
        """
        placement = self.placement(alignments)
        resolution_m = self._resolution(placement)
        self._layers = {x: self._layer(x, placement, resolution_m) for x in placement.T_team_map}
        self._tree.update(self._layers)
        return placement, resolution_m

    def _layer(self, robot_id: str, placement: Placement, resolution_m: float) -> Layer:
        """Return the map of a placed robot in the team map's lattice, brought up to date."""
        layer, bend = self._layers.setdefault(robot_id, Layer()), placement.bends.get(robot_id)
        T_team_map = placement.T_team_map[robot_id] if bend is None else bend.T_team_map
        layer.update(self._drawn(robot_id, bend), T_team_map, resolution_m)
        return layer

    def _resolution(self, placement: Placement) -> float:
        if self.config.resolution_m is not None:
            return self.config.resolution_m
        placed = [self._maps[x] for x in placement.T_team_map] or self._maps.values()
        finest = [as_it_is(known).resolution_m for known in placed]
        return min(finest, default=0.05)

    def _conflict(self, alignments: Mapping[Pair, AlignmentLike]) -> Conflict:
        """Return the function that compares two maps: bent where a joint solution bends them, else as published.

        Maps with scans are not compared until a joint solution was computed with the pair's present alignment: rigidly
        placed, bent maps would contradict each other though the alignment is right.
        """
        edges = [make_edge(a, b, found) for (a, b), found in alignments.items()]
        T_a_b = {edge.pair: edge.T_a_b for edge in edges}

        def conflict(a: str, b: str, T: se2.Transform, hops: int) -> str | None:
            if {a, b} <= self._scanned and not self.bent.judges(a, b, T_a_b):
                return None
            if self.bent.compares(a, b):
                if (a, b) not in self.bent.met or (hops == 1 and self.bent.lays_by_others(a, b)):
                    return None
                (one, T_team_a), (two, T_team_b) = self._judged(a), self._judged(b)
                return self._contradictions.of_bent(a, b, self.bent, (one, two), se2.between(T_team_a, T_team_b))
            return self._contradictions.against(a, b, (self._drawn(a, None), self._drawn(b, None)), T, hops)

        return conflict

    def _judged(self, robot_id: str) -> tuple[TiledGrid, se2.Transform]:
        """Return a robot's bent map as it was when the joint solution came, and where it lay: judged once for each."""
        bend, held = self.bent.bends[robot_id], self._judged_maps.get(robot_id)
        if held is None or held[0] is not bend.T_team_key:
            held = self._judged_maps[robot_id] = (bend.T_team_key, self._drawn(robot_id, bend), bend.T_team_map)
        return held[1:]

    def _drawn(self, robot_id: str, bend: Bend | None) -> TiledGrid:
        """Return a robot's map as it is drawn into the team map: bent by ``bend``, or the published one."""
        tiled = self._tiled_maps.get(robot_id)
        if tiled is None:
            tiled = self._tiled_maps[robot_id] = TiledGrid.of(as_it_is(self._maps[robot_id]))
        if bend is None:
            return tiled
        held = self._bent.get(robot_id)
        if held is None or held[0] is not tiled or held[1] is not bend:
            last = self._bent_maps.setdefault(robot_id, BentMap())
            held = self._bent[robot_id] = (tiled, bend, last.draw(tiled, bend.displacement))
        return held[2]


def _assembled(tiles: dict[TileIndex, NDArray[np.int8]], resolution_m: float) -> OccupancyGrid:
    rows, cols = [i for i, _ in tiles], [j for _, j in tiles]
    if box_cells(tiles) > MOST_CELLS:
        height_m, width_m = (resolution_m * TILE_CELLS * (max(side) - min(side) + 1) for side in (rows, cols))
        raise InputError(
            f"the team map would be {width_m:.0f} x {height_m:.0f} m of {resolution_m:g} m cells, more than memory "
            "holds: are known poses in metres? merge.resolution_m may be larger"
        )
    return assembled(tiles, resolution_m)
