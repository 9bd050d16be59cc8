"""Checking bridges: alignments that alone hold two groups of maps together, so that no loop checks them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mrslam.alignment import Alignment, Rejection
from mrslam.merge.batch.pair_aligner import PairAligner, first
from mrslam.merge.graph.nodes import node_of
from mrslam.merge.graph.tree import components
from mrslam.merge.team import TeamMap
from mrslam.spatial import se2

SURE = 0.75
"""Least confidence of a bridge that stands though the fused maps of both sides fit there without a clear lead."""


def vet(pairs: PairAligner, cluster: TeamMap) -> None:
    """Withdraw a cluster's bridges where the fused maps of their two sides do not fit."""
    if len(cluster.T_team_map) < 3:
        return
    for edge in sorted(cluster.edges, key=lambda edge: (edge.confidence, edge.pair)):
        sides = components(cluster.T_team_map, [other.pair for other in cluster.edges if other is not edge])
        if len(sides) < 2 or edge.pair in pairs.vetted:
            continue
        pairs.vetted.add(edge.pair)
        against = doubt(pairs, edge.confidence, sides, cluster.T_team_map)
        if against is not None:
            del pairs.edges[edge.pair]
            pairs.rejections[edge.pair] = against
            for part in [one for side in sides for one in pairs.clusters(side)]:
                vet(pairs, part)
            return


def doubt(
    pairs: PairAligner, confidence: float, sides: Sequence[Sequence[str]], place: Mapping[str, se2.Transform]
) -> Rejection | None:
    """Return why the two sides of an alignment do not fit as they are placed, or None where they do."""
    one, other = (pairs.cluster(side) for side in sides)
    found = pairs.align_grids(one.grid, [other.grid])[0]
    placed = se2.between(place[first(one)], place[first(other)])
    gap_m, gap_rad = (
        se2.difference_at(placed, found.T_a_b, node_of(other.grid).centre_m)
        if found.T_a_b is not None
        else (np.inf, np.inf)
    )
    agrees = gap_m < pairs.config.loop_tolerance_m * 2 and gap_rad < pairs.config.loop_tolerance_rad * 2
    if agrees and (isinstance(found, Alignment) or confidence >= SURE):
        return None
    better = f"they fit better {gap_m:.1f} m and {np.degrees(gap_rad):.1f} deg away"
    why = found.reason if isinstance(found, Rejection) else better
    reason = f"accepted by itself, but the merged maps of both sides speak against it: {why}"
    return Rejection(reason, found.confidence, found.evidence, found.method)
