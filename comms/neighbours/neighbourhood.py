"""Who is here and how good the links to them are: beacons out, beacons in, tokens, restarts, departures."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mrslam.comms import effects as fx
from mrslam.comms.config import MODES
from mrslam.comms.exchange.station import Station
from mrslam.comms.neighbours.beacons import LEVELS, BeaconClock, make_beacon
from mrslam.comms.neighbours.link_quality import LinkMonitor
from mrslam.comms.neighbours.presence import Peer, TwinWatch, am_newcomer
from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.keyframe_codec import SCALE, quantise
from mrslam.comms.wire.messages import Beacon, Bye
from mrslam.spatial.se2 import Transform


class Neighbourhood:
    """The teammates in sight."""

    def __init__(self, station: Station, abort: Callable[[str, str, int], None]) -> None:
        """Start alone; ``abort(peer, reason, now_ns)`` ends the exchange with a peer that is out of reach."""
        self._station, self._abort = station, abort
        self.peers: dict[str, Peer] = {}
        self.links = LinkMonitor(station.config)
        self.must_stop = False
        """Set when another live process had this robot's id before."""
        self._clock = BeaconClock(station.config)
        self._twins = TwinWatch()
        self._told: dict[str, float] = {}  # link quality as last recorded
        self._outside: dict[str, float] = {}  # link quality from a model or trace
        self._started_ns: int | None = None
        self._pose: tuple[int, int, int, int] | None = None
        self._period_ns = round(station.config.beacon_period_s * 1e9)
        self._judge_ns = 0

    # -- myself ----------------------------------------------------------------------------------------------------

    def set_own_pose(self, T_map_base: Transform, stamp_ns: int) -> None:
        """Tell where the robot is in its own map, and when it was; beacons carry it."""
        x, y, theta = (int(v) for v in quantise(np.asarray(T_map_base, dtype=np.float64)))
        self._pose = (x, y, theta, int(stamp_ns))

    def uptime_ms(self, now_ns: int) -> int:
        """Return for how long this robot has been up."""
        return 0 if self._started_ns is None else max(now_ns - self._started_ns, 0) // 1_000_000

    def on_tick(self, now_ns: int) -> None:
        """Send a beacon when it is time, judge the links, notice who fell silent."""
        if self._started_ns is None:
            self._started_ns = now_ns
        calm = self.links.is_calm(now_ns)
        if self._clock.is_due(now_ns, calm=calm):
            self._send_beacon(now_ns, calm)
        if now_ns >= self._judge_ns:
            self._judge_ns = max(self._judge_ns, now_ns - self._period_ns) + self._period_ns
            self._judge_links(now_ns)
        limit_ns = self._station.config.peer_timeout_s * 1e9
        for peer, known in list(self.peers.items()):
            if not known.has_token and now_ns - known.heard_ns > limit_ns:
                self.lose(peer, f"silent for {self._station.config.peer_timeout_s:g} s", now_ns)

    def _send_beacon(self, now_ns: int, calm: bool) -> None:
        station = self._station
        period_ns = self._clock.next(now_ns, calm=calm)
        beacon = make_beacon(
            station.own_id,
            station.boot,
            self._clock.seq,
            self.uptime_ms(now_ns),
            period_ns,
            station.mode,
            self.links.report(now_ns),
            station.store.own_epoch,
            self._pose,
            now_ns,
        )
        station.out.post(beacon, None, "beacon")

    # -- beacons of others -----------------------------------------------------------------------------------------

    def on_beacon(self, beacon: Beacon, now_ns: int) -> None:
        """A teammate is here; raises ``WireError`` where there are too many."""
        peer = beacon.sender
        known = self.peers.get(peer)
        if known is None:
            if len(self.peers) >= self._station.config.max_robots:
                raise WireError("too many robots")
            known = self._see(peer, Peer(boot=beacon.boot, mode=beacon.mode), now_ns)
        elif known.boot != beacon.boot:
            silent_ns = now_ns - known.heard_ns
            if beacon.boot in known.past_boots and silent_ns <= self._station.config.peer_timeout_s * 1e9:
                return  # a late echo of its past life; it is none when nothing else is heard for so long
            if known.boot:
                known = self._meet_again(known, beacon, now_ns)
            known.boot = beacon.boot
        known.mode = beacon.mode
        known.heard_ns = max(known.heard_ns, now_ns)
        heard = [(name, percent / LEVELS) for name, percent in beacon.heard]
        sent_ns, period_ns = beacon.uptime_ms * 1_000_000, beacon.period_ms * 1_000_000
        self.links.hear(peer, beacon.seq, sent_ns, period_ns, heard, self._station.own_id, now_ns)
        if beacon.seq > known.last_seq:
            known.last_seq = beacon.seq
            self._take_pose(known, beacon, now_ns)

    def _meet_again(self, known: Peer, beacon: Beacon, now_ns: int) -> Peer:
        """A teammate started anew: what was known of its last life no longer holds."""
        past = (*[boot for boot in known.past_boots if boot != beacon.boot][-3:], known.boot)
        self.lose(beacon.sender, "restarted", now_ns)
        self._station.rendezvous.on_restart(beacon.sender)
        return self._see(beacon.sender, Peer(boot=beacon.boot, past_boots=past, has_token=known.has_token), now_ns)

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
            self._station.out.emit(fx.TeammatePose(beacon.sender, stamp_ns, T_map_base, beacon.boot + beacon.bumps))

    def on_twin(self, beacon: Beacon, now_ns: int) -> None:
        """Somebody bears my name: when that is certain, both are told, and the newcomer must stop."""
        own = self._station
        if self._twins.hear(beacon):
            newcomer = am_newcomer(self.uptime_ms(now_ns), own.boot, beacon)
            self.must_stop |= newcomer
            own.out.emit(fx.DuplicateId(own.own_id, own.boot, beacon.boot, newcomer))

    # -- coming and going ------------------------------------------------------------------------------------------

    def on_token(self, peer: str, now_ns: int) -> None:
        """A teammate's liveliness token is up."""
        if peer != self._station.own_id:
            known = self.peers.get(peer)
            if known is None:
                known = self._see(peer, Peer(heard_ns=now_ns), now_ns)
            known.has_token = True

    def _see(self, peer: str, known: Peer, now_ns: int) -> Peer:
        known.heard_ns = now_ns
        self.peers[peer] = known
        self._station.out.emit(fx.PeerSeen(peer, known.boot, MODES[known.mode]))
        if peer in self._outside:
            self._set_link(peer, self._outside[peer], now_ns)
        return known

    def on_bye(self, message: Bye, now_ns: int) -> None:
        """A teammate says that it leaves; what a past life of it said counts no more."""
        known = self.peers.get(message.sender)
        if known is not None and known.boot in (0, message.boot):
            self.lose(message.sender, "left", now_ns)

    def lose(self, peer: str, reason: str, now_ns: int) -> None:
        """Forget a teammate that is gone."""
        if peer not in self.peers:
            return
        self._abort(peer, f"{peer} {reason}", now_ns)
        self._set_link(peer, 0.0, now_ns)
        del self.peers[peer]
        self._told.pop(peer, None)
        self.links.forget(peer)
        self._station.rendezvous.forget(peer)
        self._station.out.emit(fx.PeerGone(peer, reason))

    # -- links -----------------------------------------------------------------------------------------------------

    def set_link_quality(self, peer: str, quality: float, now_ns: int) -> None:
        """Take a link's quality (0..1) from a radio model or a trace; nothing happens where links are measured."""
        if self._station.config.link_source != "measured":
            self._outside[peer] = min(max(float(quality), 0.0), 1.0) if quality == quality else 0.0  # NaN: no link
            if peer in self.peers:
                self._set_link(peer, self._outside[peer], now_ns)

    def _judge_links(self, now_ns: int) -> None:
        if self._station.config.link_source == "measured":
            for peer, quality in self.links.update(now_ns).items():
                if peer in self.peers:
                    self._set_link(peer, quality, now_ns)

    def _set_link(self, peer: str, quality: float, now_ns: int) -> None:
        config, rendezvous = self._station.config, self._station.rendezvous
        changed = rendezvous.on_quality(peer, quality, now_ns)
        told = self._told.get(peer)
        if changed or told is None or abs(quality - told) >= max(config.link_step, 1e-9):
            self._told[peer] = quality
            self._station.out.emit(fx.LinkChanged(peer, quality, rendezvous.peers[peer].state))
        if quality <= 0.0 and config.link_source != "measured":
            self._abort(peer, "link lost", now_ns)
