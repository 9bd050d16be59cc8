"""The network: discovery, link quality, rendezvous, and an exchange of maps that loses nothing."""

import spatial  # noqa: F401  (points numba's cache at the right folder)
from comms.config import CommsConfig
from comms.effects import (
    Dropped,
    DuplicateId,
    Effect,
    ExchangeDone,
    ExchangeFailed,
    ExchangeStarted,
    LinkChanged,
    MapUpdated,
    PeerGone,
    PeerSeen,
    Send,
    TeammatePose,
)
from comms.memory_transport import Conditions, LinkConditions, MemoryNetwork, MemoryTransport
from comms.node import CommsNode
from comms.persistence import restore_store, store_state
from comms.seal import MapSeal
from comms.security import RobotKeys, load_keys, make_team_keys, own_keys
from comms.status import PeerStatus, status_report, team_status
from comms.team_view import TeamView
from comms.transport import Arrival, Incoming, PeerJoined, PeerLeft, Sighting, Transport
from comms.warm_up import warm_up
from comms.zenoh_sensors import SensorPublisher, ZenohSensors
from comms.zenoh_transport import ZenohTransport
from comms.zenoh_watcher import ZenohWatcher

__all__ = [
    "Arrival",
    "CommsConfig",
    "CommsNode",
    "Conditions",
    "Dropped",
    "DuplicateId",
    "Effect",
    "ExchangeDone",
    "ExchangeFailed",
    "ExchangeStarted",
    "Incoming",
    "LinkChanged",
    "LinkConditions",
    "MapSeal",
    "MapUpdated",
    "MemoryNetwork",
    "MemoryTransport",
    "PeerGone",
    "PeerJoined",
    "PeerLeft",
    "PeerSeen",
    "PeerStatus",
    "RobotKeys",
    "Send",
    "SensorPublisher",
    "Sighting",
    "TeamView",
    "TeammatePose",
    "Transport",
    "ZenohSensors",
    "ZenohTransport",
    "ZenohWatcher",
    "load_keys",
    "make_team_keys",
    "own_keys",
    "restore_store",
    "status_report",
    "store_state",
    "team_status",
    "warm_up",
]
