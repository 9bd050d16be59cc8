"""The network: discovery, link quality, rendezvous, and an exchange of maps that loses nothing."""

from mrslam.comms.config import CommsConfig
from mrslam.comms.effects import (
    Dropped,
    DuplicateId,
    Effect,
    ExchangeCosts,
    ExchangeDone,
    ExchangeFailed,
    ExchangeStarted,
    LinkChanged,
    MapUpdated,
    PeerGone,
    PeerSeen,
    Send,
    TeammateClaim,
    TeammateHint,
    TeammatePose,
)
from mrslam.comms.maps.persistence import restore_store, store_state
from mrslam.comms.maps.seal import MapSeal
from mrslam.comms.node import CommsNode
from mrslam.comms.security.team_keys import WARN_DAYS, RobotKeys, load_keys, make_team_keys, own_keys, revoke_robots
from mrslam.comms.status.report import PeerStatus, status_report, team_status
from mrslam.comms.status.team_view import TeamView
from mrslam.comms.transport.base import Incoming, PeerJoined, PeerLeft, Sighting, Transport, TransportEvent
from mrslam.comms.transport.memory import Conditions, LinkConditions, MemoryNetwork, MemoryTransport
from mrslam.comms.warm_up import warm_up
from mrslam.comms.wire.fields import SAVED_NAME, is_saved

__all__ = [
    "SAVED_NAME",
    "WARN_DAYS",
    "CommsConfig",
    "CommsNode",
    "Conditions",
    "Dropped",
    "DuplicateId",
    "Effect",
    "ExchangeCosts",
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
    "Sighting",
    "TeamView",
    "TeammateClaim",
    "TeammateHint",
    "TeammatePose",
    "Transport",
    "TransportEvent",
    "is_saved",
    "load_keys",
    "make_team_keys",
    "own_keys",
    "restore_store",
    "revoke_robots",
    "status_report",
    "store_state",
    "team_status",
    "warm_up",
]
