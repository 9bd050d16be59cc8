"""The network core of one robot: bytes, times and own maps in, effects out. No I/O, no clock, no global state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from mrslam.comms import effects as fx
from mrslam.comms.config import MODES, CommsConfig
from mrslam.comms.exchange.context import ExchangeContext
from mrslam.comms.exchange.exchanges import Exchanges
from mrslam.comms.exchange.outgoing import Outgoing
from mrslam.comms.exchange.rendezvous import Rendezvous
from mrslam.comms.maps.seal import MapSeal
from mrslam.comms.maps.staged_maps import StagedMaps
from mrslam.comms.maps.store import MapStore
from mrslam.comms.neighbours.neighbourhood import Neighbourhood
from mrslam.comms.transport.base import Incoming, PeerJoined, PeerLeft, TransportEvent
from mrslam.comms.wire.frames import WireError, check_name
from mrslam.comms.wire.messages import AnyMessage, Beacon, Bye, Open, Status, decode
from mrslam.spatial import LocalMap
from mrslam.spatial.errors import require
from mrslam.spatial.se2 import Transform
from mrslam.spatial.tiles import MOST_CELLS, box_cells


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
        self.staged_maps = StagedMaps(self.store, self.config)
        name_seed = int.from_bytes(blake2b(robot_id.encode(), digest_size=8).digest(), "little")
        self.rendezvous = Rendezvous(robot_id, self.config, np.random.default_rng([seed, name_seed]))
        self._out = Outgoing(team)
        self.team_tag = self._out.team_tag
        self.dropped, self.totals, self.bytes_sent = self._out.dropped, self._out.totals, self._out.bytes_sent
        context = ExchangeContext(
            robot_id,
            self.boot_id,
            mode,
            self.config,
            self.store,
            self.staged_maps,
            self.rendezvous,
            self._out,
            self._takes_maps,
        )
        self._exchanges = Exchanges(context)
        self._neighbourhood = Neighbourhood(context, self._exchanges.abort)
        self.peers, self.links = self._neighbourhood.peers, self._neighbourhood.links.monitor

    def uptime_ms(self, now_ns: int) -> int:
        """Return how long this robot has been up, milliseconds."""
        return self._neighbourhood.beacons.uptime_ms(now_ns)

    @property
    def searching(self) -> set[str]:
        """Teammates in sight that map and search for others' maps: known by their beacons, a token tells no mode."""
        return {peer for peer, known in self.peers.items() if known.boot and MODES[known.mode] == "distributed"}

    @property
    def must_stop(self) -> bool:
        """Whether another live process had this robot's id before."""
        return self._neighbourhood.must_stop

    # -- from the robot --------------------------------------------------------------------------------------------

    def seal_maps(self, seal: MapSeal) -> None:
        """Sign the own maps from now on, and take only maps that bear their own robot's signature."""
        self.store.use_seal(seal)

    def publish(self, local_map: LocalMap, now_ns: int) -> fx.MapUpdated | None:
        """Take the own newest map; return it as teammates will get it, or None where its revision is not newer."""
        if not self.store.publish(local_map):
            return None
        version, whole = self.store.version(self.robot_id), self.store.maps[self.robot_id]
        return fx.MapUpdated(self.robot_id, *version, (), self.robot_id, whole)

    def give_saved(self, map_id: str, local_map: LocalMap, epoch: int) -> LocalMap:
        """Take a saved map to offer it to teammates, and return it as they will get it.

        One beyond the bounds that teammates keep (``comms.max_tiles``, ``max_keyframes``) is kept to oneself.
        """
        tiles, keyframes = local_map.map.tiles, local_map.keyframes.stamps_ns.size
        is_small = len(tiles) <= self.config.max_tiles and keyframes <= self.config.max_keyframes
        return self.store.give(map_id, local_map, epoch) if is_small and box_cells(tiles) <= MOST_CELLS else local_map

    def begin_map(self) -> None:
        """Start a new epoch: what is published next is another map, in a frame unrelated to the last one's."""
        self.store.begin_map()
        self._neighbourhood.beacons.forget()

    def set_own_pose(self, T_map_base: Transform, stamp_ns: int, bodies_m: NDArray[np.float64] | None = None) -> None:
        """Set where the robot is in its own map, and when it was (same clock as ``now_ns``); beacons carry it.

        ``bodies_m`` : ``(N, 2)``, metres, base frame: what it saw from there that may be a teammate.
        """
        self._neighbourhood.beacons.set_pose(T_map_base, stamp_ns, bodies_m)

    def add_claims(self, claims: Sequence[tuple[str, Transform, float, int]]) -> None:
        """Let the next beacons say what own sightings do.

        Each is robot, ``T_own_robot (3,)``, log-likelihood ratio in nats, epoch of the robot's map.
        """
        self._neighbourhood.beacons.add_claims(claims)

    def add_hints(self, hints: Sequence[tuple[str, Transform]]) -> None:
        """Let the next beacons say where maps of others were found in the own one: robot, ``T_own_robot (3,)``."""
        self._neighbourhood.beacons.add_hints(hints)

    def set_unplaced(self, robots: Sequence[str]) -> None:
        """Set whose maps the robot holds and has not placed; it says so in exchanges."""
        self._exchanges.unplaced = list(robots)

    @property
    def placed_by(self) -> Mapping[str, tuple[bool, int]]:
        """By teammate: whether it has placed the own map, by its last exchange with this robot; when, nanoseconds."""
        return self._exchanges.placed_by

    @property
    def sightings_bytes(self) -> int:
        """What sightings and hints in the own beacons have cost so far, bytes."""
        return self._neighbourhood.beacons.sightings_bytes

    def set_link_quality(self, peer: str, quality: float, now_ns: int) -> list[fx.Effect]:
        """Set a link's quality (0..1) from a radio model or a trace; without effect where links are measured."""
        self._neighbourhood.links.give(peer, quality, now_ns, is_here=peer in self.peers)
        return self._out.take()

    def on_tick(self, now_ns: int) -> list[fx.Effect]:
        """Send beacons, judge links, notice who is gone, open, repeat and end exchanges. Call it about every 0.1 s."""
        self._neighbourhood.on_tick(now_ns)
        self._exchanges.on_tick(now_ns)
        if not self.must_stop:
            for peer in self.rendezvous.due(now_ns, self._has_business_with):
                self._exchanges.open(peer, now_ns)
        return self._out.take()

    def leave(self) -> list[fx.Effect]:
        """Say goodbye to all."""
        self._out.post(Bye(self.robot_id, self.boot_id), None, "control")
        return self._out.take()

    # -- from the network ------------------------------------------------------------------------------------------

    def on_event(self, arrival: TransportEvent, now_ns: int) -> list[fx.Effect]:
        """Take whatever a transport brings."""
        match arrival:
            case Incoming():
                return self.on_message(arrival.payload, now_ns, arrival.sender)
            case PeerJoined():
                return self.on_peer_joined(arrival.peer, now_ns)
            case PeerLeft():
                return self.on_peer_left(arrival.peer, now_ns)

    def on_peer_joined(self, peer: str, now_ns: int) -> list[fx.Effect]:
        """A teammate's liveliness token is up."""
        self._neighbourhood.on_token(peer, now_ns)
        return self._out.take()

    def on_peer_left(self, peer: str, now_ns: int) -> list[fx.Effect]:
        """A teammate's liveliness token is gone, and it did not say goodbye."""
        self._neighbourhood.lose(peer, "lost: its process or its link is gone", now_ns)
        return self._out.take()

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
            self._out.drop(error.kind, claimed)
        return self._out.take()

    def _dispatch(self, message: AnyMessage, size: int, now_ns: int) -> None:
        if message.sender == self.robot_id:
            if isinstance(message, Beacon) and message.boot != self.boot_id:
                self._neighbourhood.on_duplicate_id(message, now_ns)
            return
        match message:
            case Beacon():
                self._neighbourhood.on_beacon(message, now_ns)
            case Bye():
                self._neighbourhood.on_bye(message, now_ns)
            case Status():
                return  # for watchers
            case Open():
                self._exchanges.on_open(message, size, now_ns)
            case _:
                self._exchanges.on_message(message, size, now_ns)

    # -- who exchanges what with whom ------------------------------------------------------------------------------

    def _takes_maps(self, peer: str) -> bool:
        """Return whether a peer takes maps; one whose mode is not known yet is taken for one that does."""
        known = self.peers.get(peer)
        return known is None or MODES[known.mode] != "mapper"

    def _has_business_with(self, peer: str) -> bool:
        """Return whether an exchange with a peer can bring a map to either side.

        Its first beacon must have come: until then its mode is unknown. Two "mapper" robots take no maps, so an
        exchange between them would be empty.
        """
        known = self.peers.get(peer)
        return known is not None and known.boot != 0 and not (self.mode == MODES[known.mode] == "mapper")


def boot_number(boot_id: int | str) -> int:
    """Return a boot id as a number in 1..2^61; text is hashed."""
    if isinstance(boot_id, str):
        boot_id = int.from_bytes(blake2b(boot_id.encode(), digest_size=8).digest(), "little") >> 3
    return min(max(int(boot_id), 1), 2**61)
