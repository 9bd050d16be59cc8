"""One robot: the deterministic core that wires mapper, network, alignment and team map, and the shells that run it."""

from agent.body import Body, Sensed
from agent.clock import MissionClock
from agent.config import AgentConfig, Settings
from agent.core import Agent
from agent.effects import AlignJob, Effect, Event
from agent.outputs import write_robot
from agent.process import ProcessShell
from agent.runner import LinkSource, Runner
from agent.virtual import VirtualRobot, run_virtual

__all__ = [
    "Agent",
    "AgentConfig",
    "AlignJob",
    "Body",
    "Effect",
    "Event",
    "LinkSource",
    "MissionClock",
    "ProcessShell",
    "Runner",
    "Sensed",
    "Settings",
    "VirtualRobot",
    "run_virtual",
    "write_robot",
]
