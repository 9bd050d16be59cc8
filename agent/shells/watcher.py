"""Observers of a running robot: recorders and viewers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from mrslam.agent.effects import Event
from mrslam.agent.shells.body import Sensed

if TYPE_CHECKING:
    from mrslam.agent.core import Agent


class Watcher(Protocol):
    """Is called with what happens and must not change it; it must return at once and never raise."""

    def on_scan(self, agent: Agent, sensed: Sensed, now_ns: int) -> None:
        """Take a scan that the agent has just mapped (``agent.scan`` is what was left of it without teammates)."""

    def on_event(self, agent: Agent, event: Event) -> None:
        """Take an event that was just written."""

    def close(self, agent: Agent, now_ns: int) -> None:
        """The robot is about to write its files."""
