"""Which matches of several robots' keyframes are believable as sets, before and after a solution of all of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from mrslam.alignment.stability import CORRECTED
from mrslam.merge.graph.edges import Pair
from mrslam.merge.graph.tree import path
from mrslam.merge.joint.consistent import Chosen, agreeing, choose, is_at
from mrslam.merge.joint.ties import Found, NamedMatch, Tie, groups, solve
from mrslam.merge.joint.trail import Trail
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

MATCHES_LEAST = 3
"""Least matches that agree for a pair to be tied: two agree by chance where a corridor repeats itself."""
CLEAR = 1.25
"""Least ratio of the consistent matches to the largest rival set; below, the pair is ambiguous and not tied."""


def solve_believable(
    trails: Mapping[str, Trail], poses: Mapping[str, Transform], found: Found, seen: Mapping[Pair, Transform]
) -> tuple[dict[str, Transform], tuple[Tie, ...], dict[Pair, str]]:
    """Return what :func:`solve` does with the matches that are believable, and why other pairs' are not used.

    Of rooms that look alike two pairs may agree on wrong places by more matches than a third pair has at the right one,
    if it has any. Where that is of robots that saw each other, the others' smallest set is left out, until they are
    where they saw each other.
    """
    chosen, unused = believable(trails, found, seen)
    while True:
        solved, ties = solve(trails, poses, chosen, others(found, chosen, unused))
        rival = _outvoting(trails, solved, ties[: len(chosen)], seen)
        if rival is None:
            return solved, ties, unused
        unused[rival] = "its places would put robots that saw each other elsewhere"
        chosen = [one for one in chosen if one[:2] != rival]


def _outvoting(
    trails: Mapping[str, Trail], solved: Mapping[str, Transform], ties: Sequence[Tie], seen: Mapping[Pair, Transform]
) -> Pair | None:
    """Return the pair with the fewest matches of those that put robots elsewhere than they saw each other, or None."""
    counts = Counter((tie.a, tie.b) for tie in ties)
    believed = Counter((tie.a, tie.b) for tie in ties if tie.believed)
    for pair in sorted(seen):
        is_tied = counts[pair] > 0
        if 2 * believed[pair] < counts[pair] or not (is_tied or _are_where_seen(trails, solved, pair, seen[pair])):
            between = path(counts.keys() - {pair}, *pair)
            if rest := [other for other in between if other not in seen]:
                return min(rest, key=lambda other: (counts[other], other))
    return None


def _are_where_seen(trails: Mapping[str, Trail], solved: Mapping[str, Transform], pair: Pair, T_a_b: Transform) -> bool:
    """Return whether a solution has two maps, which may be bent, at ``T_a_b (3,)`` where their robots were nearest."""
    keys = [trails[name].T_map_key for name in pair]
    apart_m = np.hypot(*(keys[0][:, None, :2] - se2.compose(T_a_b, keys[1])[None, :, :2]).transpose(2, 0, 1))
    nearest = np.unravel_index(np.argmin(apart_m), apart_m.shape)
    T_a, T_b = (
        se2.compose(solved[name][k], se2.inverse(own[k])) for name, own, k in zip(pair, keys, nearest, strict=True)
    )
    return CORRECTED.is_near(se2.between(T_a, T_b), T_a_b)


def believable(
    trails: Mapping[str, Trail], found: Found, seen: Mapping[Pair, Transform]
) -> tuple[list[NamedMatch], dict[Pair, str]]:
    """Return every pair's largest consistent set of matches, and why the ambiguous pairs have none."""
    chosen: list[NamedMatch] = []
    ambiguous: dict[Pair, str] = {}
    for (a, b), by_keys in found.items():
        matches = list(by_keys.values())
        best = choose(agreeing(trails[a], trails[b], matches)) if matches else Chosen(np.empty(0, np.int64), 0)
        if best.keep.size < MATCHES_LEAST:
            continue
        if best.keep.size < CLEAR * best.rival:
            ambiguous[a, b] = f"{best.keep.size} places agree with each other, {best.rival} others say otherwise"
            continue
        if (a, b) in seen and not any(is_at(trails[a], trails[b], matches[k], seen[a, b]) for k in best.keep):
            ambiguous[a, b] = "the places that agree are not where the robots saw each other"
            continue
        chosen += [(a, b, matches[k]) for k in best.keep]
    return chosen, ambiguous


def others(
    found: Found,
    chosen: Sequence[NamedMatch],
    ambiguous: Collection[Pair],
) -> list[NamedMatch]:
    """Return the matches that are not ``chosen``, between robots that the chosen ones tie, through others too.

    A wrong match may have kept right ones out of its pair's set; and where two robots lie says also what ties them to
    third ones: against that even a single match of the two can be held.
    """
    used = {(a, b, match.i, match.j) for a, b, match in chosen}
    first = groups({name for pair in found for name in pair}, {(a, b) for a, b, _ in chosen})
    return [
        (a, b, match)
        for (a, b), by_keys in found.items()
        for match in by_keys.values()
        if first[a] == first[b] and (a, b) not in ambiguous and (a, b, match.i, match.j) not in used
    ]
