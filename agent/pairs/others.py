"""Which pairs of two other robots are worth a search here: those that place a map, or close a loop nobody hinted at."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping

from mrslam.agent.pairs.belief import PairBelief
from mrslam.alignment.stability import SAME_PLACE
from mrslam.merge import Pair
from mrslam.merge.graph.edges import pair_of
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

EDGES_ENOUGH = 2
"""Merged pairs of a robot from which it needs no more from a pair of two others: it is part of a loop of alignments,
whose consistency is checked. So a team of n has about 2 n alignments to find and follow, not n^2 / 2."""
TRIES_ENOUGH = 6
"""Tries to find a map in the own one before it is searched for in a third: those two search for each other as well, and
hint at what they find. Measured over 114 merges of missions with faults: nine in ten came by the 6th try."""
LOOP_NS = 90_000_000_000
"""Time that two placed robots have to hint at the loop that their pair closes, nanoseconds: nothing is placed by it."""


def tied_enough(own_id: str, beliefs: Mapping[Pair, PairBelief], placed: Collection[str]) -> set[str]:
    """Return the placed robots, without the own one, that are part of enough merged pairs (``EDGES_ENOUGH``)."""
    merged = Counter(name for pair, belief in beliefs.items() if belief.alignment is not None for name in pair)
    return {name for name in placed if merged[name] >= EDGES_ENOUGH and name != own_id}


def is_predicted(pair: Pair, T_a_b: Transform, T_team_map: Mapping[str, Transform]) -> bool:
    """Return whether alignments with other maps lead to the same place of a pair: no other can be its place then."""
    a, b = pair
    return a in T_team_map and b in T_team_map and SAME_PLACE.is_near(se2.between(T_team_map[a], T_team_map[b]), T_a_b)


def is_left_to_others(
    own_id: str, pair: Pair, beliefs: Mapping[Pair, PairBelief], placed: Collection[str], now_ns: int
) -> bool:
    """Return whether two others are left to find their pair themselves for now.

    A base station, which has no map of its own, leaves nothing to others.
    """
    if own_id in pair or beliefs[pair].found is not None:
        return False
    own = [beliefs.get(pair_of(own_id, name)) for name in pair]
    if any(belief is None for belief in own):
        return False
    if all(name in placed for name in pair):
        return now_ns - max(belief.accepted_at_ns or 0 for belief in own if belief is not None) < LOOP_NS
    return any(b is not None and b.alignment is None and b.attempts < TRIES_ENOUGH for b in own)
