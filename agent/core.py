"""One robot, without I/O: scans, messages and ticks in; a list of effects out.

The data goes one way, in one loop: scan -> teammates masked -> mapper -> own map to the network; maps of teammates from
the network -> alignment -> team map -> where teammates are -> mask.
"""

from __future__ import annotations

from collections.abc import Sequence

from mrslam import comms
from mrslam.agent.effects import AlignJob, Effect, Event, Job, JoinJob, Outcome, as_event, known_fields, mapped_fields
from mrslam.agent.known_map import KnownMap
from mrslam.agent.link_stats import LinkStats
from mrslam.agent.robot import Robot
from mrslam.agent.saved_maps import pose_in
from mrslam.agent.self_doubt import fits_map
from mrslam.alignment import Alignment, Rejection
from mrslam.merge import JointMap
from mrslam.rbpf import Mapper, UpdateInfo
from mrslam.spatial import Scan, se2
from mrslam.spatial.se2 import Transform

SMALL_KEYFRAMES = 250
"""Keyframes of a map up to which it is published every ``agent.publish_interval_s``; of larger ones that time grows
with their number, as the cost of publishing does: 1 km of path is published every 8 s."""
AT_REST = 2.0
"""Publishing intervals after which a robot without new keyframes publishes what it has: one that drives on publishes
with the next keyframe after the first, and one that stopped, or gets no more scans, is not waited for longer."""
SEEN_BEFORE_NS = 60_000_000_000
"""Time after which keyframes are published that saw only what earlier ones had seen, nanoseconds."""
LOOK_NS = 500_000_000
"""Time between two looks at all pairs: for a job where there was none, for what was seen, and for what is new to tell,
nanoseconds. A tenth of the time in which maps and alignments change."""


class Agent(Robot):
    """A deterministic state machine; it owns no socket, thread, clock or global random state."""

    # -- scan -> teammates masked -> mapper -> own map to the network --------------------------------------------------

    def on_scan(self, scan: Scan, T_odom_base: Transform | None, now_ns: int) -> list[Effect]:
        """Map one scan, without the beams that hit teammates; publish the map when it is time to."""
        if self.mode == "central":
            return []
        T_map_base = self._expected_pose(T_odom_base)
        self.scan, masked = self._teammates.mask(scan, T_map_base, self.T_team_map, now_ns)
        effects = self._resume_tracking(T_odom_base, now_ns)
        if self.tracking.is_on:
            return effects + self._track(scan, T_odom_base, masked, now_ns)
        info = self.mapper.update(self.scan, T_odom_base)
        if info.reason is None and not self.self_doubt.doubtful:
            self._witness.on_scan(scan, self.mapper.T_map_base, now_ns)
        self._T_odom_base = T_odom_base
        self.masked_beams += masked
        effects += self._blindness.look(info.reason, now_ns) + self._watch_health(info, self.scan, now_ns)
        if masked:
            effects.append(Event(now_ns, "masked", {"beams": masked}))
        if info.processed:
            effects.append(Event(now_ns, "mapped", mapped_fields(info)))
        if self.mapper.stats.processed and not self.self_doubt.doubtful:
            self.has_news = self.has_news or info.processed
            if info.processed and self._publish_due(now_ns):
                self.publish(now_ns)
            self.node.set_own_pose(self.mapper.T_map_base, now_ns, self._witness.bodies_m(self.team, now_ns))
        return effects + self._begin_tracking(info, now_ns)

    # -- or, in a saved map: scan -> teammates masked -> pose ----------------------------------------------------------

    def _track(self, scan: Scan, T_odom_base: Transform | None, masked: int, now_ns: int) -> list[Effect]:
        """Track the pose in the saved map by one scan; a robot that is lost begins a new map, and looks again."""
        assert self.scan is not None
        info = self.tracking.update(self.scan, T_odom_base, self.map_number)
        self._T_odom_base = T_odom_base
        self.masked_beams += masked
        effects: list[Effect] = [*self._blindness.look(info.reason, now_ns)]
        if masked:
            effects.append(Event(now_ns, "masked", {"beams": masked}))
        if (lost := self.tracking.watch(now_ns)) is not None:
            self._begin_map()
            return [*effects, lost]
        if info.reason is None:
            self._witness.on_scan(scan, self.T_map_base, now_ns)
        self.node.set_own_pose(self.T_map_base, now_ns, self._witness.bodies_m(self.team, now_ns))
        return effects

    def _begin_tracking(self, info: UpdateInfo, now_ns: int) -> list[Effect]:
        """Begin where the robot knows its place in the saved map, and that shows what it sees."""
        map_id = self.tracking.map_id
        if map_id is None or map_id not in self.T_team_map or info.reason is not None or self.self_doubt.doubtful:
            return []
        T_saved_base = pose_in(self.team, map_id, self.T_team_base)
        if T_saved_base is None or self.scan is None or not self.tracking.is_due(now_ns):
            return []
        grid, T_odom_base = self.team.maps[map_id].grid, self._T_odom_base
        if not self.tracking.begin(grid, self.scan, T_odom_base, T_saved_base, self.mapper.T_map_base):
            return []
        return self._tracks(now_ns)

    def _resume_tracking(self, T_odom_base: Transform | None, now_ns: int) -> list[Effect]:
        """Track on where a robot that was started again did before; elsewhere its old map is of no use to it."""
        if not self.tracking.was_left or self.scan is None:
            return []
        known = self.team.maps.get(self.tracking.map_id or "")
        if self.tracking.resume(None if known is None else known.grid, self.scan, T_odom_base):
            return self._tracks(now_ns)
        self._begin_map()
        return []

    def _tracks(self, now_ns: int) -> list[Effect]:
        self.has_news = False
        self.frame.T_frame_map = self.tracking.T_saved_own
        return [self.tracking.began(now_ns)]

    def publish(self, now_ns: int) -> None:
        """Publish what is news of the own map: a new revision, for teammates and for the own team map alike."""
        told = self._news.of(self.local_map(), self.team, self.node.placed_by, now_ns)
        self._published_ns, self._published_new, self.has_news = now_ns, self._new_keyframes, told is None
        published = None if told is None else self.node.publish(told, now_ns)
        if published is not None:
            self._take_map(published)

    def _publish_due(self, now_ns: int, intervals: float = 1.0) -> bool:
        size = max(1.0, self.mapper.stats.processed / SMALL_KEYFRAMES)
        interval_ns = intervals * size * self.settings.agent.publish_interval_s * 1e9
        if self._new_keyframes == self._published_new:
            interval_ns = max(interval_ns, SEEN_BEFORE_NS)
        return self._published_ns is None or now_ns - self._published_ns >= interval_ns

    @property
    def _new_keyframes(self) -> int:
        """Keyframes of the map that saw what none had seen before."""
        return self.mapper.stats.processed - self.mapper.stats.seen_before

    def _expected_pose(self, T_odom_base: Transform | None) -> Transform:
        """Return the expected ``T_map_base (3,)`` of a new scan: the last pose, moved by odometry since."""
        if T_odom_base is None or self._T_odom_base is None:
            return self.T_map_base
        return se2.compose(self.T_map_base, se2.between(self._T_odom_base, T_odom_base))

    def _watch_health(self, info: UpdateInfo, scan: Scan, now_ns: int) -> list[Effect]:
        """Return an event where the robot begins to doubt its pose, has recovered, or gives its map up."""

        def fits() -> bool | None:
            known = self.robot_id in self.team.maps
            return not known or fits_map(scan, info.T_map_base, self.local_map().map.to_grid())

        if info.reason is not None:
            verdict = self.self_doubt.leave_out(info.health)
        else:
            verdict = self.self_doubt.look(info.health, info.match_score, fits, now_ns, is_lost=info.is_lost)
        if verdict is None:
            return []
        if verdict == "given_up":
            self._begin_map()
        fields = {"health": round(info.health, 3), "match_score": round(info.match_score, 3)}
        return [Event(now_ns, verdict, fields)]

    def _begin_map(self) -> None:
        """Begin a new map; teammates see a new epoch, for the old map's frame is not this one's."""
        self.map_number += 1
        self.mapper = Mapper(self.settings.rbpf, seed=self.seed + self.map_number)
        self._published_ns, self.has_news = None, False
        self.tracking.stop()
        self._witness.forget()
        self.frame.forget()
        self.node.begin_map()
        self.team.begin_own_map()

    # -- network -> maps and places of teammates -----------------------------------------------------------------------

    def on_message(self, payload: bytes, sender: str | None, now_ns: int) -> list[Effect]:
        """Take a message from the network; a bad one is counted and dropped."""
        return self._follow(self.node.on_message(payload, now_ns, sender), now_ns)

    def on_peer_joined(self, peer: str, now_ns: int) -> list[Effect]:
        """A teammate's liveliness token appeared."""
        return self._follow(self.node.on_peer_joined(peer, now_ns), now_ns)

    def on_peer_left(self, peer: str, now_ns: int) -> list[Effect]:
        """A teammate's liveliness token is gone."""
        return self._follow(self.node.on_peer_left(peer, now_ns), now_ns)

    def set_link_quality(self, peer: str, quality: float, now_ns: int) -> list[Effect]:
        """Set the quality of a link that is not measured: a radio model's or a trace's."""
        return self._follow(self.node.set_link_quality(peer, quality, now_ns), now_ns)

    def leave(self, now_ns: int) -> list[Effect]:
        """Say goodbye, so that teammates need not wait for silence."""
        return self._follow(self.node.leave(), now_ns)

    def on_tick(self, now_ns: int) -> list[Effect]:
        """Handle beacons, rendezvous, exchanges and the places of maps; call it every ``agent.tick_s``."""
        is_look_due = now_ns - self._looked_ns >= LOOK_NS
        if not self.self_doubt.doubtful:
            is_due = self.has_news and self._publish_due(now_ns, AT_REST)
            if is_look_due and self._news.is_owed(self.team, self.node.placed_by, now_ns):
                self.mapper.skip_revisions(1)  # more of the same map is another version of it
                is_due = True
            if is_due:
                self.publish(now_ns)
        if is_look_due:
            self._looked_ns = now_ns
            self.node.set_unplaced([name for name in self.team.unplaced if not comms.is_saved(name)])
            self.node.add_claims(self._witness.claims(self.team, now_ns))
            self.node.add_hints(self.team.hints.news(self.team.beliefs, now_ns, self.tracking.places))
        effects = self._follow(self.node.on_tick(now_ns), now_ns)
        self.team.keep_placed(now_ns)
        if is_look_due:
            effects += self._witness.look(self.team, now_ns)
        if self._reports.are_due(self.team.maps, self.T_team_map, now_ns):
            team_m2 = self.team.known_area_m2()
            effects.append(Event(now_ns, "known", known_fields(self.known_area_m2(), team_m2, self.T_team_map)))
        return effects + self.team.revoke(now_ns) + self._look_at_saved(now_ns)

    def _look_at_saved(self, now_ns: int) -> list[Effect]:
        if not self.team.saved or self.tracking.is_on:
            return []
        self.frame.follow(self.team, self.mapper.T_map_base)
        return [*self._saved_maps.look(self.team, self._T_team_sure, now_ns)]

    def _follow(self, effects: Sequence[comms.Effect], now_ns: int) -> list[Effect]:
        """Do what follows from the network core's effects; return what is left for the shell."""
        out: list[Effect] = []
        for effect in effects:
            match effect:
                case comms.TeammatePose():
                    self._observe(effect, now_ns)
                    continue
                case comms.TeammateClaim():
                    self._witness.on_claim(effect, self.team, now_ns)
                    continue
                case comms.TeammateHint():
                    self.team.hints.hear(effect)
                    continue
                case comms.PeerSeen():
                    self.team.hints.meet()
                    self._witness.meet()
                case comms.ExchangeStarted():
                    self.team.hints.meet(effect.unplaced)
                case comms.MapUpdated():
                    self._take_map(effect)
                case comms.ExchangeDone():
                    self.links.setdefault(effect.peer, LinkStats()).add(effect)
            out.append(effect if isinstance(effect, comms.Send) else as_event(effect, now_ns))
        return out

    def _take_map(self, new: comms.MapUpdated) -> None:
        take = self.team.take_saved_map if comms.is_saved(new.robot_id) else self.team.take_map
        take(new.robot_id, KnownMap((new.epoch, new.revision), new.map))

    def _observe(self, report: comms.TeammatePose, now_ns: int) -> None:
        self._witness.on_report(report, self.team, now_ns)
        known = self.team.maps.get(report.peer)
        if known is not None and known.epoch == report.epoch:  # else its pose is in the frame of another map
            T_own_map = self.team.layout.T_own_map(report.peer)
            self._teammates.observe(report, T_own_map, self.team.covariance_of(report.peer))

    # -- alignment -> team map -> where teammates are ------------------------------------------------------------------

    def next_job(self, now_ns: int) -> Job | None:
        """Return the maps most worth aligning or joining now, or None; the shell runs it and calls :meth:`on_done`."""
        if now_ns - self._idle_ns < LOOK_NS:
            return None
        job = self.team.next_job(now_ns, self.node.searching)
        if job is None:
            self._idle_ns = now_ns
        return job

    def on_done(self, job: Job, outcome: Outcome, now_ns: int) -> list[Effect]:
        """Take the outcome of a job."""
        match job, outcome:
            case JoinJob(), JointMap():
                effects = self.team.on_joined(job, outcome, now_ns)
            case AlignJob(), Alignment() | Rejection():
                effects = self.team.on_aligned(job, outcome, now_ns)
            case _:
                raise TypeError(f"{type(outcome).__name__} is no outcome of {type(job).__name__}")
        return effects + self._look_at_saved(now_ns)
