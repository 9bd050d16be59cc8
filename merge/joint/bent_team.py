"""The last joint solution, as seen from the team frame: one bend a robot, and the matches of each pair."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from mrslam.alignment import StabilityCheck
from mrslam.alignment.stability import SAME_PLACE
from mrslam.merge.graph.edges import Pair
from mrslam.merge.graph.tree import components, path
from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.merge.joint.bend import Bend
from mrslam.merge.joint.join import JointMap
from mrslam.merge.joint.ties import Tie, believed_matches, tied_pairs
from mrslam.merge.joint.trail import Trail
from mrslam.merge.joint.ways import Ways, part_around
from mrslam.spatial import se2
from mrslam.spatial.matching.places import FAR_MOST_M
from mrslam.spatial.se2 import Transform

REFINED = StabilityCheck(max_dx_m=0.1, max_dy_m=0.1, max_dtheta_rad=0.005)
"""Limits within which an alignment found again is the one that a joint solution began with: that matches scans around
it, and comes out the same. Half of the solutions of sixteen robots were begun for less (docs/experiments.md)."""


def is_the_same(used: Transform | None, now: Transform | None) -> bool:
    """Return whether a pair's alignment (or none) is the one that a joint solution began with, to within refinement."""
    if used is now or used is None or now is None:
        return used is now
    return REFINED.is_near(used, now)


@dataclass(frozen=True, kw_only=True, eq=False)
class BentTeam:
    """Corrected keyframes of the robots that are tied to the one whose map frame is the team's."""

    bends: Mapping[str, Bend] = field(default_factory=dict)
    """By robot; empty where no robot is tied to the frame's."""
    ties: tuple[Tie, ...] = ()
    """The mutually consistent matches between robots, with whether the solution believes them."""
    ambiguous: Mapping[Pair, str] = field(default_factory=dict)
    """Pairs whose matches are not used, and why: a rival set is nearly as large, or robots saw each other elsewhere."""
    joined: frozenset[str] = frozenset()
    """The robots that were in the solution, tied or not."""
    T_a_b: Mapping[Pair, Transform] = field(default_factory=dict)
    """The alignments believed when the solution was begun."""
    places: Mapping[Pair, Transform] = field(default_factory=dict)
    """By pair: ``T_a_b (N, 3)`` by each match that the solution believes."""
    stamps_ns: Mapping[str, NDArray[np.int64]] = field(default_factory=dict)
    """By robot: ``(K,)``, stamps of the keyframes of its bend; none where they are not known."""
    ways: Ways | None = None
    """How far along their ways the bent robots are from each other; None where nobody knows."""

    @classmethod
    def of(cls, joint: JointMap, frame: str, trails: Mapping[str, Trail], T_a_b: Mapping[Pair, Transform]) -> BentTeam:
        """Return a joint solution in the map frame of the robot ``frame``."""
        bends: dict[str, Bend] = {}
        if frame in joint.T_team_key:
            group = next(g for g in components(joint.T_team_key, joint.tied_pairs) if frame in g)
            seen = joint.seen_from(frame, trails[frame].T_map_key)
            bends = {name: Bend(trails[name].T_map_key, seen[name]) for name in group if len(group) > 1}
        return cls(
            bends=bends, ties=joint.ties, ambiguous=joint.ambiguous, joined=frozenset(joint.T_team_key), T_a_b=T_a_b,
            stamps_ns={name: trails[name].stamps_ns for name in bends},
            ways=Ways({name: trails[name] for name in bends}, joint.ties), places=_places(joint.ties, trails),
        )  # fmt: skip

    def without(self, robot_id: str) -> BentTeam:
        """Return the same without a robot that was removed; nothing where it is bent: it may have bent the others."""
        if robot_id in self.bends:
            return BentTeam()
        return replace(
            self,
            ties=tuple(tie for tie in self.ties if robot_id not in (tie.a, tie.b)),
            joined=self.joined - {robot_id},
            places={pair: T_a_b for pair, T_a_b in self.places.items() if robot_id not in pair},
        )

    def corrected(self, robot_id: str, trail: Trail) -> BentTeam:
        """Return the same with ``T_map_key`` of a robot's newest map: closed loops may have moved its keyframes.

        A robot that came back from a checkpoint may have others in place of the last ones; these are corrected no more.
        Where nothing moved, it is this very object, so that what was computed for its bends stays valid.
        """
        bend = self.bends.get(robot_id)
        if bend is None:
            return self
        count = min(len(bend.T_map_key), len(trail))
        known, now = self.stamps_ns[robot_id][:count], trail.stamps_ns[:count]
        if known.size == now.size:  # a trail without stamps says nothing
            others = np.flatnonzero(known != now)
            count = int(others[0]) if others.size else count
        if count == 0:
            return self.without(robot_id)
        T_map_key = trail.T_map_key[:count]
        if np.array_equal(T_map_key, bend.T_map_key):
            return self
        T_team_key = bend.T_team_key if count == len(bend.T_team_key) else bend.T_team_key[:count]
        return replace(self, bends={**self.bends, robot_id: Bend(T_map_key, T_team_key)})

    @cached_property
    def met(self) -> frozenset[Pair]:
        """The pairs of bent robots that came as near to each other as keyframes are compared.

        The others saw the same walls from afar at most, and are off by what all that ties them drifted: nothing
        corrected that.
        """
        trees = {name: cKDTree(bend.T_team_key[:, :2]) for name, bend in sorted(self.bends.items())}
        pairs = combinations(trees.items(), 2)
        return frozenset((a, b) for (a, one), (b, two) in pairs if one.count_neighbors(two, FAR_MOST_M))

    @cached_property
    def tied(self) -> frozenset[Pair]:
        """The pairs of robots with a match that is believed; others lie to each other by way of these."""
        return frozenset(tied_pairs(self.ties))

    def lays_by_others(self, a: str, b: str) -> bool:
        """Return whether ties lay two maps by way of others, and not where their own alignment has them."""
        return (a, b) not in self.tied and bool(path(self.tied, a, b))

    def compares(self, a: str, b: str) -> bool:
        """Return whether two maps are compared as they are bent: ties hold both, directly or through others."""
        return {a, b} <= self.bends.keys()

    def rests_on(self, alignments: Collection[Pair]) -> bool:
        """Return whether all alignments of bent robots that ties came of are among these: none was withdrawn since."""
        return all(pair in alignments for pair in self.T_a_b if pair in self.tied and self.compares(*pair))

    def part(self, robot_id: str, other: str, bent: TiledGrid) -> TiledGrid:
        """Return the part of a robot's ``bent`` map that must agree with another's: ties hold it where it is."""
        if self.ways is None:
            return bent
        bend = self.bends[robot_id]
        return part_around(bent, bend, self.ways.held(robot_id, other)[: len(bend.T_team_key)])

    def judges(self, a: str, b: str, alignments: Mapping[Pair, Transform]) -> bool:
        """Return whether the solution included both robots, and covers what is known now of the pair's alignment."""
        return {a, b} <= self.joined and self.covers((a, b), self.T_a_b.get((a, b)), alignments.get((a, b)))

    def covers(self, pair: Pair, used: Transform | None, now: Transform | None) -> bool:
        """Return whether another solution would come to the same though a pair's alignment, ``used`` then, is ``now``.

        Where matches tie a pair, directly or by way of others, its alignment is but the first guess of where they are
        looked for.
        """
        return is_the_same(used, now) or (now is not None and self.follows(pair, now))

    def follows(self, pair: Pair, T_a_b: Transform) -> bool:
        """Return whether matches, also by way of others, have a pair's maps where its alignment ``T_a_b (3,)`` has.

        Then the solutions follow its maps as they are corrected; aligning the two again would say nothing new.
        """
        return self.confirms(pair, T_a_b) or self._lays(pair, T_a_b)

    def _lays(self, pair: Pair, T_a_b: Transform) -> bool:
        """Return whether a pair's maps, as they are bent, lie where ``T_a_b (3,)`` has them."""
        if not self.compares(*pair):
            return False
        a, b = pair
        return SAME_PLACE.is_near(se2.between(self.bends[a].T_rigid, self.bends[b].T_rigid), T_a_b)

    def confirms(self, pair: Pair, T_a_b: Transform) -> bool:
        """Return whether a believed match has a pair's maps where ``T_a_b (3,)`` has them.

        Such a pair need not be aligned again as its maps are corrected: the next solutions start near enough.
        """
        return any(SAME_PLACE.is_near(place, T_a_b) for place in self.places.get(pair, ()))


def _places(ties: Sequence[Tie], trails: Mapping[str, Trail]) -> dict[Pair, Transform]:
    """Return by pair ``T_a_b (N, 3)`` of its believed matches."""
    places: dict[Pair, Transform] = {}
    for (a, b), matches in believed_matches(ties).items():
        T_a_i = trails[a].T_map_key[[match.i for match in matches]]
        T_b_j = trails[b].T_map_key[[match.j for match in matches]]
        T_a_j = se2.compose(T_a_i, np.array([match.T_i_j for match in matches]))
        places[a, b] = se2.compose(T_a_j, se2.inverse(T_b_j))
    return places
