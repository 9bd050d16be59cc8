"""One robot, without I/O: scans, messages and ticks in; things to do out.

The way of the data, one loop in one direction: scan -> teammates masked -> mapper -> own map to the network; maps of
teammates from the network -> alignment -> team map -> where teammates are -> mask.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from mrslam import comms
from mrslam.agent.blindness import Blindness
from mrslam.agent.config import Settings
from mrslam.agent.doubt import SelfDoubt, fits_map
from mrslam.agent.effects import AlignJob, Effect, Event, as_event
from mrslam.agent.link_stats import LinkStats
from mrslam.agent.team import Team
from mrslam.alignment import Alignment, Rejection
from mrslam.merge import TeamMap
from mrslam.mutual_detection import TeammateTracker, mask_teammates
from mrslam.rbpf import Mapper, UpdateInfo
from mrslam.spatial import Keyframes, LocalMap, OccupancyGrid, Scan, se2
from mrslam.spatial.se2 import Transform

TEAMMATE_NS = 10_000_000_000
"""A teammate heard longer ago than this may be anywhere, nanoseconds."""
TELL_NS = 10_000_000_000
"""How often a robot tells how much it knows, nanoseconds."""


class Agent:
    """A deterministic state machine; it owns no socket, thread, clock or global random state."""

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
        """Make a robot that knows nothing yet."""
        self.robot_id = robot_id
        self.settings = settings
        self.mode = mode
        self.mapper = Mapper(settings.rbpf, seed=seed)
        self.node = comms.CommsNode(robot_id, team, boot_id, settings.comms, mode=mode, seed=seed)
        self.tracker = TeammateTracker(settings.mutual_detection)
        self.team = Team(robot_id, settings, self.node.store, self.tracker.forget, maps=mode != "central")
        self.links: dict[str, LinkStats] = {}
        self.self_doubt = SelfDoubt(settings.agent.min_health, round(settings.agent.give_up_s * 1e9))
        self._blindness = Blindness()
        self.seed = seed
        self.map_number = 0
        """How often the robot gave its map up and began a new one."""
        self.masked_beams = 0
        self.scan: Scan | None = None
        """The newest scan, without the beams that hit teammates."""
        self._published_ns: int | None = None
        self._published_grid: OccupancyGrid | None = None  # the map last published, made when it is asked for
        self._T_odom_base: Transform | None = None
        self._T_base_laser: Transform = se2.IDENTITY
        self._heard: dict[str, tuple[int, Transform]] = {}
        self._tell_ns = 0

    # -- in: the laser -------------------------------------------------------------------------------------------------

    def on_scan(self, scan: Scan, T_odom_base: Transform | None, now_ns: int) -> list[Effect]:
        """Map one scan, without the beams that hit teammates; publish the map when it is time to."""
        if self.mode == "central":
            return []
        scan, masked = self._without_teammates(scan, T_odom_base, now_ns)
        self.scan = scan
        info = self.mapper.update(scan, T_odom_base)
        self._T_odom_base, self._T_base_laser = T_odom_base, scan.T_base_laser
        effects = self._blindness.look(info.reason, now_ns) + self._watch_health(info, scan, now_ns)
        if masked:
            self.masked_beams += masked
            effects.append(Event(now_ns, "masked", {"beams": masked}))
        if info.processed:
            effects.append(Event(now_ns, "mapped", _mapped_fields(info)))
        if not self.self_doubt.doubtful and self.mapper.stats.processed:
            if info.processed and self._publish_due(now_ns):
                self.publish(now_ns)
            self.node.set_own_pose(self.mapper.T_map_base, now_ns)
        return effects

    def publish(self, now_ns: int) -> None:
        """Make the own map, as it is now, what teammates get."""
        self._published_ns, self._published_grid = now_ns, None
        if self.node.publish(self.local_map(), now_ns):
            self.team.map_changed(self.robot_id)

    def _watch_health(self, info: UpdateInfo, scan: Scan, now_ns: int) -> list[Effect]:
        """Notice that the robot may be anywhere, that it has found itself again, or that it never will."""
        if info.reason is not None:
            return []
        fits = partial(self._fits_what_was_published, scan, info.T_map_base)
        verdict = self.self_doubt.look(info.health, info.match_score, fits, now_ns)
        if verdict is None:
            return []
        if verdict == "given_up":  # teammates see a new epoch: the old map's frame is not this one's
            self.map_number += 1
            self.mapper = Mapper(self.settings.rbpf, seed=self.seed + self.map_number)
            self._published_ns = None
            self.node.begin_map()
            self.team.displace(self.robot_id)
        fields = {"health": round(info.health, 3), "match_score": round(info.match_score, 3)}
        return [Event(now_ns, verdict, fields)]

    def _fits_what_was_published(self, scan: Scan, T_map_base: Transform) -> bool | None:
        own = self.node.store.maps.get(self.robot_id)
        if own is None:
            return True
        if self._published_grid is None:
            self._published_grid = own.map.to_grid()
        return fits_map(scan, T_map_base, self._published_grid)

    def _publish_due(self, now_ns: int) -> bool:
        interval_ns = self.settings.agent.publish_interval_s * 1e9
        return self._published_ns is None or now_ns - self._published_ns >= interval_ns

    def _without_teammates(self, scan: Scan, T_odom_base: Transform | None, now_ns: int) -> tuple[Scan, int]:
        if not self.settings.mutual_detection.enabled:
            return scan, 0
        centres, radii = self.tracker.predict(now_ns)
        if not len(radii):
            return scan, 0
        return mask_teammates(scan, self._expected_pose(T_odom_base), centres, radii)

    def _expected_pose(self, T_odom_base: Transform | None) -> Transform:
        """Return where the robot is when a scan comes in: where it was, and what the wheels say since."""
        if T_odom_base is None or self._T_odom_base is None:
            return self.mapper.T_map_base
        return se2.compose(self.mapper.T_map_base, se2.between(self._T_odom_base, T_odom_base))

    # -- in: the network -----------------------------------------------------------------------------------------------

    def on_message(self, payload: bytes, sender: str | None, now_ns: int) -> list[Effect]:
        """Take a message from the network; a bad one is counted and dropped."""
        return self._follow(self.node.on_message(payload, now_ns, sender), now_ns)

    def on_peer_joined(self, peer: str, now_ns: int) -> list[Effect]:
        """A teammate's liveliness token appeared."""
        return self._follow(self.node.on_peer_joined(peer, now_ns), now_ns)

    def on_peer_left(self, peer: str, now_ns: int) -> list[Effect]:
        """A teammate's liveliness token is gone."""
        return self._follow(self.node.on_peer_left(peer, now_ns), now_ns)

    def on_tick(self, now_ns: int) -> list[Effect]:
        """Look after beacons, rendezvous and exchanges; call it every ``agent.tick_s``."""
        effects = self._follow(self.node.on_tick(now_ns), now_ns)
        self.team.keep_placed(now_ns)
        if now_ns >= self._tell_ns:
            self._tell_ns = now_ns + TELL_NS
            effects.append(Event(now_ns, "known", self._known()))
        return effects + self.team.revoke(now_ns)

    def _known(self) -> dict[str, Any]:
        team = self.team_map()
        areas = {"own_m2": self.known_area_m2(), "team_m2": team.grid.known_area_m2()}
        return {**{name: round(area, 2) for name, area in areas.items()}, "placed": sorted(team.T_team_map)}

    def set_link_quality(self, peer: str, quality: float, now_ns: int) -> list[Effect]:
        """Tell the quality of a link from outside (a radio model or a trace)."""
        return self._follow(self.node.set_link_quality(peer, quality, now_ns), now_ns)

    def leave(self, now_ns: int) -> list[Effect]:
        """Say goodbye: teammates need not wait for silence."""
        return self._follow(self.node.leave(), now_ns)

    def _follow(self, effects: Sequence[comms.Effect], now_ns: int) -> list[Effect]:
        """Turn what the network core reports into what this robot does about it."""
        out: list[Effect] = []
        for effect in effects:
            match effect:
                case comms.Send():
                    out.append(effect)
                case comms.MapUpdated():
                    out.append(as_event(effect, now_ns))
                    self.team.map_changed(effect.robot_id)
                case comms.TeammatePose():
                    self._observe(effect)
                case comms.ExchangeDone():
                    self.links.setdefault(effect.peer, LinkStats()).add(effect)
                    out.append(as_event(effect, now_ns))
                case _:
                    out.append(as_event(effect, now_ns))
        return out

    def _observe(self, seen: comms.TeammatePose) -> None:
        if seen.epoch != self.node.store.version(seen.peer)[0]:
            return  # a place on a map that is not the one known here says nothing
        self._heard[seen.peer] = (seen.stamp_ns, seen.T_map_base)
        T_own_peer = self.T_team_map.get(seen.peer)
        if T_own_peer is not None and seen.peer != self.robot_id:
            self.tracker.observe(seen.peer, seen.stamp_ns, se2.compose(T_own_peer, seen.T_map_base)[:2])

    # -- the team ------------------------------------------------------------------------------------------------------

    def next_alignment(self, now_ns: int) -> AlignJob | None:
        """Return the pair of maps most worth aligning now, or None; the shell runs it and calls :meth:`on_aligned`."""
        return self.team.next_alignment(now_ns)

    def on_aligned(self, job: AlignJob, outcome: Alignment | Rejection, now_ns: int) -> list[Effect]:
        """Take the outcome of an alignment."""
        return self.team.on_aligned(job, outcome, now_ns)

    @property
    def T_team_map(self) -> dict[str, Transform]:
        """By robot: maps points of its map into the own map, for those whose place is known."""
        return self.team.T_team_map

    def team_map(self) -> TeamMap:
        """Return the team map in this robot's own map frame, with who is placed where and who is not and why.

        A base station's is in the map frame of one of the robots (``anchor``).
        """
        return self.team.map()

    def own_map(self) -> OccupancyGrid:
        """Return the own map, without what was mapped of teammates before it was known where they are."""
        return self.team.without_ghosts(self.local_map().map.to_grid())

    def planning_grid(self) -> OccupancyGrid:
        """Return what to drive by, in the own map frame: the team's map once someone else is placed, else the own."""
        return self.team_map().grid if len(self.T_team_map) > 1 else self.own_map()

    def teammates(self, now_ns: int) -> dict[str, Transform]:
        """Return where those teammates are, in the own map frame, whose place is known and who were heard lately."""
        return {
            peer: se2.compose(self.T_team_map[peer], T_map_base)
            for peer, (t_ns, T_map_base) in sorted(self._heard.items())
            if peer in self.T_team_map and now_ns - t_ns < TEAMMATE_NS
        }

    # -- what the robot has to show ------------------------------------------------------------------------------------

    def local_map(self) -> LocalMap:
        """Return the own map now."""
        return self.mapper.snapshot()

    def known_area_m2(self) -> float:
        """Return the known area of the own map as last published, square metres."""
        return self.team.pairs.area_m2(self.robot_id)

    def trajectory_laser(self) -> Keyframes:
        """Return the pose of the laser for every scan, corrected by all that came later."""
        trajectory = self.mapper.trajectory()
        return Keyframes(trajectory.stamps_ns, se2.compose(trajectory.T_map_base, self._T_base_laser))


def _mapped_fields(info: UpdateInfo) -> dict[str, Any]:
    x, y, theta = (round(float(value), 4) for value in info.T_map_base)
    return {
        "x_m": x,
        "y_m": y,
        "theta_rad": theta,
        "neff": round(info.neff, 2),
        "resampled": info.resampled,
        "health": round(info.health, 3),
    }
