"""Several robots' keyframes as one pose graph: places that two of them saw tie them together, and bend their maps.

Whole-map alignment gives the first guess; keyframes that may have seen the same place are matched locally; of the
matches the largest consistent set is taken, and a robust solve rejects what still does not fit. Each solve brings more
keyframes within reach of a comparison; it ends when a round finds no new match, after one that looks farther where
robots stay untied, and is done once more from there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

from mrslam.merge.graph.edges import Pair
from mrslam.merge.graph.tree import components
from mrslam.merge.joint.believable import solve_believable
from mrslam.merge.joint.candidates import candidates
from mrslam.merge.joint.consistent import KeyMatch
from mrslam.merge.joint.local_match import FIRST_LOST_M, LocalMatcher
from mrslam.merge.joint.ties import Tie, believed_matches, tied_pairs
from mrslam.merge.joint.trail import Core, Trail, rigid
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

ROUNDS = 6
"""Most rounds of comparing and solving: bounds the time; each extends the matches as far as drift allows."""
PASSES = 2
"""Times that all of it is done: the second compares from where the first ended, so that what is found hardly depends on
the first guess. Measured: two robots with the same maps and alignments 0.1 m apart, 0.039 and 0.047 m from the truth
after one pass, both 0.039 m after two and after three."""
WIDE_LOST_M = 80.0
"""``lost_m`` before any match is believed where robots stay untied with ``FIRST_LOST_M``, metres: large maps that were
aligned before a loop bent one of them are metres off elsewhere. Measured: two robots on 1.9 km of a campus whose maps
lie 2 m and 1 degree off, 3 or 0 places matched -> 30; with half of it 12."""


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
        return tied_pairs(self.ties)

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
    cores = {name: trails[name].core for name in names}
    whole, trails = trails, {name: core.trail for name, core in cores.items()}
    matcher = matcher or LocalMatcher()
    poses = {name: se2.compose(T_team_map[name], trails[name].T_map_key) for name in names}
    ties: tuple[Tie, ...] = ()
    ambiguous: dict[Pair, str] = {}
    for _ in range(PASSES):
        found: dict[Pair, dict[tuple[int, int], KeyMatch]] = {pair: {} for pair in combinations(names, 2)}
        lost_m = FIRST_LOST_M
        for _ in range(ROUNDS):
            believed = believed_matches(ties)
            if not sum(
                _compare(trails, poses, pair, found[pair], believed.get(pair, []), matcher, lost_m) for pair in found
            ):
                if lost_m == WIDE_LOST_M or len(components(names, tied_pairs(ties))) == 1:
                    break
                lost_m = WIDE_LOST_M
                continue
            poses, ties, ambiguous = solve_believable(trails, poses, found, seen)
    return JointMap(
        T_team_key={name: core.spread(whole[name], poses[name]) for name, core in cores.items()},
        ties=tuple(_of_whole(tie, cores) for tie in ties), ambiguous=ambiguous,
    )  # fmt: skip


def _of_whole(tie: Tie, cores: Mapping[str, Core]) -> Tie:
    """Return a tie between keyframes of two cores as one between the same keyframes of the whole trails."""
    i, j = cores[tie.a].keys[tie.match.i], cores[tie.b].keys[tie.match.j]
    return tie._replace(match=tie.match._replace(i=int(i), j=int(j)))


def _compare(
    trails: Mapping[str, Trail],
    poses: Mapping[str, Transform],
    pair: Pair,
    found: dict[tuple[int, int], KeyMatch],
    believed: Sequence[KeyMatch],
    matcher: LocalMatcher,
    first_lost_m: float,
) -> int:
    """Match keyframes of two robots that may have seen the same place; add to ``found``, return the number added.

    ``believed`` : those that the last solution believes. ``first_lost_m`` : path over which their poses may have
    drifted where there are none yet, metres.
    """
    a, b = (trails[name] for name in pair)
    before = len(found)
    for near in candidates((a, b), (poses[pair[0]], poses[pair[1]]), found, believed, first_lost_m):
        fit = matcher.match(a, near.i, b, near.j, near.T_i_j, near.lost_m)
        if fit is not None:
            found[near.i, near.j] = KeyMatch(near.i, near.j, fit.T_i_j, fit.information)
    return len(found) - before
