"""Where each map lies in the team frame: computed anew where alignments, maps or joint solutions ask for it."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from mrslam.agent.known_map import KnownMap
from mrslam.alignment import Alignment
from mrslam.merge import Bend, BentTeam, MergeConfig, Pair, Placement, TeamMap, TeamMapper
from mrslam.merge.elsewhere import Elsewhere
from mrslam.merge.joint.ties import Tie
from mrslam.spatial import Keyframes, se2
from mrslam.spatial.se2 import Transform

PLACE_NS, PLACE_OWN_NS = 2_000_000_000, 10_000_000_000
"""Least time between two placements for changed maps alone, nanoseconds: as ``agent.publish_interval_s`` by default;
and where only the own map has grown: that can but show that it contradicts another by now."""


class Layout:
    """The last placement of the maps known, how they are bent to fit, and what of it is old."""

    def __init__(self, robot_id: str, maps: Mapping[str, KnownMap], config: MergeConfig, *, has_own_map: bool) -> None:
        """Start without a map.

        ``maps`` : by robot: its newest map; read at every placement, so that it is to be kept up to date.
        ``has_own_map`` : whether the own map's frame is the team frame. Without, as a base station is, that is the map
        frame of one robot of the largest component, the same one as long as that is possible.
        """
        self.robot_id, self._maps = robot_id, maps
        anchor = robot_id if has_own_map else None
        self._mapper = TeamMapper(anchor=anchor, config=config, keeps_frame=not has_own_map)
        self.placement = Placement(T_team_map={robot_id: se2.IDENTITY} if has_own_map else {})
        self._placed_ns = 0
        self._newer: set[str] = set()
        """Robots whose maps changed since the last placement."""
        self._is_old = False
        self._is_wrong = False
        """Whether it is old for more than that the own map has grown."""

    # -- what changes it -----------------------------------------------------------------------------------------------

    def renew(self, robot_id: str) -> None:
        """Note that a robot's map is a newer one; what corrections it brings to a bent map count at once."""
        self._newer.add(robot_id)
        self._is_old = True
        bent = self._mapper.bent.corrected(robot_id, self._maps[robot_id].trail)
        self._is_wrong |= bent is not self._mapper.bent or robot_id != self.robot_id
        self._mapper.bent = bent

    def displace(self, robot_id: str) -> None:
        """Remove a robot's map and place at once; of the own robot, all places: its map frame was the team frame."""
        self._mapper.remove_map(robot_id)
        self._newer.discard(robot_id)
        if robot_id == self.robot_id:
            self.placement = Placement(anchor=self.placement.anchor, T_team_map={robot_id: se2.IDENTITY})
        else:
            self.placement = self.placement.without(robot_id)
        self._is_old = self._is_wrong = True

    def bend(self, bent: BentTeam) -> None:
        """Draw maps bent from now on, and compare them bent for contradictions."""
        for name, known in self._maps.items():
            bent = bent.corrected(name, known.trail)
        self._mapper.bent = bent

    def restore(self, robots: list[str], frame: str | None) -> None:
        """Continue with the maps of these robots in the team frame of a checkpoint."""
        self._mapper.frame = frame
        self._newer.update(robots)

    def place(self, alignments: Mapping[Pair, Alignment], now_ns: int) -> None:
        """Compute where every map lies by the alignments believed now."""
        self._placed_ns = now_ns
        self._use_newer()
        self._adopt(self._mapper.placement(alignments))

    def is_due(self, now_ns: int) -> bool:
        """Return whether places are to be computed for changed maps: every ``PLACE_NS``, or ``PLACE_OWN_NS``."""
        return self._is_old and now_ns - self._placed_ns >= (PLACE_NS if self._is_wrong else PLACE_OWN_NS)

    def draw(self, alignments: Mapping[Pair, Alignment]) -> TeamMap:
        """Return the team map by the alignments believed now; its places are the ones of the layout from now on."""
        self._use_newer()
        team = self._mapper.team_map(alignments)
        self._adopt(team)
        return team

    def place_and_measure(self, alignments: Mapping[Pair, Alignment]) -> float:
        """Return the known area of the team map, square metres; its places are the ones of the layout from now on."""
        self._use_newer()
        placement, area_m2 = self._mapper.team_area(alignments)
        self._adopt(placement)
        return area_m2

    def elsewhere(self, others: Collection[str], alignments: Mapping[Pair, Alignment]) -> Elsewhere:
        """Return what the maps of ``others`` show of the floor that the own map, which is placed, lies on."""
        self._use_newer()
        return self._mapper.elsewhere(self.robot_id, others, alignments)

    def _adopt(self, placement: Placement) -> None:
        self.placement, self._is_old, self._is_wrong = placement, False, False

    def _use_newer(self) -> None:
        """Hand maps that changed since the last placement to the mapper."""
        for robot_id in sorted(self._newer):
            known = self._maps[robot_id]
            self._mapper.set_map(robot_id, known, known.trail)
        self._newer.clear()

    # -- where maps and robots are -------------------------------------------------------------------------------------

    @property
    def T_team_map(self) -> dict[str, Transform]:
        """By robot: maps points of its map into the team frame (:attr:`frame`), for those that are placed.

        Of a bent map it is right at the newest keyframe of the joint solution.
        """
        return self.placement.T_team_map

    @property
    def frame(self) -> str | None:
        """The robot whose map frame is the team map's; None where there is none yet."""
        return self._mapper.frame

    @property
    def bends(self) -> Mapping[str, Bend]:
        """By robot: how its map is bent to fit the others, in the team frame; empty where no matches tie them."""
        return self.placement.bends

    @property
    def bent(self) -> BentTeam:
        """The last joint solution."""
        return self._mapper.bent

    @property
    def ties(self) -> tuple[Tie, ...]:
        """Matches between robots that went into the last joint solution."""
        return self._mapper.bent.ties

    def ties_m(self, T_team_map: Mapping[str, Transform]) -> list[NDArray[np.float64]]:
        """Return the positions ``(2, 2)``, metres, of each believed tie's two keyframes with maps at ``T_team_map``."""
        keys = {
            name: se2.compose(T, self._maps[name].trail.T_map_key)
            for name, T in T_team_map.items()
            if name in self._maps
        }
        return [
            np.stack([keys[tie.a][tie.match.i, :2], keys[tie.b][tie.match.j, :2]])
            for tie in self.ties
            if tie.believed and {tie.a, tie.b} <= keys.keys()
            if self._still_has(tie.a, tie.match.i) and self._still_has(tie.b, tie.match.j)
        ]

    def _still_has(self, robot_id: str, key: int) -> bool:
        """Return whether a map still has a keyframe that was joined: a robot may come back from an older checkpoint."""
        bend = self._mapper.bent.bends.get(robot_id)
        kept = len(self._maps[robot_id].trail)
        return key < (kept if bend is None else min(kept, len(bend.T_map_key)))

    def keyframes(self) -> dict[str, Keyframes]:
        """Return the keyframes of every placed robot in the team frame, corrected where its map is bent."""
        out = {}
        for robot_id, T_team_map in self.T_team_map.items():
            if robot_id in self._maps:
                own, bend = self._maps[robot_id].local.keyframes, self.bends.get(robot_id)
                poses = se2.compose(T_team_map, own.T_map_base) if bend is None else bend.extended(own.T_map_base)
                out[robot_id] = Keyframes(own.stamps_ns, poses)
        return out

    @property
    def T_team_own(self) -> Transform:
        """``(3,)``: maps points of the own map into the team frame; of a bent map, right near the robot only."""
        bend = self.bends.get(self.robot_id)
        return se2.IDENTITY if bend is None else bend.T_team_map_now

    def T_own_map(self, robot_id: str) -> Transform | None:
        """Return ``(3,)``, from a robot's map to the own map, None where it is not placed.

        Where maps are bent it is right near the two robots only.
        """
        if robot_id == self.robot_id:
            return se2.IDENTITY
        T_team_map = self.T_team_map.get(robot_id)
        return None if T_team_map is None else se2.compose(se2.inverse(self.T_team_own), T_team_map)

    def T_between(self, a: str, b: str) -> Transform | None:
        """Return ``T_a_b (3,)`` between the maps of two robots that are placed, None where one is not.

        Where maps are bent it is right near the two robots only.
        """
        T_own_a, T_own_b = self.T_own_map(a), self.T_own_map(b)
        return None if T_own_a is None or T_own_b is None else se2.between(T_own_a, T_own_b)
