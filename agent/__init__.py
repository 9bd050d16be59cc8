"""One robot: the deterministic core that wires mapper, network, alignment and team map, and the shells that run it."""

from agent.body import Body, Sensed
from agent.checkpoint import resume
from agent.clock import Clock, Counter, SharedClock, WallClock
from agent.config import AgentConfig, Settings
from agent.core import Agent
from agent.effects import AlignJob, Effect, Event
from agent.keeper import Inline, Keeper
from agent.outputs import write_robot
from agent.process import ProcessShell
from agent.runner import LinkSource, Runner
from agent.sensors import SensorBody
from agent.virtual import TakesTurns, VirtualRobot, run_virtual
from agent.watcher import Watcher

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
    "resume",
    "run_virtual",
    "write_robot",
]
