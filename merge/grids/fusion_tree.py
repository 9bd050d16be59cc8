"""The fusion tree (mrgs, Martins et al. 2021): partial fusions are kept, a changed layer re-fuses only its branch.

Each tile of the team map has a tree of its own over the robots that know something of it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.grids.fuse import fuse_evidence, to_cells, to_evidence
from mrslam.merge.grids.layers import Layer
from mrslam.spatial import UNKNOWN
from mrslam.spatial.tiles import TileIndex

Versions = tuple[tuple[str, bytes], ...]
"""Robot ids in order, with the hash of the tile each contributes."""
Nodes = dict[tuple[str, ...], tuple[Versions, NDArray[np.int32]]]
"""By robot ids: what a node was made of, and its evidence."""
MOST_NODES = 1024
"""Most nodes that are kept, 16 MB: those of the tiles fused last. Of what sixteen robots know all nodes would take 0.25
MB a tile; those of another tile are made again when it changes, in a third of a millisecond."""


class FusionTree:
    """Fused tiles of a team, recomputed where a layer changed, came or went."""

    def __init__(self, method: str) -> None:
        self.method = method
        self.cells: dict[TileIndex, NDArray[np.int8]] = {}
        """``(64, 64) int8`` fused, by tile of the team lattice."""
        self.known_cells: dict[TileIndex, int] = {}
        """How many cells of each fused tile are known."""
        self.fusions = 0
        """Fusions of two tiles done so far."""
        values = np.append(np.arange(101), UNKNOWN).astype(np.int8)
        self._alone = to_cells(to_evidence(values, method), method)
        """``(102,)`` what each value becomes where one robot alone knows something; that of unknown is the last."""
        self._made_of: dict[TileIndex, Versions] = {}
        self._nodes: dict[TileIndex, Nodes] = {}
        """By tile, the one fused last at the end."""
        self._kept = 0

    def update(self, layers: Mapping[str, Layer]) -> list[TileIndex]:
        """Bring the fused tiles up to date; return the indices of those fused again, in order."""
        here: dict[TileIndex, list[tuple[str, bytes]]] = {}
        for robot_id in sorted(layers):
            layer = layers[robot_id]
            for index in layer.tiles:
                here.setdefault(index, []).append((robot_id, layer.versions[index]))
        for index in self._made_of.keys() - here.keys():
            del self._made_of[index], self.cells[index], self.known_cells[index]
            self._forget(index)
        made = []
        for index in sorted(here):
            versions = tuple(here[index])
            if self._made_of.get(index) == versions:
                continue
            fresh: Nodes = {}
            if len(versions) == 1:
                cells = self._alone[layers[versions[0][0]].tiles[index]]  # from its end: -1 is the last
            else:
                cells = to_cells(self._fuse(index, versions, layers, self._nodes.get(index, {}), fresh), self.method)
            self.cells[index], self.known_cells[index] = cells, int(np.count_nonzero(cells != UNKNOWN))
            self._made_of[index] = versions
            self._keep(index, fresh)
            made.append(index)
        return made

    def _keep(self, index: TileIndex, nodes: Nodes) -> None:
        """Keep a tile's nodes in place of its old ones, and no more than ``MOST_NODES`` of all tiles."""
        self._forget(index)
        self._nodes[index] = nodes
        self._kept += len(nodes)
        while self._kept > MOST_NODES:
            self._forget(next(iter(self._nodes)))

    def _forget(self, index: TileIndex) -> None:
        self._kept -= len(self._nodes.pop(index, ()))

    def _fuse(
        self,
        index: TileIndex,
        versions: Versions,
        layers: Mapping[str, Layer],
        old: Nodes,
        fresh: Nodes,
    ) -> NDArray[np.int32]:
        """Return these robots' evidence ``(64, 64)``, by halves; inner nodes are kept, leaves are cheap to make."""
        if len(versions) == 1:
            return to_evidence(layers[versions[0][0]].tiles[index], self.method)
        ids = tuple(robot_id for robot_id, _ in versions)
        kept = old.get(ids)
        half = len(versions) // 2
        if kept is not None and kept[0] == versions:
            fresh[ids] = kept
            for part in (ids[:half], ids[half:]):
                _carry(part, old, fresh)
            return kept[1]
        one = self._fuse(index, versions[:half], layers, old, fresh)
        two = self._fuse(index, versions[half:], layers, old, fresh)
        evidence = fuse_evidence(one, two, self.method)
        self.fusions += 1
        fresh[ids] = (versions, evidence)
        return evidence


def _carry(
    ids: tuple[str, ...],
    old: Nodes,
    fresh: Nodes,
) -> None:
    """Keep the nodes below one that is still good."""
    if len(ids) > 1 and ids in old:
        fresh[ids] = old[ids]
        half = len(ids) // 2
        _carry(ids[:half], old, fresh)
        _carry(ids[half:], old, fresh)
