"""The network core of one robot: bytes, times and own maps in, effects out. No I/O, no clock, no global state."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass
from hashlib import blake2b

import numpy as np

from comms import effects as fx
from comms.config import MODES, CommsConfig
from comms.exchanges import Exchanges
from comms.frames import WireError, check_name, team_tag
from comms.keyframe_codec import SCALE, quantise
from comms.link_quality import LinkMonitor
from comms.messages import Accept, Ask, Beacon, Bye, Chunk, Done, Get, Manifest, Message, Open, Refuse, decode, encode
from comms.presence import Peer, TwinWatch, am_newcomer
from comms.rendezvous import Rendezvous
from comms.store import MapStore
from spatial import LocalMap
from spatial.errors import require
from spatial.se2 import Transform


@dataclass
class Totals:
    """Sums over the exchanges with one peer, bytes."""

    sent: int = 0
    received: int = 0
    full_lz4: int = 0
    full_raw: int = 0

    def add(self, ended: fx.ExchangeDone | fx.ExchangeFailed) -> None:
        """Count one exchange; a failed one cost its bytes and replaces no whole map."""
        self.sent += ended.bytes_sent
        self.received += ended.bytes_received
        if isinstance(ended, fx.ExchangeDone):
            self.full_lz4 += ended.bytes_full_lz4
            self.full_raw += ended.bytes_full_raw


class CommsNode:
    """Finds teammates, judges links, meets, and exchanges maps."""

    def __init__(
        self,
        robot_id: str,
        team: str,
        boot_id: int | str,
        config: CommsConfig | None = None,
        mode: str = "distributed",
        seed: int = 0,
    ) -> None:
        """Make a node that knows nobody.

        ``boot_id``: different at every start of the robot; best a number that grows (a start time), so that teammates
        prefer the newer map even before the robot has met them. ``mode``: "distributed", "mapper" (gives its map,
        takes none) or "central" (takes maps, has none). Raises ``InputError`` for a bad name or mode.
        """
        require(mode in MODES, "mode", f"one of {', '.join(MODES)}", mode)
        self.robot_id, self.team = check_name(robot_id, "robot id"), check_name(team, "team name")
        self.boot_id = boot_number(boot_id)
        self.config = config or CommsConfig()
        self.mode = mode
        self.must_stop = False
        """Set when another live process had this robot's id before."""
        self.store = MapStore(robot_id, self.boot_id, self.config)
        name_seed = int.from_bytes(blake2b(robot_id.encode(), digest_size=8).digest(), "little")
        self.rendezvous = Rendezvous(robot_id, self.config, np.random.default_rng([seed, name_seed]))
        self.links = LinkMonitor(self.config)
        self.peers: dict[str, Peer] = {}
        self.dropped: Counter[str] = Counter()
        self.totals: defaultdict[str, Totals] = defaultdict(Totals)
        """What the exchanges with each peer cost so far."""
        self.bytes_sent: Counter[str] = Counter()
        """Bytes sent on each lane."""
        self._tag = team_tag(team)
        self._out: list[fx.Effect] = []
        self._exchanges = Exchanges(
            robot_id,
            self.boot_id,
            mode,
            self.config,
            self.store,
            self.rendezvous,
            self._post,
            self._emit,
            self._takes_maps,
        )
        self._twins = TwinWatch()
        self._told: dict[str, float] = {}  # link quality as last recorded
        self._outside: dict[str, float] = {}  # link quality from a model or trace
        self._seq = 0
        self._started_ns: int | None = None
        self._beacon_ns: int | None = None
        self._pose: tuple[int, int, int, int] | None = None

    # -- in --------------------------------------------------------------------------------------------------------

    def publish(self, local_map: LocalMap, now_ns: int) -> bool:
        """Take the own newest map; return whether it is news. It is in ``store.maps`` under the own id at once."""
        return self.store.publish(local_map)

    def set_own_pose(self, T_map_base: Transform, stamp_ns: int) -> None:
        """Tell where the robot is in its own map, and when it was (same clock as ``now_ns``); beacons carry it."""
        x, y, theta = (int(v) for v in quantise(np.asarray(T_map_base, dtype=np.float64)))
        self._pose = (x, y, theta, int(stamp_ns))

    def set_link_quality(self, peer: str, quality: float, now_ns: int) -> list[fx.Effect]:
        """Tell a link's quality (0..1) from a radio model or a trace; without effect where links are measured."""
        if self.config.link_source != "measured":
            self._outside[peer] = float(np.clip(np.nan_to_num(quality), 0.0, 1.0))
            if peer in self.peers:
                self._set_link(peer, self._outside[peer], now_ns)
        return self._flush()

    def on_peer_joined(self, peer: str, now_ns: int) -> list[fx.Effect]:
        """A teammate's liveliness token is up."""
        if peer != self.robot_id:
            known = self.peers.get(peer)
            if known is None:
                known = self._see(peer, Peer(heard_ns=now_ns), now_ns)
            known.has_token = True
        return self._flush()

    def on_peer_left(self, peer: str, now_ns: int) -> list[fx.Effect]:
        """A teammate's liveliness token is gone."""
        if peer in self.peers:
            self._lose(peer, "left", now_ns)
        return self._flush()

    def on_tick(self, now_ns: int) -> list[fx.Effect]:
        """Send beacons, judge links, notice who is gone, open and look after exchanges. Call it about every 0.1 s."""
        if self._started_ns is None:
            self._started_ns = now_ns
        if self._beacon_ns is None or now_ns >= self._beacon_ns:
            self._send_beacon(now_ns)
            if self.config.link_source == "measured":
                for peer, quality in self.links.update(now_ns).items():
                    if peer in self.peers:
                        self._set_link(peer, quality, now_ns)
        limit_ns = self.config.peer_timeout_s * 1e9
        for peer, known in list(self.peers.items()):
            if not known.has_token and now_ns - known.heard_ns > limit_ns:
                self._lose(peer, f"silent for {self.config.peer_timeout_s:g} s", now_ns)
        self._exchanges.on_tick(now_ns)
        if not self.must_stop:
            for peer in self.rendezvous.due(now_ns):
                if peer in self.peers and not self._is_pointless(peer):
                    self._exchanges.open(peer, now_ns)
        return self._flush()

    def on_message(self, payload: bytes, now_ns: int, sender: str | None = None) -> list[fx.Effect]:
        """Take a message; ``sender`` is who the transport says it is from. A bad one is counted and dropped."""
        claimed = sender
        try:
            message = decode(payload, self._tag, self.config.max_message_bytes)
            claimed = message.sender
            if sender is not None and sender != message.sender:
                claimed = sender
                raise WireError("misattributed", f"{message.sender!r} from {sender!r}")
            self._dispatch(message, len(payload), now_ns)
        except WireError as error:
            self._count_drop(error.kind, claimed)
        return self._flush()

    def leave(self) -> list[fx.Effect]:
        """Say goodbye to all."""
        self._post(Bye(self.robot_id, self.boot_id), None, "control")
        return self._flush()

    # -- messages --------------------------------------------------------------------------------------------------

    def _dispatch(self, message: Message, size: int, now_ns: int) -> None:
        if message.sender == self.robot_id:
            if isinstance(message, Beacon) and message.boot != self.boot_id:
                self._meet_twin(message, now_ns)
            return
        match message:
            case Beacon():
                self._on_beacon(message, now_ns)
            case Bye():
                known = self.peers.get(message.sender)
                if known is not None and known.boot in (0, message.boot):
                    self._lose(message.sender, "left", now_ns)
            case Open():
                self._exchanges.on_open(message, size, now_ns)
            case Accept():
                self._exchanges.on_accept(message, size, now_ns)
            case Refuse():
                self._exchanges.on_refuse(message, size, now_ns)
            case Ask():
                self._exchanges.on_ask(message, size, now_ns)
            case Manifest():
                self._exchanges.on_manifest(message, size, now_ns)
            case Get():
                self._exchanges.on_get(message, size, now_ns)
            case Chunk():
                self._exchanges.on_chunk(message, size, now_ns)
            case Done():
                self._exchanges.on_done(message, size, now_ns)

    def _on_beacon(self, beacon: Beacon, now_ns: int) -> None:
        peer = beacon.sender
        known = self.peers.get(peer)
        if known is None:
            if len(self.peers) >= self.config.max_robots:
                raise WireError("too many robots")
            known = self._see(peer, Peer(boot=beacon.boot, mode=beacon.mode), now_ns)
        elif known.boot != beacon.boot:
            if beacon.boot in known.past_boots:
                return  # a late echo of its past life
            if known.boot:
                past = (*known.past_boots[-3:], known.boot)
                self._lose(peer, "restarted", now_ns)
                self.rendezvous.on_restart(peer)
                known = self._see(peer, Peer(boot=beacon.boot, past_boots=past, has_token=known.has_token), now_ns)
            known.boot = beacon.boot
        known.mode = beacon.mode
        known.heard_ns = max(known.heard_ns, now_ns)
        period_ns = beacon.period_ms * 1_000_000
        self.links.hear(peer, beacon.seq, beacon.uptime_ms * 1_000_000, period_ns, beacon.heard, self.robot_id, now_ns)
        if beacon.seq > known.last_seq:
            known.last_seq = beacon.seq
            self._take_pose(known, beacon, now_ns)

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
            self._out.append(fx.TeammatePose(beacon.sender, stamp_ns, T_map_base, beacon.boot + beacon.bumps))

    def _meet_twin(self, beacon: Beacon, now_ns: int) -> None:
        if not self._twins.hear(beacon):
            return
        newcomer = am_newcomer(self._uptime_ms(now_ns), self.boot_id, beacon)
        self.must_stop |= newcomer
        self._out.append(fx.DuplicateId(self.robot_id, self.boot_id, beacon.boot, newcomer))

    # -- peers and links -------------------------------------------------------------------------------------------

    def _see(self, peer: str, known: Peer, now_ns: int) -> Peer:
        known.heard_ns = now_ns
        self.peers[peer] = known
        self._out.append(fx.PeerSeen(peer, known.boot, MODES[known.mode]))
        if peer in self._outside:
            self._set_link(peer, self._outside[peer], now_ns)
        return known

    def _lose(self, peer: str, reason: str, now_ns: int) -> None:
        self._exchanges.abort(peer, f"{peer} {reason}", now_ns)
        self._set_link(peer, 0.0, now_ns)
        del self.peers[peer]
        self._told.pop(peer, None)
        self.links.forget(peer)
        self.rendezvous.forget(peer)
        self._out.append(fx.PeerGone(peer, reason))

    def _set_link(self, peer: str, quality: float, now_ns: int) -> None:
        changed = self.rendezvous.on_quality(peer, quality, now_ns)
        told = self._told.get(peer)
        if changed or told is None or abs(quality - told) >= max(self.config.link_step, 1e-9):
            self._told[peer] = quality
            self._out.append(fx.LinkChanged(peer, quality, self.rendezvous.peers[peer].state))
        if quality <= 0.0 and self.config.link_source != "measured":
            self._exchanges.abort(peer, "link lost", now_ns)

    def _takes_maps(self, peer: str) -> bool:
        known = self.peers.get(peer)
        return known is None or MODES[known.mode] != "mapper"

    def _is_pointless(self, peer: str) -> bool:
        """Two robots that both only give maps have nothing to tell each other; one not heard yet may be such a one."""
        known = self.peers[peer]
        return known.boot == 0 or (self.mode == "mapper" and MODES[known.mode] == "mapper")

    # -- out -------------------------------------------------------------------------------------------------------

    def _uptime_ms(self, now_ns: int) -> int:
        return 0 if self._started_ns is None else max(now_ns - self._started_ns, 0) // 1_000_000

    def _send_beacon(self, now_ns: int) -> None:
        period_ns = round(self.config.beacon_period_s * 1e9)
        # Kept on its lattice, so that the pace does not depend on when ticks come; after a stall it starts anew.
        due_ns = now_ns if self._beacon_ns is None else self._beacon_ns
        self._beacon_ns = due_ns + period_ns if now_ns - due_ns < period_ns else now_ns + period_ns
        self._seq += 1
        beacon = Beacon(
            self.robot_id,
            self.boot_id,
            self._seq,
            self._uptime_ms(now_ns),
            max(round(self.config.beacon_period_s * 1e3), 1),
            MODES.index(self.mode),
            self.links.report(now_ns),
            self.store.own_epoch - self.boot_id,
            None if self._pose is None else (*self._pose[:3], max(now_ns - self._pose[3], 0) // 1_000_000),
        )
        self._post(beacon, None, "beacon")

    def _post(self, message: Message, to: str | None, lane: fx.Lane) -> int:
        payload = encode(message, self._tag)
        self.bytes_sent[lane] += len(payload)
        self._out.append(fx.Send(to, payload, lane))
        return len(payload)

    def _emit(self, effect: fx.Effect) -> None:
        if isinstance(effect, fx.ExchangeDone | fx.ExchangeFailed):
            self.totals[effect.peer].add(effect)
        self._out.append(effect)

    def _count_drop(self, kind: str, sender: str | None) -> None:
        self.dropped[kind] += 1
        count = self.dropped[kind]
        if count & (count - 1) == 0:  # told at 1, 2, 4, 8, ...
            self._out.append(fx.Dropped(kind, count, sender))

    def _flush(self) -> list[fx.Effect]:
        out, self._out = self._out, []
        return out


def boot_number(boot_id: int | str) -> int:
    """Return a boot id as a number in 1..2^62-1; text is hashed."""
    if isinstance(boot_id, str):
        boot_id = int.from_bytes(blake2b(boot_id.encode(), digest_size=8).digest(), "little") >> 3
    return min(max(int(boot_id), 1), 2**62 - 1)
