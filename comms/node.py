"""The network core of one robot: bytes, times and own maps in, effects out. No I/O, no clock, no global state."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass
from hashlib import blake2b

import numpy as np

from mrslam.comms import effects as fx
from mrslam.comms.config import MODES, CommsConfig
from mrslam.comms.exchange.exchanges import Exchanges
from mrslam.comms.exchange.rendezvous import Rendezvous
from mrslam.comms.exchange.station import Station
from mrslam.comms.maps.seal import MapSeal
from mrslam.comms.maps.store import MapStore
from mrslam.comms.neighbours.neighbourhood import Neighbourhood
from mrslam.comms.transport.base import Arrival, Incoming, PeerJoined, PeerLeft
from mrslam.comms.wire.frames import WireError, check_name, team_tag
from mrslam.comms.wire.messages import AnyMessage, Beacon, Bye, Message, Open, Status, decode, encode
from mrslam.spatial import LocalMap
from mrslam.spatial.errors import require
from mrslam.spatial.se2 import Transform


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
        self.store = MapStore(robot_id, self.boot_id, self.config)
        name_seed = int.from_bytes(blake2b(robot_id.encode(), digest_size=8).digest(), "little")
        self.rendezvous = Rendezvous(robot_id, self.config, np.random.default_rng([seed, name_seed]))
        self.dropped: Counter[str] = Counter()
        """Bad messages, by what was bad."""
        self.totals: defaultdict[str, Totals] = defaultdict(Totals)
        """What the exchanges with each peer cost so far."""
        self.bytes_sent: Counter[str] = Counter()
        """Bytes sent on each lane: beacons are apart from control and bulk, which the exchanges count."""
        self.team_tag = team_tag(team)
        self._out: list[fx.Effect] = []
        station = Station(
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
        self._exchanges = Exchanges(station)
        self._around = Neighbourhood(station, self._exchanges.abort)
        self.peers, self.links = self._around.peers, self._around.links

    def uptime_ms(self, now_ns: int) -> int:
        """Return for how long this robot has been up."""
        return self._around.uptime_ms(now_ns)

    @property
    def must_stop(self) -> bool:
        """Whether another live process had this robot's id before."""
        return self._around.must_stop

    # -- in --------------------------------------------------------------------------------------------------------

    def seal_maps(self, seal: MapSeal) -> None:
        """Sign the own maps from now on, and take only maps that bear their own robot's signature."""
        self.store.use_seal(seal)

    def publish(self, local_map: LocalMap, now_ns: int) -> bool:
        """Take the own newest map; return whether it is news. It is in ``store.maps`` under the own id at once."""
        return self.store.publish(local_map)

    def begin_map(self) -> None:
        """Say that what is published next is another map, whose frame has nothing to do with the last one's."""
        self.store.begin_map()

    def set_own_pose(self, T_map_base: Transform, stamp_ns: int) -> None:
        """Tell where the robot is in its own map, and when it was (same clock as ``now_ns``); beacons carry it."""
        self._around.set_own_pose(T_map_base, stamp_ns)

    def set_link_quality(self, peer: str, quality: float, now_ns: int) -> list[fx.Effect]:
        """Tell a link's quality (0..1) from a radio model or a trace; without effect where links are measured."""
        self._around.set_link_quality(peer, quality, now_ns)
        return self._flush()

    def on_peer_joined(self, peer: str, now_ns: int) -> list[fx.Effect]:
        """A teammate's liveliness token is up."""
        self._around.on_token(peer, now_ns)
        return self._flush()

    def on_peer_left(self, peer: str, now_ns: int) -> list[fx.Effect]:
        """A teammate's liveliness token is gone, and it did not say goodbye."""
        self._around.lose(peer, "lost: its process or its link is gone", now_ns)
        return self._flush()

    def on_tick(self, now_ns: int) -> list[fx.Effect]:
        """Send beacons, judge links, notice who is gone, open and look after exchanges. Call it about every 0.1 s."""
        self._around.on_tick(now_ns)
        self._exchanges.on_tick(now_ns)
        if not self.must_stop:
            for peer in self.rendezvous.due(now_ns, self._is_worth):
                self._exchanges.open(peer, now_ns)
        return self._flush()

    def on_message(self, payload: bytes, now_ns: int, sender: str | None = None) -> list[fx.Effect]:
        """Take a message; ``sender`` is who the transport says it is from. A bad one is counted and dropped."""
        claimed = sender
        try:
            message = decode(payload, self.team_tag, self.config.max_message_bytes)
            claimed = message.sender
            if sender is not None and sender != message.sender:
                claimed = sender
                raise WireError("misattributed", f"{message.sender!r} from {sender!r}")
            self._dispatch(message, len(payload), now_ns)
        except WireError as error:
            self._count_drop(error.kind, claimed)
        return self._flush()

    def on_arrival(self, arrival: Arrival, now_ns: int) -> list[fx.Effect]:
        """Take whatever a transport brings."""
        match arrival:
            case Incoming():
                return self.on_message(arrival.payload, now_ns, arrival.sender)
            case PeerJoined():
                return self.on_peer_joined(arrival.peer, now_ns)
            case PeerLeft():
                return self.on_peer_left(arrival.peer, now_ns)

    def leave(self) -> list[fx.Effect]:
        """Say goodbye to all."""
        self._post(Bye(self.robot_id, self.boot_id), None, "control")
        return self._flush()

    def _dispatch(self, message: AnyMessage, size: int, now_ns: int) -> None:
        if message.sender == self.robot_id:
            if isinstance(message, Beacon) and message.boot != self.boot_id:
                self._around.on_twin(message, now_ns)
            return
        match message:
            case Beacon():
                self._around.on_beacon(message, now_ns)
            case Bye():
                known = self.peers.get(message.sender)
                if known is not None and known.boot in (0, message.boot):
                    self._around.lose(message.sender, "left", now_ns)
            case Status():
                return  # for those who watch
            case Open():
                self._exchanges.on_open(message, size, now_ns)
            case _:
                self._exchanges.on_message(message, size, now_ns)

    def _takes_maps(self, peer: str) -> bool:
        known = self.peers.get(peer)
        return known is None or MODES[known.mode] != "mapper"

    def _is_worth(self, peer: str) -> bool:
        """Two robots that both only give maps have nothing to tell each other; one not heard yet may be such a one."""
        known = self.peers.get(peer)
        return known is not None and known.boot != 0 and not (self.mode == MODES[known.mode] == "mapper")

    # -- out -------------------------------------------------------------------------------------------------------

    def _post(self, message: Message, to: str | None, lane: fx.Lane) -> int:
        payload = encode(message, self.team_tag)
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
    """Return a boot id as a number in 1..2^61; text is hashed."""
    if isinstance(boot_id, str):
        boot_id = int.from_bytes(blake2b(boot_id.encode(), digest_size=8).digest(), "little") >> 3
    return min(max(int(boot_id), 1), 2**61)
