"""Sessions: the state of a robot in a file, to which it can return; and which agent a node runs."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from mrslam.agent import Agent, checkpoint, resume
from mrslam.sim_driver.missions.run_files import CHECKPOINT
from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import unused

FOLDER, SUFFIX = "sessions", ".session"
"""Folder of the sessions in the robot's, and what their names end with."""


class Sessions:
    """The agents that one node runs one after another, and their states in files."""

    def __init__(self, folder: Path, make: Callable[[], Agent]) -> None:
        """``folder`` : the robot's; ``make()`` : a new agent without a map."""
        self.folder = folder / FOLDER
        self.make = make
        self._checkpoint = folder / CHECKPOINT
        self._next: Agent | None = None

    @property
    def is_over(self) -> bool:
        """Whether the running agent is to end, for another takes its place."""
        return self._next is not None

    def take_next(self) -> Agent | None:
        """Return the agent that follows the ended one, if one does; its checkpoint becomes a session."""
        agent, self._next = self._next, None
        if agent is not None and self._checkpoint.exists():
            self._checkpoint.replace(self.new_path())
        return agent

    def new_path(self) -> Path:
        """Return an unused name of a session, by the time."""
        self.folder.mkdir(parents=True, exist_ok=True)
        return unused(self.folder / f"{time.strftime('%Y-%m-%dT%H-%M-%S')}{SUFFIX}")

    def newest(self) -> Path:
        """Return the session that was saved last; raise ``InputError`` where there is none."""
        found = sorted(self.folder.glob(f"*{SUFFIX}"), key=lambda path: (path.stat().st_mtime_ns, path.name))
        if not found:
            raise InputError(f"{self.folder}: holds no session; save one first (save_session)")
        return found[-1]

    def save(self, agent: Agent) -> Path:
        """Save the agent's state as a session, on its own thread; return the file."""
        path = self.new_path()
        checkpoint.write(checkpoint.freeze(agent), path)
        return path

    def load(self, path: Path) -> Agent:
        """Have an agent with a saved state take the running one's place; raise ``InputError`` for an unfit file.

        However much the running one has published since, the loaded map is another one to teammates.
        """
        agent = self.make()
        resume(agent, path)
        self._next = agent
        return agent

    def reset(self) -> None:
        """Have an agent without a map take the running one's place."""
        self._next = self.make()
