"""One robot: the deterministic core that wires mapper, network, alignment and team map, and the shells that run it."""

from mrslam.agent.checkpoint import resume
from mrslam.agent.config import AgentConfig, Settings
from mrslam.agent.core import Agent
from mrslam.agent.effects import AlignJob, Effect, Event
from mrslam.agent.known_map import KnownMap
from mrslam.agent.saved_maps import Whereabouts, check_saved_id
from mrslam.agent.shells.body import Body, Sensed
from mrslam.agent.shells.clock import Clock, Counter, SharedClock, WallClock
from mrslam.agent.shells.keeper import Inline, Keeper
from mrslam.agent.shells.outputs import write_robot
from mrslam.agent.shells.process import ProcessShell
from mrslam.agent.shells.runner import LinkSource, Runner
from mrslam.agent.shells.saved_files import read_saved_maps
from mrslam.agent.shells.sensors import SensorBody
from mrslam.agent.shells.virtual import TakesTurns, VirtualRobot, run_virtual
from mrslam.agent.shells.watcher import Watcher

__all__ = [
    "Agent",
    "AgentConfig",
    "AlignJob",
    "Body",
    "Clock",
    "Counter",
    "Effect",
    "Event",
    "Inline",
    "Keeper",
    "KnownMap",
    "LinkSource",
    "ProcessShell",
    "Runner",
    "Sensed",
    "SensorBody",
    "Settings",
    "SharedClock",
    "TakesTurns",
    "VirtualRobot",
    "WallClock",
    "Watcher",
    "Whereabouts",
    "check_saved_id",
    "read_saved_maps",
    "resume",
    "run_virtual",
    "write_robot",
]
