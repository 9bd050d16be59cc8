"""Several robots' keyframes as one pose graph: places that two of them saw tie them together, and bend their maps.

Whole-map alignment gives the first guess; keyframes that may have seen the same place are matched locally; of the
matches the largest consistent set is taken, and a robust solve rejects what still does not fit. Each solve brings more
keyframes within reach of a comparison; it ends when a round finds no new match, after one that looks farther where
robots stay untied, and is done once more from there.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import NamedTuple

import numpy as np

from mrslam.merge.graph.edges import Pair
from mrslam.merge.graph.tree import components, path
from mrslam.merge.joint.candidates import candidates
from mrslam.merge.joint.consistent import Chosen, KeyMatch, agreeing, choose, is_at
from mrslam.merge.joint.local_match import FIRST_LOST_M, LocalMatcher
from mrslam.merge.joint.trail import Trail, rigid
from mrslam.spatial import se2
from mrslam.spatial.pose_graph import Edges, relax_again, relax_graduated
from mrslam.spatial.se2 import Transform

ROUNDS = 6
"""Most rounds of comparing and solving: bounds the time; each extends the matches as far as drift allows."""
PASSES = 2
"""Times that all of it is done: the second compares from where the first ended, so that what is found hardly depends on
the first guess. Measured: two robots with the same maps and alignments 0.1 m apart, 0.039 and 0.047 m from the truth
after one pass, both 0.039 m after two and after three."""
CHI2_MOST = 16.27
"""Largest squared Mahalanobis residual of a believed match: 99.9 % of chi2 with 3 degrees of freedom."""
MATCHES_LEAST = 3
"""Least matches that agree for a pair to be tied: two agree by chance where a corridor repeats itself."""
WIDE_LOST_M = 80.0
"""``lost_m`` before any match is believed where robots stay untied with ``FIRST_LOST_M``, metres: large maps that were
aligned before a loop bent one of them are metres off elsewhere. Measured: two robots on 1.9 km of a campus whose maps
lie 2 m and 1 degree off, 3 or 0 places matched -> 30; with half of it 12."""
CLEAR = 1.25
"""Least ratio of the consistent matches to the largest rival set; below, the pair is ambiguous and not tied."""


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


@dataclass(frozen=True, kw_only=True, eq=False)
class JointMap:
    """Several robots' keyframes, corrected by the matches between them."""

    T_team_key: Mapping[str, Transform]
    """By robot, in order: ``(K, 3)`` in the frame of :func:`join`'s ``T_team_map``."""
    ties: tuple[Tie, ...] = ()
    """The matches that went into the last solve: each pair's largest consistent set, none of ambiguous pairs, and
    others that turned out to agree with it."""
    ambiguous: Mapping[Pair, str] = field(default_factory=dict)
    """Pairs whose matches are not used, and why: a rival set is nearly as large, or robots saw each other elsewhere."""

    def seen_from(self, robot_id: str, T_map_key: Transform) -> dict[str, Transform]:
        """Return all keyframes in the map frame of one robot, whose own are at ``T_map_key (K, 3)`` in its map.

        The frames are laid over each other by all of them: a single keyframe's heading would turn what is far away.
        """
        T_own_team = rigid(T_map_key, self.T_team_key[robot_id])
        return {one: se2.compose(T_own_team, T_team_key) for one, T_team_key in self.T_team_key.items()}

    @property
    def tied_pairs(self) -> set[Pair]:
        """The pairs with a match that is believed."""
        return _tied_pairs(self.ties)

    def tied(self, a: str, b: str) -> int:
        """Return the number of believed matches between two robots."""
        return sum(tie.believed and {tie.a, tie.b} == {a, b} for tie in self.ties)


def join(
    trails: Mapping[str, Trail],
    T_team_map: Mapping[str, Transform],
    matcher: LocalMatcher | None = None,
    seen: Mapping[Pair, Transform] | None = None,
) -> JointMap:
    """Return all robots' keyframes as they fit together best; the same input gives the same bytes.

    ``T_team_map`` : ``(3,)`` by robot, the rigid placement that alignment found; robots without one are left out. The
    first robot's first keyframe stays where it is by this.
    ``matcher`` : pass the same one again to reuse the matches it has computed before.
    ``seen`` : ``T_a_b (3,)`` by pair, a < b, of robots that saw each other: what others' matches say yields to it.
    """
    seen = seen or {}
    names = [name for name in sorted(trails) if name in T_team_map and len(trails[name])]
    matcher = matcher or LocalMatcher()
    poses = {name: se2.compose(T_team_map[name], trails[name].T_map_key) for name in names}
    ties: tuple[Tie, ...] = ()
    ambiguous: dict[Pair, str] = {}
    for _ in range(PASSES):
        found: dict[Pair, dict[tuple[int, int], KeyMatch]] = {pair: {} for pair in combinations(names, 2)}
        lost_m = FIRST_LOST_M
        for _ in range(ROUNDS):
            if not sum(_compare(trails, poses, pair, found[pair], ties, matcher, lost_m) for pair in found):
                if lost_m == WIDE_LOST_M or len(components(names, _tied_pairs(ties))) == 1:
                    break
                lost_m = WIDE_LOST_M
                continue
            poses, ties, ambiguous = _solve_believable({name: trails[name] for name in names}, poses, found, seen)
    return JointMap(T_team_key=poses, ties=ties, ambiguous=ambiguous)


def _compare(
    trails: Mapping[str, Trail],
    poses: Mapping[str, Transform],
    pair: Pair,
    found: dict[tuple[int, int], KeyMatch],
    ties: Sequence[Tie],
    matcher: LocalMatcher,
    first_lost_m: float,
) -> int:
    """Match keyframes of two robots that may have seen the same place; add to ``found``, return the number added.

    ``first_lost_m`` : path over which their poses may have drifted where no match is believed yet, metres.
    """
    a, b = (trails[name] for name in pair)
    believed = [tie.match for tie in ties if tie.believed and (tie.a, tie.b) == pair]
    before = len(found)
    for near in candidates((a, b), (poses[pair[0]], poses[pair[1]]), found, believed, first_lost_m):
        fit = matcher.match(a, near.i, b, near.j, near.T_i_j, near.lost_m)
        if fit is not None:
            found[near.i, near.j] = KeyMatch(near.i, near.j, fit.T_i_j, fit.information)
    return len(found) - before


def _solve_believable(
    trails: Mapping[str, Trail], poses: Mapping[str, Transform], found: Found, seen: Mapping[Pair, Transform]
) -> tuple[dict[str, Transform], tuple[Tie, ...], dict[Pair, str]]:
    """Return what :func:`solve` does with the matches that are believable, and why other pairs' are not used.

    Of rooms that look alike two pairs may agree on wrong places by more matches than a third pair has at the right one.
    Where that is of robots that saw each other, the others' smallest set is left out, until it is not outvoted.
    """
    chosen, unused = believable(trails, found, seen)
    while True:
        solved, ties = solve(trails, poses, chosen, others(found, chosen, unused))
        rival = _outvoting(ties[: len(chosen)], seen)
        if rival is None:
            return solved, ties, unused
        unused[rival] = "its places would put robots that saw each other elsewhere"
        chosen = [one for one in chosen if one[:2] != rival]


def _outvoting(ties: Sequence[Tie], seen: Collection[Pair]) -> Pair | None:
    """Return the pair with the fewest matches of those that put robots elsewhere than they saw each other, or None."""
    counts = Counter((tie.a, tie.b) for tie in ties)
    believed = Counter((tie.a, tie.b) for tie in ties if tie.believed)
    for pair in sorted(seen):
        if 2 * believed[pair] < counts[pair]:
            between = path(counts.keys() - {pair}, *pair)
            if rest := [other for other in between if other not in seen]:
                return min(rest, key=lambda other: (counts[other], other))
    return None


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
    first = _groups({name for pair in found for name in pair}, {(a, b) for a, b, _ in chosen})
    return [
        (a, b, match)
        for (a, b), by_keys in found.items()
        for match in by_keys.values()
        if first[a] == first[b] and (a, b) not in ambiguous and (a, b, match.i, match.j) not in used
    ]


def _tied_pairs(ties: Sequence[Tie]) -> set[Pair]:
    return {(tie.a, tie.b) for tie in ties if tie.believed}


def _groups(names: Collection[str], pairs: Collection[Pair]) -> dict[str, str]:
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
    first = _groups(trails, _tied_pairs(ties) & {(a, b) for a, b, _ in matches})
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
