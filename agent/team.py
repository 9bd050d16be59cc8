"""One robot's knowledge of its team: everyone's newest map, and a belief about each pair of maps.

Maps come in (:meth:`Team.take_map`), jobs go out (:meth:`Team.next_job`) and come back done. An accepted alignment
becomes an edge of the team graph; one that the graph drops, or that a later alignment refutes, is withdrawn.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mrslam.agent.config import Settings
from mrslam.agent.effects import AlignJob, Effect, Event, Job, JoinJob, joined_fields
from mrslam.agent.joining import Joining
from mrslam.agent.known_map import KnownMap
from mrslam.agent.layout import Layout
from mrslam.agent.map_check import contradicts_itself
from mrslam.agent.pairs.belief import PairBelief, Verdict
from mrslam.agent.pairs.hints import Hints
from mrslam.agent.pairs.loops import loops_of
from mrslam.agent.pairs.others import is_predicted, tied_enough
from mrslam.agent.pairs.repeats import too_little, unless_repeated
from mrslam.agent.pairs.schedule import Schedule
from mrslam.agent.pairs.sighted import sighted_job
from mrslam.agent.pairs.through import unless_refuted
from mrslam.alignment import Alignment, Rejection
from mrslam.comms import is_saved
from mrslam.merge import BentTeam, JointMap, Pair, TeamMap
from mrslam.merge.elsewhere import Elsewhere
from mrslam.merge.graph.consistency import SEEN_CONFIDENCE
from mrslam.merge.graph.edges import inverse_covariance, pair_of
from mrslam.mutual_detection import clear_ghosts
from mrslam.spatial import OccupancyGrid
from mrslam.spatial.se2 import Transform


class Team:
    """The maps known, and what is believed of each pair of them; who lies where by that is its layout."""

    def __init__(self, robot_id: str, settings: Settings, *, has_own_map: bool = True) -> None:
        """Start without any map.

        A robot that ``has_own_map`` is the anchor: its map frame is the team frame. A base station has none; its team
        frame is the map frame of one robot of the largest component, the same one as long as that is possible.
        """
        self.robot_id = robot_id
        self.maps: dict[str, KnownMap] = {}
        """By robot: its newest map, without those that contradict themselves (:attr:`doubted`)."""
        self.doubted: dict[str, str] = {}
        """By robot: why its newest map is refused (:func:`contradicts_itself`)."""
        self.saved: set[str] = set()
        """Those of :attr:`maps` that were saved before: none grows, and nobody drives in them."""
        self.beliefs: dict[Pair, PairBelief] = {}
        """By pair of the robots in :attr:`maps`, (a, b) with a < b; the only place where alignments are kept."""
        self.hints = Hints(robot_id)
        """What teammates told of where they found maps, and what to tell them."""
        self.schedule, self._joining = Schedule(robot_id, settings.agent), Joining()
        self._mutual_detection = settings.mutual_detection
        self.layout = Layout(robot_id, self.maps, settings.merge, has_own_map=has_own_map)
        """Where each map lies."""
        self._is_own_frame_new = False
        """Whether the own map was given up, and the next one published has another frame."""
        self._map: TeamMap | None = None

    # -- maps ----------------------------------------------------------------------------------------------------------

    def take_map(self, robot_id: str, known: KnownMap) -> None:
        """Take the newest map of a robot; one of a new epoch replaces map, place and beliefs of the old one."""
        held = self.maps.get(robot_id)
        if self._doubts(robot_id, known, held):
            return
        self._know(robot_id, known)
        if self._is_begun_anew(robot_id, held, known):
            self._begin_pairs(robot_id)
            self.displace(robot_id)
        if robot_id == self.robot_id:
            self._is_own_frame_new = False
        self._map = None
        self.layout.renew(robot_id)

    def take_saved_map(self, map_id: str, known: KnownMap, near: Sequence[float] | None = None) -> None:
        """Take a map that was saved before, as that of a teammate that does not move.

        ``near`` : where the own map begins in it, if somebody knows: (x, y) or (x, y, theta), metres and radians.
        """
        if near is not None:
            self.schedule.starts.expect(map_id, near)
        self.take_map(map_id, known)
        (self.saved.add if map_id in self.maps else self.saved.discard)(map_id)

    def _know(self, robot_id: str, known: KnownMap) -> None:
        self.maps[robot_id] = known
        for other in sorted(self.maps.keys() - {robot_id}):
            self.beliefs.setdefault(pair_of(robot_id, other), PairBelief())

    def _is_begun_anew(self, robot_id: str, held: KnownMap | None, known: KnownMap) -> bool:
        """Return whether a map is in another frame than the robot's map before it."""
        if held is None:
            return robot_id == self.robot_id and self._is_own_frame_new
        return held.epoch != known.epoch and not self._is_relabelled(robot_id, held, known)

    def _is_relabelled(self, robot_id: str, held: KnownMap, known: KnownMap) -> bool:
        """Return whether the own map goes on under another epoch, above what teammates hold of an earlier life.

        Its frame is the same, so its alignments hold. Of a teammate's map nobody can know that.
        """
        before, now = held.local.map, known.local.map
        goes_on = before.resolution_m == now.resolution_m and before.revision <= now.revision
        return robot_id == self.robot_id and goes_on and not self._is_own_frame_new

    def _begin_pairs(self, robot_id: str) -> None:
        """Reset the beliefs of a robot's pairs, for its new map has another frame."""
        self.schedule.starts.forget(robot_id)
        self.hints.forget(robot_id)
        for pair in self.beliefs:
            if robot_id in pair:
                self.beliefs[pair] = PairBelief(reason=f"{robot_id} started a new map")

    def _doubts(self, robot_id: str, known: KnownMap, held: KnownMap | None) -> bool:
        """Return whether a teammate's map contradicts itself; if so, note why, and drop its map, place and beliefs.

        ``held`` : the state of it that is known.
        """
        before = held.local if held is not None and held.epoch == known.epoch else None
        reason = contradicts_itself(known.local, before) if robot_id != self.robot_id else None
        if reason is None:
            self.doubted.pop(robot_id, None)
            return False
        self.doubted[robot_id] = reason
        self._forget(robot_id)
        return True

    def begin_own_map(self) -> None:
        """Forget the own map, its place, and what was believed of it: the next one has another frame."""
        self.schedule.starts.forget(self.robot_id)
        self.hints.forget(self.robot_id)
        self._forget(self.robot_id)

    def _forget(self, robot_id: str) -> None:
        self.maps.pop(robot_id, None)
        self.beliefs = {pair: belief for pair, belief in self.beliefs.items() if robot_id not in pair}
        self.displace(robot_id)

    def displace(self, robot_id: str) -> None:
        """Remove a robot's map and place at once; of the own robot, all places: its map frame was the team frame."""
        self._is_own_frame_new |= robot_id == self.robot_id
        self.layout.displace(robot_id)
        self._map = None

    def restore(self, maps: Mapping[str, KnownMap], beliefs: Mapping[Pair, PairBelief], frame: str | None) -> None:
        """Continue with the maps, beliefs and frame of a checkpoint, beside the saved maps that were taken before."""
        kept = [robot_id for robot_id, known in sorted(maps.items()) if not self._doubts(robot_id, known, None)]
        for robot_id in kept:
            self._know(robot_id, maps[robot_id])
        self.saved.update(filter(is_saved, kept))
        self.layout.restore(kept, frame)
        self.beliefs |= {pair: belief for pair, belief in beliefs.items() if set(pair) <= self.maps.keys()}
        self._map = None
        self._place(0)

    # -- jobs ----------------------------------------------------------------------------------------------------------

    def next_job(self, now_ns: int, searching: Collection[str] = ()) -> Job | None:
        """Return a joint solution to compute where alignments changed or maps grew, else a pair to align, or None.

        ``searching`` : teammates in sight that search for the pairs of their own maps, and tell what they find.
        """
        alignments = self._alignments()
        T_a_b = {pair: found.T_a_b for pair, found in alignments.items()}
        seen = [pair for pair, found in alignments.items() if found.confidence >= SEEN_CONFIDENCE]
        bent = self.layout.bent
        return (
            self._joining.next_job(self.layout.placement, bent, self.maps, T_a_b, seen, now_ns)
            or self._sighted_job(now_ns)
            or self._hinted_job(now_ns)
            or self.schedule.next_job(
                self.beliefs,
                self.maps,
                self.layout.T_team_map,
                [pair for pair, found in T_a_b.items() if bent.follows(pair, found)],
                lambda pair, belief: self.hints.is_awaited(pair, belief, searching, now_ns),
                now_ns,
            )
        )

    def _sighted_job(self, now_ns: int) -> AlignJob | None:
        T_team_map = self.layout.T_team_map
        tied = tied_enough(self.robot_id, self.beliefs, T_team_map)

        def is_known(pair: Pair, T_a_b: Transform) -> bool:
            return tied.issuperset(pair) and is_predicted(pair, T_a_b, T_team_map)

        return sighted_job(self.beliefs, self.maps, is_known, self.schedule.config.align_interval_s, now_ns)

    def _hinted_job(self, now_ns: int) -> AlignJob | None:
        return self.hints.next_job(self.beliefs, self.maps, self.layout.T_team_map, self.schedule.config, now_ns)

    def on_aligned(self, job: AlignJob, outcome: Alignment | Rejection, now_ns: int) -> list[Effect]:
        """Take the result of an alignment; the pair's belief decides whether it becomes an edge of the team graph."""
        verdict = self._settle(job, outcome, now_ns)
        fields = {"a": job.a, "b": job.b, **verdict.fields()}
        effects: list[Effect] = [Event(now_ns, "alignment", fields)]
        if verdict.is_new:
            effects.append(Event(now_ns, "merged", fields))
        if verdict.status == "revoked":
            effects.append(Event(now_ns, "unmerged", {"a": job.a, "b": job.b, "reason": verdict.reason}))
        if verdict.status in ("accepted", "revoked"):
            self._map = None
            self._place(now_ns)
        for pair, reason in too_little(self.beliefs):
            effects += self.unmerge(pair, reason, now_ns)
        return effects + self.revoke(now_ns)

    def on_joined(self, job: JoinJob, joint: JointMap, now_ns: int) -> list[Effect]:
        """Take a joint solution: from now on maps are drawn bent, and compared bent for contradictions."""
        current = {name: one.epoch for name, one in self.maps.items()}
        if any(current.get(name) != epoch for name, epoch in job.epochs.items()):
            return []  # a map was started anew while this was computed
        self.layout.bend(BentTeam.of(joint, job.frame, job.trails, job.T_a_b))
        self._map = None
        self._place(now_ns)
        return [Event(now_ns, "joined", joined_fields(self.layout.bent)), *self.revoke(now_ns)]

    def _settle(self, job: AlignJob, outcome: Alignment | Rejection, now_ns: int) -> Verdict:
        for robot_id, version in zip((job.a, job.b), job.versions, strict=True):
            if robot_id not in self.maps or self.maps[robot_id].epoch != version[0]:
                return Verdict("rejected", "a map was started anew while this was computed", outcome)
        self.hints.on_done(job, outcome)
        if job.hinted_by is not None and isinstance(outcome, Rejection):
            return Verdict("rejected", f"not where {job.hinted_by} has it: {outcome.reason}", outcome)
        pair = (job.a, job.b)
        self.beliefs[pair].note(outcome, now_ns)

        def unless(found: Alignment | Rejection) -> Alignment | Rejection:
            return unless_repeated(pair, unless_refuted(pair, found, self.beliefs), self.beliefs)

        is_bent, loops = self.layout.bent.compares(*pair), loops_of(pair, self.beliefs)
        return self.beliefs[pair].settle(job, outcome, now_ns, loops, unless, is_bent=is_bent)

    def unmerge(self, pair: Pair, reason: str, now_ns: int) -> list[Effect]:
        """Withdraw a pair's alignment, which robots have seen to be wrong."""
        self.beliefs[pair].revoke(reason)
        self._map = None
        self._place(now_ns)
        a, b = pair
        return [Event(now_ns, "unmerged", {"a": a, "b": b, "reason": reason}), *self.revoke(now_ns)]

    def revoke(self, now_ns: int) -> list[Effect]:
        """Withdraw alignments that the last placement dropped: loops that fail to close, walls on free space."""
        effects: list[Effect] = []
        for (a, b), reason in self.layout.placement.dropped.items():
            belief = self.beliefs.get((a, b))
            if belief is not None and belief.alignment is not None:
                belief.revoke(reason)
                self._map = None
                effects.append(Event(now_ns, "unmerged", {"a": a, "b": b, "reason": reason}))
        return effects

    # -- places --------------------------------------------------------------------------------------------------------

    def covariance_of(self, robot_id: str) -> NDArray[np.float64] | None:
        """Return the covariance ``(3, 3)`` of the transform from a robot's map to the own one, by their alignment.

        None where the two are not aligned with each other: the robot is placed through others, or not at all.
        """
        belief = self.beliefs.get(pair_of(self.robot_id, robot_id))
        found = None if belief is None else belief.alignment
        if found is None:
            return None
        return found.covariance if self.robot_id < robot_id else inverse_covariance(found.T_a_b, found.covariance)

    def keep_placed(self, now_ns: int) -> None:
        """Compute places again where maps have changed, when it is time to."""
        if self.layout.is_due(now_ns):
            self._place(now_ns)

    def _place(self, now_ns: int) -> None:
        self.layout.place(self._alignments(), now_ns)

    def _alignments(self) -> dict[Pair, Alignment]:
        return {pair: found for pair, belief in self.beliefs.items() if (found := belief.weighed_alignment) is not None}

    def map(self) -> TeamMap:
        """Return the team map in the team frame, with the places of maps, and why the others have none."""
        if self._map is None:
            team = self.layout.draw(self._alignments())
            unplaced = {robot_id: self._why(robot_id, reason) for robot_id, reason in team.unplaced.items()}
            self._map = replace(team, grid=self.without_ghosts(team.grid), unplaced=unplaced)
        return self._map

    def known_area_m2(self) -> float:
        """Return the known area of the team map, square metres."""
        if self._map is not None:
            return self._map.grid.known_area_m2()
        return self.layout.place_and_measure(self._alignments())

    @property
    def unplaced(self) -> list[str]:
        """Whose maps have no place, and which saved ones: those that are refused, too (:attr:`doubted`)."""
        return sorted((self.maps.keys() | self.doubted.keys()) - self.layout.T_team_map.keys())

    def elsewhere(self) -> Elsewhere:
        """Return what teammates' maps show of the floor that the own map lies on; not what was saved before."""
        return self.layout.elsewhere(self.maps.keys() - self.saved - {self.robot_id}, self._alignments())

    def _why(self, robot_id: str, reason: str) -> str:
        """Return why a robot is not placed, with its withdrawn alignments."""
        revoked = [
            f"{a}-{b}: {belief.reason}"
            for (a, b), belief in sorted(self.beliefs.items())
            if robot_id in (a, b) and belief.status == "revoked"
        ]
        return f"{reason} ({'; '.join(revoked)})" if revoked else reason

    def without_ghosts(self, grid: OccupancyGrid, *, of_own_map: bool = False) -> OccupancyGrid:
        """Return a grid with occupied cells freed where robots have been, for none drives through walls.

        ``of_own_map`` : the grid lies in the own map's frame, not in the team's, of which it may be bent. Where a robot
        drove when a map was saved, a wall may stand now.
        """
        if not self._mutual_detection.enabled:
            return grid
        paths = [keys.T_map_base[:, :2] for name, keys in self.layout.keyframes().items() if name not in self.saved]
        if of_own_map and (bend := self.layout.bends.get(self.robot_id)) is not None:
            paths = [bend.unbent(path) for path in paths]
        return clear_ghosts(grid, paths, self._mutual_detection.robot_radius_m)[0]
