"""Matches of several robots' keyframes as edges of one pose graph, and which of them its solution believes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from mrslam.merge.graph.edges import Pair
from mrslam.merge.graph.tree import components
from mrslam.merge.joint.consistent import KeyMatch
from mrslam.merge.joint.trail import Trail
from mrslam.spatial.pose_graph import Edges, relax_again, relax_graduated
from mrslam.spatial.se2 import Transform

CHI2_MOST = 16.27
"""Largest squared Mahalanobis residual of a believed match: 99.9 % of chi2 with 3 degrees of freedom."""
Found = Mapping[Pair, Mapping[tuple[int, int], KeyMatch]]
"""By pair and by its two keyframes: how they match."""
NamedMatch = tuple[str, str, KeyMatch]
"""The robots whose keyframes ``i`` and ``j`` match, and how."""


class Tie(NamedTuple):
    """A match between two robots that went into the solve."""

    a: str
    b: str
    match: KeyMatch
    """``i`` is a keyframe of ``a``, ``j`` of ``b``."""
    believed: bool
    """Whether the solve kept it (``CHI2_MOST``)."""


def tied_pairs(ties: Sequence[Tie]) -> set[Pair]:
    """Return the pairs with a match that is believed."""
    return {(tie.a, tie.b) for tie in ties if tie.believed}


def believed_matches(ties: Sequence[Tie]) -> dict[Pair, list[KeyMatch]]:
    """Return by pair the matches that are believed, in their order."""
    matches: defaultdict[Pair, list[KeyMatch]] = defaultdict(list)
    for tie in ties:
        if tie.believed:
            matches[tie.a, tie.b].append(tie.match)
    return dict(matches)


def groups(names: Collection[str], pairs: Collection[Pair]) -> dict[str, str]:
    """Return by robot the first of all that pairs connect with it."""
    return {name: group[0] for group in components(names, pairs) for name in group}


def solve(
    trails: Mapping[str, Trail],
    poses: Mapping[str, Transform],
    matches: Sequence[NamedMatch],
    spare: Sequence[NamedMatch] = (),
) -> tuple[dict[str, Transform], tuple[Tie, ...]]:
    """Return keyframes ``(K, 3)`` of every robot that fit all trails and matches best, and which matches are believed.

    ``poses`` : first guess, ``(K, 3)`` by robot in one frame; the first robot's first keyframe stays where it has it.
    ``spare`` : matches that are believed only where they agree with what the others have led to.
    """
    counts = [len(trail) for trail in trails.values()]
    starts = dict(zip(trails, np.cumsum([0, *counts]), strict=False))
    own = Edges.joined([trail.edges.shifted(starts[name]) for name, trail in trails.items()])
    edges = Edges.joined([own, _edges(matches, starts)])
    begin = np.concatenate(list(poses.values()))
    together, weight = relax_graduated(begin, edges, np.arange(edges.first.size) >= own.first.size, CHI2_MOST)
    edges = Edges.joined([edges, _edges(spare, starts)])
    is_tie, weight = np.arange(edges.first.size) >= own.first.size, np.append(weight, np.zeros(len(spare)))
    together, weight = relax_again(begin, together, edges, is_tie, weight, CHI2_MOST)
    is_believed = weight[is_tie] > 0.0
    ties = [Tie(*match, bool(one)) for match, one in zip([*matches, *spare], is_believed, strict=True)]
    # What tied two robots to third ones may have been dropped: then a spare match has nothing to be held against.
    first = groups(trails, tied_pairs(ties) & {(a, b) for a, b, _ in matches})
    agree = (tie for tie in ties[len(matches) :] if tie.believed and first[tie.a] == first[tie.b])
    kept = (*ties[: len(matches)], *agree)
    return {name: together[starts[name] : starts[name] + len(trail)] for name, trail in trails.items()}, kept


def _edges(matches: Sequence[NamedMatch], starts: Mapping[str, int]) -> Edges:
    """Return matches as edges of the graph in which the keyframes of each robot begin at ``starts``."""
    return Edges(
        np.array([starts[a] + match.i for a, _, match in matches], dtype=np.int64),
        np.array([starts[b] + match.j for _, b, match in matches], dtype=np.int64),
        np.array([match.T_i_j for *_, match in matches]).reshape(-1, 3),
        np.array([match.information for *_, match in matches]).reshape(-1, 3, 3),
    )
