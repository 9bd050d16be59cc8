"""Merging a set of maps: which belong together, and how."""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from mrslam.alignment import Alignment, Rejection
from mrslam.alignment.align import MIN_KNOWN_M2
from mrslam.merge.batch.all_pairs import try_every_pair
from mrslam.merge.batch.cluster_search import ClusterSearch
from mrslam.merge.batch.pair_aligner import PairAligner, Progress
from mrslam.merge.config import MergeConfig
from mrslam.merge.graph.edges import Pair
from mrslam.merge.joint.bent_team import BentTeam
from mrslam.merge.joint.join import join
from mrslam.merge.joint.ties import Tie
from mrslam.merge.joint.trail import Trail
from mrslam.merge.team import TeamMap, TeamMapper
from mrslam.merge.team_graph import Placement
from mrslam.spatial import InputError, OccupancyGrid

ALL_PAIRS_UP_TO = 9
"""Most maps of which every pair is tried (36 pairs); above, the number of alignments would grow with the square."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MergeResult:
    """A team map, and what the pairs of maps had to say about it."""

    team_map: TeamMap
    edges: dict[Pair, Alignment]
    """Accepted alignments ``T_a_b`` by pair (a < b), used (``team_map.edges``) or not (``team_map.dropped``)."""
    rejections: dict[Pair, Rejection]
    """Pairs that were tried and do not fit together."""
    tried: int
    """Alignments computed."""
    ties: tuple[Tie, ...] = ()
    """Places that two ways have in common, where maps are bent."""


def merge_maps(
    grids: Mapping[str, OccupancyGrid],
    known_poses: Mapping[str, ArrayLike] | None = None,
    method: str = "auto",
    progress: Progress | None = None,
    config: MergeConfig | None = None,
    anchor: str | None = None,
    workers: int | None = None,
    trails: Mapping[str, Trail] | None = None,
) -> MergeResult:
    """Find how maps fit together, place those of the largest component (or the anchor's) and fuse them.

    ``known_poses`` (``T_team_map`` by name) define the team frame and place maps without overlap too; otherwise it is
    the map frame of the anchor, or of the first map by name that is placed. ``trails`` : the ways that made the maps,
    by name, where they are known: such maps are bent until what was seen on two ways agrees. Others are laid as they
    are, and so are all where known poses define the frame. The result does not depend on the order of the maps nor on
    ``workers`` (threads; default: one a core). Raises ``InputError`` for names that do not match.
    """
    config, trails = config or MergeConfig(), trails or {}
    poses = {name: np.asarray(pose, dtype=np.float64) for name, pose in (known_poses or {}).items()}
    mapper = TeamMapper(anchor, config)
    if not grids:
        raise InputError("nothing to merge: no maps given")
    for name in [*poses, *([anchor] if anchor is not None else [])]:
        if name not in grids:
            raise InputError(f"there is no map {name!r} among {', '.join(sorted(grids))}")
    for name in sorted(grids):
        mapper.set_map(name, grids[name], trails.get(name))
    mapper.graph.set_known_poses(poses)
    with ThreadPoolExecutor(workers or min(8, os.cpu_count() or 1)) as pool:
        pairs = PairAligner(grids, method, pool, config, progress, trails)
        if len(grids) <= ALL_PAIRS_UP_TO or len(poses) == len(grids):
            try_every_pair(pairs, poses)
        else:
            ClusterSearch(pairs).run()
    mapper.bent = _bend(mapper.placement(pairs.edges), trails, pairs.edges)
    if not mapper.bent.joined:  # nobody is bent: maps are judged as they are
        for name in trails:
            mapper.set_map(name, grids[name])
    team_map = mapper.team_map(pairs.edges)
    unplaced = {name: _why(name, reason, pairs) for name, reason in team_map.unplaced.items()}
    return MergeResult(
        team_map=replace(team_map, unplaced=unplaced),
        edges=dict(sorted(pairs.edges.items())),
        rejections=dict(sorted(pairs.rejections.items())),
        tried=pairs.tried,
        ties=mapper.bent.ties,
    )


def _bend(placement: Placement, trails: Mapping[str, Trail], edges: Mapping[Pair, Alignment]) -> BentTeam:
    """Return how the maps that were placed, and whose ways are known, are bent to fit each other."""
    known = {name: trail for name, trail in trails.items() if name in placement.T_rigid}
    if placement.anchor not in known or len(known) < 2:
        return BentTeam()
    T_a_b = {pair: found.T_a_b for pair, found in edges.items()}
    return BentTeam.of(join(known, placement.T_rigid), placement.anchor, known, T_a_b)


def _why(name: str, reason: str, pairs: PairAligner) -> str:
    """Return why a map is not placed, with its best try in numbers."""
    tries = {pair: found for pair, found in pairs.rejections.items() if name in pair}
    if reason != "no accepted alignment" or not tries:
        return reason
    if (shown_m2 := pairs.grids[name].known_area_m2()) < MIN_KNOWN_M2:
        return f"it shows {shown_m2:.1f} m2, at least {MIN_KNOWN_M2:.0f} m2 are needed"
    best = max(sorted(tries), key=lambda pair: tries[pair].confidence)
    other = f"; nearest was {best[0] if best[1] == name else best[1]}" if len(pairs.grids) > 2 else ""
    return f"{reason}{other}: {tries[best].reason}"
