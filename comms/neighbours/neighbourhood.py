"""The teammates in sight: beacons in and out, liveliness tokens, restarts, departures."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mrslam.comms.config import MODES
from mrslam.comms.effects import DuplicateId, PeerGone, PeerSeen, TeammateClaim, TeammateHint, TeammatePose
from mrslam.comms.exchange.context import ExchangeContext
from mrslam.comms.neighbours.link_quality import HeardBeacon
from mrslam.comms.neighbours.link_states import LinkStates
from mrslam.comms.neighbours.own_beacons import CM, LEVELS, LLR_SCALE, OwnBeacons
from mrslam.comms.neighbours.presence import DuplicateIdWatch, Peer, am_newcomer
from mrslam.comms.wire.frames import NAME, WireError
from mrslam.comms.wire.keyframe_codec import SCALE
from mrslam.comms.wire.messages import Beacon, Bye

PAST_BOOTS = 4
"""Past boot ids of a teammate remembered, so that a late beacon of one is not taken for another restart; beacons are
late by seconds, and a robot restarts less often."""


class Neighbourhood:
    """Keeps the list of teammates in sight, by their beacons, tokens and goodbyes."""

    def __init__(self, context: ExchangeContext, abort: Callable[[str, str, int], None]) -> None:
        """Start alone; ``abort(peer, reason, now_ns)`` ends the exchange with a peer that is out of reach."""
        self._context, self._abort = context, abort
        self.peers: dict[str, Peer] = {}
        self.links = LinkStates(context, abort)
        self.beacons = OwnBeacons(context)
        self.must_stop = False
        """Set when another live process had this robot's id before."""
        self._duplicates = DuplicateIdWatch()

    def on_tick(self, now_ns: int) -> None:
        """Send a beacon when it is time, judge the links, notice who fell silent."""
        self.beacons.start(now_ns)
        monitor = self.links.monitor
        calm = monitor.is_calm(now_ns)
        if self.beacons.is_due(now_ns, calm=calm):
            self.beacons.send(monitor.report(now_ns), now_ns, calm=calm)
        self.links.judge(self.peers.__contains__, now_ns)
        timeout_s = self._context.config.peer_timeout_s
        for peer, known in list(self.peers.items()):
            if not known.has_token and now_ns - known.heard_ns > timeout_s * 1e9:
                self.lose(peer, f"silent for {timeout_s:g} s", now_ns)

    # -- beacons of others -----------------------------------------------------------------------------------------

    def on_beacon(self, beacon: Beacon, now_ns: int) -> None:
        """Take a teammate's beacon; raises ``WireError`` where ``max_robots`` are in sight already."""
        peer = beacon.sender
        known = self.peers.get(peer)
        if known is None:
            if len(self.peers) >= self._context.config.max_robots:
                raise WireError("too many robots")
            known = self._see(peer, Peer(boot=beacon.boot, mode=beacon.mode), now_ns)
        elif known.boot != beacon.boot:
            silent_ns = now_ns - known.heard_ns
            if beacon.boot in known.past_boots and silent_ns <= self._context.config.peer_timeout_s * 1e9:
                return  # a late beacon of its past life; after ``peer_timeout_s`` of silence it is a live one
            if known.boot:
                known = self._meet_again(known, beacon, now_ns)
            known.boot = beacon.boot
        known.mode = beacon.mode
        known.heard_ns = max(known.heard_ns, now_ns)
        percent = dict(beacon.heard).get(self._context.own_id)
        nlq = None if percent is None else percent / LEVELS
        sent_ns, period_ns = beacon.uptime_ms * 1_000_000, beacon.period_ms * 1_000_000
        self.links.monitor.hear(peer, HeardBeacon(beacon.seq, sent_ns, period_ns, nlq), now_ns)
        if beacon.seq > known.last_seq:
            known.last_seq = beacon.seq
            self._take_pose(known, beacon, now_ns)
            self._take_claims(beacon)
            self._take_hints(beacon)

    def _meet_again(self, known: Peer, beacon: Beacon, now_ns: int) -> Peer:
        """A teammate restarted: drop what was known of its last boot, and return its new entry."""
        past = (*[boot for boot in known.past_boots if boot != beacon.boot][1 - PAST_BOOTS :], known.boot)
        self.lose(beacon.sender, "restarted", now_ns)
        self._context.rendezvous.on_restart(beacon.sender)
        again = Peer(boot=beacon.boot, mode=beacon.mode, past_boots=past, has_token=known.has_token)
        return self._see(beacon.sender, again, now_ns)

    def _take_pose(self, known: Peer, beacon: Beacon, now_ns: int) -> None:
        if beacon.pose is None:
            return
        x, y, theta, age_ms = beacon.pose
        taken_ms = beacon.uptime_ms - age_ms
        if taken_ms != known.pose_taken_ms:
            known.pose_taken_ms = taken_ms
            # Its age, not its stamp: robots' clocks need not agree.
            T_map_base = np.array((x, y, theta), dtype=np.float64) / SCALE
            stamp_ns = now_ns - age_ms * 1_000_000
            bodies_m = np.array(beacon.bodies, dtype=np.float64).reshape(-1, 2) / CM
            self._context.out.emit(TeammatePose(beacon.sender, stamp_ns, T_map_base, beacon.epoch, bodies_m))

    def _take_claims(self, beacon: Beacon) -> None:
        of_robots = beacon.claimed if len(beacon.claimed) == len(beacon.claims) else [None] * len(beacon.claims)
        for (robot, *numbers, llr), of_robot in zip(beacon.claims, of_robots, strict=True):
            T_sender_robot = np.array(numbers, dtype=np.float64) / SCALE
            claim = TeammateClaim(beacon.sender, beacon.epoch, robot, T_sender_robot, llr / LLR_SCALE, of_robot)
            self._context.out.emit(claim)

    def _take_hints(self, beacon: Beacon) -> None:
        for robot, *numbers in (*beacon.hints, *beacon.saved_hints):
            T_sender_robot = np.array(numbers, dtype=np.float64) / SCALE
            self._context.out.emit(TeammateHint(beacon.sender, beacon.epoch, robot, T_sender_robot))

    def on_duplicate_id(self, beacon: Beacon, now_ns: int) -> None:
        """Another process uses this robot's id: when that is certain, report it; the newcomer must stop."""
        own = self._context
        if self._duplicates.hear(beacon):
            newcomer = am_newcomer(self.beacons.uptime_ms(now_ns), own.boot, beacon)
            self.must_stop |= newcomer
            own.out.emit(DuplicateId(own.own_id, own.boot, beacon.boot, newcomer))

    # -- coming and going ------------------------------------------------------------------------------------------

    def on_token(self, peer: str, now_ns: int) -> None:
        """A teammate's liveliness token is up; one that no robot can have is not heard, nor one too many."""
        if peer != self._context.own_id and NAME.fullmatch(peer):
            known = self.peers.get(peer)
            if known is None:
                if len(self.peers) >= self._context.config.max_robots:
                    self._context.out.drop("too many robots", peer)
                    return
                known = self._see(peer, Peer(heard_ns=now_ns), now_ns)
            known.has_token = True

    def _see(self, peer: str, known: Peer, now_ns: int) -> Peer:
        known.heard_ns = now_ns
        self.peers[peer] = known
        self._context.out.emit(PeerSeen(peer, known.boot, MODES[known.mode]))
        self.links.on_seen(peer, now_ns)
        return known

    def on_bye(self, message: Bye, now_ns: int) -> None:
        """A teammate leaves; the goodbye of an earlier boot of it, come late, is ignored."""
        known = self.peers.get(message.sender)
        if known is not None and known.boot in (0, message.boot):
            self.lose(message.sender, "left", now_ns)

    def lose(self, peer: str, reason: str, now_ns: int) -> None:
        """Forget a teammate that is gone."""
        if peer not in self.peers:
            return
        self._abort(peer, f"{peer} {reason}", now_ns)
        self.links.on_lost(peer, now_ns)
        del self.peers[peer]
        self._context.out.emit(PeerGone(peer, reason))
