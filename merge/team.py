"""The team map, kept up to date as maps grow and alignments come and go."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.config import MergeConfig
from mrslam.merge.graph.edges import AlignmentLike, Pair
from mrslam.merge.graph.team_graph import Placement, TeamGraph
from mrslam.merge.grids.agreement import Walls, compare
from mrslam.merge.grids.fusion_tree import FusionTree
from mrslam.merge.grids.layers import Layer
from mrslam.spatial import TILE_CELLS, UNKNOWN, InputError, OccupancyGrid, se2
from mrslam.spatial.tiles import MOST_CELLS, TileIndex, box_cells

_Compared = tuple[OccupancyGrid, OccupancyGrid, str | None]
REMEMBERED = 4
"""Comparisons kept for each pair of robots: by alignment and by placement, now and before the last change."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TeamMap(Placement):
    """All placed robots' maps as one, and how they fit together."""

    grid: OccupancyGrid
    """The fused map in the team frame; 0 x 0 where nothing is placed."""


class TeamMapper:
    """Builds team maps from robots' maps and accepted alignments; in whatever order these came, the bytes are the same.

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
        self._grids: dict[str, OccupancyGrid] = {}
        self._walls: dict[str, Walls] = {}
        self._compared: dict[Pair, dict[tuple[bytes, int], _Compared]] = {}
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

    def set_map(self, robot_id: str, grid: OccupancyGrid) -> None:
        """Take a robot's map; one of the same content changes nothing."""
        held = self._grids.get(robot_id)
        if held is not None and held.origin_m == grid.origin_m and np.array_equal(held.cells, grid.cells):
            return
        self._grids[robot_id] = grid
        self._walls.pop(robot_id, None)
        self.graph.set_map(robot_id, grid)

    def remove_map(self, robot_id: str) -> None:
        """Forget a robot's map."""
        for held in (self._grids, self._walls, self._layers):
            held.pop(robot_id, None)
        self.graph.remove_map(robot_id)

    def placement(self, alignments: Mapping[Pair, AlignmentLike]) -> Placement:
        """Return where every map lies by these accepted alignments ``T_a_b``, without fusing anything."""
        before = self.frame if self.keeps_frame else None
        placement = self.graph.place(alignments, self.anchor, self._conflict, before)
        self.frame = placement.anchor
        return placement

    def team_map(self, alignments: Mapping[Pair, AlignmentLike]) -> TeamMap:
        """Return the team map by these accepted alignments; only what changed since the last call is fused again."""
        placement = self.placement(alignments)
        resolution_m = self._resolution(placement)
        self._layers = {x: self._layers.get(x, Layer()) for x in placement.T_team_map}
        for robot_id, layer in self._layers.items():
            layer.update(self._grids[robot_id], placement.T_team_map[robot_id], resolution_m)
        self._tree.update(self._layers)
        return TeamMap(grid=_assembled(self._tree.cells, resolution_m), **vars(placement))

    def _resolution(self, placement: Placement) -> float:
        if self.config.resolution_m is not None:
            return self.config.resolution_m
        finest = [self._grids[x].resolution_m for x in placement.T_team_map] or [
            g.resolution_m for g in self._grids.values()
        ]
        return min(finest, default=0.05)

    def _conflict(self, a: str, b: str, T_a_b: se2.Transform, hops: int) -> str | None:
        """Return how two maps contradict each other, or None; remembered while both maps stay as they are."""
        one, two = self._grids[a], self._grids[b]
        key = (np.asarray(T_a_b).tobytes(), hops)
        held = self._compared.setdefault((a, b), {})
        if key in held and held[key][0] is one and held[key][1] is two:
            return held[key][2]
        for robot_id in (a, b):
            if robot_id not in self._walls:
                self._walls[robot_id] = Walls(self._grids[robot_id])
        near_m = self.config.contradiction_tolerance_m * float(np.sqrt(hops))
        found = compare(self._walls[a], self._walls[b], T_a_b, near_m)
        against = None
        if found.share_against > self.config.contradiction_share and found.against_m >= self.config.contradiction_min_m:
            share = 100 * found.share_against
            against = f"{found.against_m:.1f} m of wall of {a} and {b} ({share:.0f} %) is on the other's free space"
        held[key] = (one, two, against)
        for old in list(held)[:-REMEMBERED]:
            del held[old]
        return against


def _assembled(tiles: dict[TileIndex, NDArray[np.int8]], resolution_m: float) -> OccupancyGrid:
    if not tiles:
        return OccupancyGrid(np.empty((0, 0), dtype=np.int8), resolution_m)
    rows, cols = [i for i, _ in tiles], [j for _, j in tiles]
    if box_cells(tiles) > MOST_CELLS:
        height_m, width_m = (resolution_m * TILE_CELLS * (max(side) - min(side) + 1) for side in (rows, cols))
        raise InputError(
            f"the team map would be {width_m:.0f} x {height_m:.0f} m of {resolution_m:g} m cells, more than memory "
            "holds: are known poses in metres? merge.resolution_m may be larger"
        )
    i0, j0 = min(rows), min(cols)
    shape = ((max(rows) - i0 + 1) * TILE_CELLS, (max(cols) - j0 + 1) * TILE_CELLS)
    cells = np.full(shape, UNKNOWN, dtype=np.int8)
    for (i, j), tile in tiles.items():
        r, c = (i - i0) * TILE_CELLS, (j - j0) * TILE_CELLS
        cells[r : r + TILE_CELLS, c : c + TILE_CELLS] = tile
    return OccupancyGrid.at_cell(cells, resolution_m, i0 * TILE_CELLS, j0 * TILE_CELLS).cropped()
