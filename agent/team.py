"""What one robot makes of its team: whose maps it believes, how they lie to each other, and the map they make together.

Maps of teammates come in, pairs of maps to align go out; what comes back becomes an edge of the team graph, or takes
one back.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from mrslam.agent.config import Settings
from mrslam.agent.doubt import contradicts_itself
from mrslam.agent.effects import AlignJob, Effect, Event
from mrslam.agent.pairs import PairBook, PairStatus
from mrslam.alignment import Alignment, Rejection
from mrslam.comms.maps.store import MapStore
from mrslam.merge import TeamMap, TeamMapper
from mrslam.mutual_detection import clear_ghosts
from mrslam.spatial import LocalMap, OccupancyGrid, se2
from mrslam.spatial.se2 import Transform

PLACE_NS = 2_000_000_000
"""How often maps that have changed are held against each other, nanoseconds."""


class Team:
    """The maps known, the alignments believed, and who lies where in the own map's frame."""

    def __init__(
        self, robot_id: str, settings: Settings, store: MapStore, on_lost: Callable[[str], None], *, maps: bool = True
    ) -> None:
        """Start alone; ``on_lost`` is told whose place is known no more.

        A robot that ``maps`` lays teammates' maps into its own; a base station, which has none, into the map of one of
        those that it could put together, and keeps to that one's while it can.
        """
        self.robot_id = robot_id
        self.pairs = PairBook(robot_id, settings.agent)
        self.doubted: dict[str, str] = {}
        """By robot: why its map is not believed to be what it saw."""
        self.T_team_map: dict[str, Transform] = {robot_id: se2.IDENTITY} if maps else {}
        """By robot: maps points of its map into the own map (the frame's), for those whose place is known."""
        self._store, self._on_lost = store, on_lost
        self._mutual_detection = settings.mutual_detection
        self._graph = TeamMapper(anchor=robot_id if maps else None, config=settings.merge, keeps_frame=not maps)
        self._map: TeamMap | None = None
        self._stale = False
        self._placed_ns = 0
        self._contradicted: dict[tuple[str, str], str] = {}

    # -- maps ----------------------------------------------------------------------------------------------------------

    def map_changed(self, robot_id: str) -> None:
        """Take the newest map of a robot from the store."""
        local = self._store.maps[robot_id]
        if robot_id != self.robot_id and self._doubts(robot_id, local):
            return
        if self.pairs.map_changed(robot_id, self._store.version(robot_id), local.map):
            self.displace(robot_id)
        self._graph.set_map(robot_id, local.map, local.map.revision)
        self._map, self._stale = None, True

    def _doubts(self, robot_id: str, local: LocalMap) -> bool:
        """Return whether a teammate's map contradicts itself; what was believed of it before goes, too."""
        reason = contradicts_itself(local)
        if reason is None:
            self.doubted.pop(robot_id, None)
            return False
        self.doubted[robot_id] = reason
        self.pairs.forget(robot_id)
        self.displace(robot_id)
        self._map = None
        return True

    def displace(self, robot_id: str) -> None:
        """Forget at once where a robot's old map lay; where it was the own one, that was everyone's frame."""
        self._graph.remove_map(robot_id)
        lost = self.T_team_map.keys() - {self.robot_id} if robot_id == self.robot_id else {robot_id}
        others = {pair: reason for pair, reason in self._contradicted.items() if robot_id not in pair}
        self._adopt({one: T for one, T in self.T_team_map.items() if one not in lost}, others)
        self._stale = True

    @property
    def frame(self) -> str | None:
        """The robot whose map frame is the team map's; None where there is none yet."""
        return self._graph.frame

    def take_up(self, pairs: Mapping[tuple[str, str], PairStatus], frame: str | None) -> None:
        """Go on with the maps in the store and these alignments of an earlier life."""
        self._graph.frame = frame
        for robot_id, local in sorted(self._store.maps.items()):
            if robot_id != self.robot_id and self._doubts(robot_id, local):
                continue
            self.pairs.map_changed(robot_id, self._store.version(robot_id), local.map)
            self._graph.set_map(robot_id, local.map, local.map.revision)
        for (a, b), status in pairs.items():
            if self.doubted.keys() & {a, b}:
                continue
            self.pairs.pairs[a, b] = status
            if status.alignment is not None:
                self._graph.set_edge(a, b, status.alignment)
        self._map = None
        self._place(0)

    # -- alignments ----------------------------------------------------------------------------------------------------

    def next_alignment(self, now_ns: int) -> AlignJob | None:
        """Return the pair of maps most worth aligning now, or None."""
        return self.pairs.next_job(now_ns, self.T_team_map)

    def on_aligned(self, job: AlignJob, outcome: Alignment | Rejection, now_ns: int) -> list[Effect]:
        """Take the outcome of an alignment; an accepted and stable one becomes an edge of the team graph."""
        verdict = self.pairs.settle(job, outcome, now_ns)
        effects: list[Effect] = [Event(now_ns, "alignment", {"a": job.a, "b": job.b, **verdict.fields()})]
        if verdict.edge is not None:
            self._graph.set_edge(job.a, job.b, verdict.edge)
            if verdict.is_new:
                effects.append(Event(now_ns, "merged", {"a": job.a, "b": job.b, **verdict.fields()}))
            self._map = None
            self._place(now_ns)
        if verdict.status == "revoked":
            effects.append(self._take_back(job.a, job.b, verdict.reason, now_ns))
            self._place(now_ns)
        return effects + self.revoke(now_ns)

    def revoke(self, now_ns: int) -> list[Effect]:
        """Take back the alignments that the maps now contradict."""
        contradicted, self._contradicted = self._contradicted, {}
        return [self._take_back(a, b, reason, now_ns) for (a, b), reason in contradicted.items()]

    def _take_back(self, a: str, b: str, reason: str, now_ns: int) -> Effect:
        self._graph.revoke(a, b, reason)
        self.pairs.revoke(a, b, reason)
        self._map = None
        return Event(now_ns, "unmerged", {"a": a, "b": b, "reason": reason})

    # -- places --------------------------------------------------------------------------------------------------------

    def keep_placed(self, now_ns: int) -> None:
        """Hold maps that have changed against each other, if that was not done just now."""
        if self._stale and now_ns - self._placed_ns >= PLACE_NS:
            self._place(now_ns)

    def _place(self, now_ns: int) -> None:
        """Work out anew where everyone's map lies."""
        self._placed_ns = now_ns
        placement = self._graph.placement()
        self._adopt(placement.T_team_map, placement.dropped)

    def _adopt(self, T_team_map: dict[str, Transform], dropped: dict[tuple[str, str], str]) -> None:
        for lost in self.T_team_map.keys() - T_team_map.keys():
            self._on_lost(lost)
        self.T_team_map, self._contradicted, self._stale = T_team_map, dropped, False

    def map(self) -> TeamMap:
        """Return the team map in the own map's frame, with who is placed where and who is not and why."""
        if self._map is None:
            team = self._graph.team_map()
            self._adopt(team.T_team_map, team.dropped)
            self._map = replace(team, grid=self.without_ghosts(team.grid))
        return self._map

    def without_ghosts(self, grid: OccupancyGrid) -> OccupancyGrid:
        """Free the occupied cells where a robot has been: nobody drives through walls."""
        if not self._mutual_detection.enabled:
            return grid
        maps = self._store.maps
        paths = [
            se2.compose(T_team_map, maps[robot_id].keyframes.T_map_base)[:, :2]
            for robot_id, T_team_map in self.T_team_map.items()
            if robot_id in maps
        ]
        return clear_ghosts(grid, paths, self._mutual_detection.robot_radius_m)[0]
