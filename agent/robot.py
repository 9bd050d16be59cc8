"""The parts of one robot, and what others read of them: maps, poses, trajectories."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mrslam.agent.blindness import Blindness
from mrslam.agent.chosen_frame import ChosenFrame
from mrslam.agent.config import Settings
from mrslam.agent.known_map import KnownMap
from mrslam.agent.link_stats import LinkStats
from mrslam.agent.news import News
from mrslam.agent.reports import KnowledgeReports
from mrslam.agent.saved_maps import SavedMaps, Whereabouts, check_saved_id, whereabouts
from mrslam.agent.self_doubt import SelfDoubt
from mrslam.agent.team import Team
from mrslam.agent.teammates import Teammates
from mrslam.agent.tracking import Tracking
from mrslam.agent.witness import Witness
from mrslam.comms import CommsNode
from mrslam.merge import Bend, TeamMap
from mrslam.rbpf import Mapper
from mrslam.spatial import InputError, Keyframes, LocalMap, OccupancyGrid, Scan, se2
from mrslam.spatial.se2 import Transform


class Robot:
    """A mapper, a network core and a team, wired by :class:`mrslam.agent.Agent`."""

    def __init__(
        self,
        robot_id: str,
        settings: Settings,
        *,
        team: str = "team",
        mode: str = "distributed",
        seed: int = 0,
        boot_id: int = 1,
    ) -> None:
        """Make a robot without any map yet."""
        self.robot_id, self.settings, self.mode, self.seed = robot_id, settings, mode, seed
        self.mapper = Mapper(settings.rbpf, seed=seed)
        self.node = CommsNode(robot_id, team, boot_id, settings.comms, mode=mode, seed=seed)
        self.team = Team(robot_id, settings, has_own_map=mode != "central")
        self.links: dict[str, LinkStats] = {}
        """By teammate: what exchanges with it cost."""
        self.self_doubt = SelfDoubt(settings.agent.min_health, round(settings.agent.give_up_s * 1e9))
        self.map_number = 0
        """Number of times the robot gave its map up and began a new one."""
        self.masked_beams = 0
        """Beams dropped so far because they hit teammates."""
        self.scan: Scan | None = None
        """The newest scan, without the beams that hit teammates."""
        self._teammates = Teammates(settings.mutual_detection)
        self._witness = Witness(robot_id, settings.mutual_detection)
        self._blindness, self._saved_maps, self._reports = Blindness(), SavedMaps(), KnowledgeReports()
        self.frame = ChosenFrame(settings.agent.frame)
        """The frame in which pose and team map are told."""
        self.tracking = Tracking(settings.rbpf)
        """The pose in a saved map, of a robot that only localises (``agent.localise``)."""
        self._T_odom_base: Transform | None = None
        self._looked_ns = self._idle_ns = -(10**12)
        """When all pairs were looked at last, and when no job was found for the last time."""
        self._published_ns: int | None = None
        self._published_new = 0
        self._news = News(settings.agent.settled_s)
        self.has_news = False
        """Whether there are keyframes that were not published."""

    @property
    def T_team_map(self) -> dict[str, Transform]:
        """By robot: maps points of its map into the team frame, for those that are placed."""
        return self.team.layout.T_team_map

    def take_saved_map(self, map_id: str, known: KnownMap, near: Sequence[float] | None = None) -> None:
        """Take a map that was saved before, named with an ``@`` (``r1@monday``), to find this robot's place in it.

        Teammates that lack it get it in exchanges, as any map, and look for their places in it
        (``comms.share_saved_maps``).

        ``near`` : where this robot's map begins in it, to half a metre or so (``agent.start_sigma_m``), if somebody
        knows: (x, y) or (x, y, theta), metres and radians. It is looked for there first; a wrong hint only takes time.

        Saved maps are no part of a checkpoint: they are taken before :func:`mrslam.agent.resume`, which keeps where the
        robot was in them. Raises ``InputError`` where the name could be a robot's or is taken, or the robot does not
        both map and merge.
        """
        check_saved_id(map_id, "a saved map's name")
        if self.mode != "distributed":
            raise InputError(
                f"{map_id}: only robots that map and merge take saved maps, {self.robot_id} is {self.mode}"
            )
        if map_id in self.team.saved:
            raise InputError(f"{self.robot_id}: two saved maps are named {map_id}")
        if self.settings.agent.localise and not self.frame.saved_map:
            self.frame = ChosenFrame(map_id)
        if self.settings.agent.localise and map_id == self.frame.saved_map:
            self.tracking.map_id = map_id
        given = self.node.give_saved(map_id, known.local, known.epoch)
        self.team.take_saved_map(map_id, KnownMap(known.version, given), near)

    def whereabouts(self) -> list[Whereabouts]:
        """Return what is known of the robot's place in each saved map: its pose there, or why there is none yet."""
        return [self._whereabouts(map_id) for map_id in sorted(self.team.saved)]

    def _whereabouts(self, map_id: str) -> Whereabouts:
        at = whereabouts(self.team, map_id, self._T_team_sure)
        if map_id != self.tracking.map_id:
            return at
        if self.tracking.is_on:
            return Whereabouts(map_id, "localised", "", self.tracking.T_saved_base, self.tracking.localiser.fit.value)
        if at.T_map_base is None and self.tracking.lost:
            return replace(at, reason=f"{self.tracking.lost}; since then: {at.reason}")
        return at

    def team_map(self) -> TeamMap:
        """Return the team map in this robot's own map frame, with the places of maps, and why the others have none.

        A base station's is in the map frame of one of the robots (``anchor``).
        """
        return self.team.map()

    def teammates(self, now_ns: int) -> dict[str, Transform]:
        """Return ``T_team_base (3,)`` of the teammates whose map is placed and whose last report is recent."""
        return self._teammates.places(self.T_team_map, now_ns)

    def local_map(self) -> LocalMap:
        """Return the own map, as tiles with keyframes."""
        return self.mapper.snapshot()

    def own_map(self) -> OccupancyGrid:
        """Return the own map as a grid, without ghosts: teammates mapped as walls before their place was known."""
        return self.team.without_ghosts(self.local_map().map.to_grid(), of_own_map=True)

    def planning_grid(self) -> OccupancyGrid:
        """Return the grid to plan on, in the team frame: the team map once a teammate is placed, else the own map."""
        return self.team_map().grid if len(self.T_team_map) > 1 else self.own_map()

    @property
    def T_map_base(self) -> Transform:
        """``(3,)``: the robot's pose in its own map."""
        return self.tracking.T_own_base if self.tracking.is_on else self.mapper.T_map_base

    @property
    def covariance(self) -> NDArray[np.float64]:
        """``(3, 3)`` of that pose, m^2 and rad^2: in the saved map where the robot tracks its place there."""
        return self.tracking.covariance if self.tracking.is_on else self.mapper.covariance

    @property
    def is_settled(self) -> bool:
        """Whether the covariance costs no wait."""
        return self.tracking.is_on or self.mapper.is_settled

    @property
    def scans(self) -> int:
        """Scans taken so far: by the mapper that there is, and tracked."""
        return self.mapper.stats.scans + self.tracking.scans

    @property
    def T_team_base(self) -> Transform:
        """``(3,)``: the robot's pose in the team frame, in which its own map may be bent."""
        return se2.compose(self.team.layout.T_team_own, self.T_map_base)

    @property
    def _T_team_sure(self) -> Transform | None:
        """``(3,)``: the same where the robot does not doubt its pose in its own map, else None."""
        return None if self.self_doubt.doubtful and not self.tracking.is_on else self.T_team_base

    @property
    def T_frame_base(self) -> Transform | None:
        """``(3,)``: the robot's pose in the chosen frame (``agent.frame``); None until that is known."""
        T_frame_map = self.frame.T_frame_map
        return None if T_frame_map is None else se2.compose(T_frame_map, self.T_map_base)

    @property
    def T_frame_team(self) -> Transform | None:
        """``(3,)``: maps points of the team frame into the chosen frame, right near the robot; None until known."""
        T_frame_map = self.frame.T_frame_map
        if T_frame_map is None or not self.frame.saved_map:
            return T_frame_map
        return se2.compose(T_frame_map, se2.inverse(self.team.layout.T_team_own))

    def corrected_trajectories(self) -> dict[str, Keyframes]:
        """Return trajectories of robots with bent maps in the team frame: the own laser's, teammates' keyframes."""
        ways = self.team.layout.keyframes()
        bends = self.team.layout.bends
        if self.robot_id in bends:
            # The own map may have been corrected since it was published: by its keyframes of now.
            keys, T_team_key = self.local_map().keyframes, bends[self.robot_id].T_team_key
            now = Bend(keys.T_map_base[: len(T_team_key)], T_team_key)
            ways[self.robot_id] = now.corrected_at(keys.stamps_ns, self.trajectory_laser())
        return {robot_id: way for robot_id, way in ways.items() if robot_id in bends.keys() - self.team.saved}

    def known_area_m2(self) -> float:
        """Return the known area of the own map when it was last published, square metres."""
        published = self.team.maps.get(self.robot_id)
        return 0.0 if published is None else self._news.area_m2 or self.local_map().map.known_area_m2()

    def trajectory_laser(self) -> Keyframes:
        """Return the pose of the laser in the own map for every scan, corrected by everything that came later."""
        mapped, tracked = self.mapper.trajectory(), self.tracking.rows(self.map_number)
        stamps_ns = np.concatenate([mapped.stamps_ns, tracked.stamps_ns])
        return Keyframes(stamps_ns, self._of_laser(np.concatenate([mapped.T_map_base, tracked.T_map_base])))

    def tracked_laser(self) -> Keyframes:
        """Return the pose of the laser in the saved map for every scan that was tracked there."""
        tracked = self.tracking.rows()
        return Keyframes(tracked.stamps_ns, self._of_laser(tracked.T_map_base))

    def _of_laser(self, T_map_base: Transform) -> Transform:
        return se2.compose(T_map_base, se2.IDENTITY if self.scan is None else self.scan.T_base_laser)
