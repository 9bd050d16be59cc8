"""Merging a set of map files' grids: which belong together, and how."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from merge.config import MergeConfig
from merge.edges import Pair
from merge.team import TeamMap, TeamMapper
from spatial import InputError, OccupancyGrid

if TYPE_CHECKING:
    from alignment import Alignment, Rejection

Progress = Callable[[int, int], None]
"""(pairs done, pairs in all)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MergeResult:
    """A team map, and what every pair of maps had to say about it."""

    team_map: TeamMap
    edges: dict[Pair, Alignment]
    """Accepted alignments ``T_a_b`` by pair (a < b), used (``team_map.edges``) or not (``team_map.dropped``)."""
    rejections: dict[Pair, Rejection]
    """Pairs that do not fit together, by pair."""


def merge_maps(
    grids: Mapping[str, OccupancyGrid],
    known_poses: Mapping[str, ArrayLike] | None = None,
    method: str = "auto",
    progress: Progress | None = None,
    config: MergeConfig | None = None,
    anchor: str | None = None,
    workers: int | None = None,
) -> MergeResult:
    """Align all pairs of maps, place those of the largest component and fuse them.

    ``known_poses`` (``T_team_map`` by name) places maps without overlap too. The result does not depend on the order of
    the maps nor on ``workers`` (threads; default: one a core).
    """
    from alignment import Alignment, align

    if not grids:
        raise InputError("nothing to merge: no maps given")
    unknown = sorted(set(known_poses or {}) - set(grids))
    if unknown:
        raise InputError(f"known poses name maps that are not there: {', '.join(unknown)}")
    names = sorted(grids)
    pairs = [(a, b) for i, a in enumerate(names) for b in names[i + 1 :]]
    edges: dict[Pair, Alignment] = {}
    rejections: dict[Pair, Rejection] = {}
    with ThreadPoolExecutor(workers or min(8, os.cpu_count() or 1)) as pool:
        found = pool.map(lambda pair: align(grids[pair[0]], grids[pair[1]], method=method), pairs)
        for done, (pair, result) in enumerate(zip(pairs, found, strict=True), start=1):
            if isinstance(result, Alignment):
                edges[pair] = result
            else:
                rejections[pair] = result
            if progress is not None:
                progress(done, len(pairs))
    mapper = TeamMapper(anchor, config)
    for name in names:
        mapper.set_map(name, grids[name])
    for (a, b), alignment in edges.items():
        mapper.set_edge(a, b, alignment)
    if known_poses:
        mapper.graph.set_known_poses(known_poses)
    return MergeResult(team_map=mapper.team_map(), edges=edges, rejections=rejections)
