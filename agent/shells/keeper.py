"""Periodic checkpoints, written on another thread: a robot that crashes loses seconds, not its map."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

from mrslam.agent import checkpoint
from mrslam.agent.core import Agent
from mrslam.agent.effects import Event

log = logging.getLogger(__name__)

UNSAVED = "%s: the robot's state cannot be saved (%s); a robot that starts again resumes from an older one, if any"
FIRST_SHARE = 0.2
"""Share of ``checkpoint_interval_s`` until the first save, so that a robot that crashes repeatedly makes progress."""


class Inline(Executor):
    """Runs every job at once, in the caller's turn: what virtual time needs."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Run the job and return its outcome."""
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except OSError as error:
            future.set_exception(error)
        return future


class Keeper:
    """Saves one robot every few seconds; a failure is reported and logged once, and the save tried again."""

    def __init__(self, path: Path, interval_s: float, executor: Executor | None = None) -> None:
        """Save to ``path`` every ``interval_s``, by default in a thread of its own."""
        self.path = path
        self.failures = 0
        """Number of times the file could not be written."""
        self.saved_ns: int | None = None
        """Mission time of the state that is in the file."""
        self.frozen_ns = 0
        """Mission time of the state that was last handed to the writer."""
        self._interval_ns = round(interval_s * 1e9)
        self._due_ns: int | None = None
        self._trouble: str | None = None
        self._executor = executor or ThreadPoolExecutor(1, thread_name_prefix="checkpoint")
        self._writing: Future[None] | None = None

    def look(self, agent: Agent, clock_ns: int, now_ns: int) -> list[Event]:
        """Save when due by ``clock_ns`` (any growing clock); return events where saving fails or works again."""
        events = self._ended(now_ns)
        if self._due_ns is None:
            self._due_ns = clock_ns + round(FIRST_SHARE * self._interval_ns)
        if clock_ns >= self._due_ns and self._writing is None:
            self._due_ns = clock_ns + self._interval_ns
            self.frozen_ns = now_ns
            self._writing = self._executor.submit(checkpoint.write, checkpoint.freeze(agent, now_ns), self.path)
        return events

    def _ended(self, now_ns: int) -> list[Event]:
        """Look at the last writing where it has ended; return an event where things got worse or better."""
        if self._writing is None or not self._writing.done():
            return []
        error, self._writing = self._writing.exception(), None
        if error is not None and not isinstance(error, OSError):
            raise error
        trouble = None if error is None else str(error)
        self.failures += trouble is not None
        if trouble is None:
            self.saved_ns = self.frozen_ns
        changed, self._trouble = trouble != self._trouble, trouble
        if not changed:
            return []
        if trouble is None:
            return [Event(now_ns, "checkpoint_works_again")]
        log.warning(UNSAVED, self.path, trouble)
        return [Event(now_ns, "checkpoint_failed", {"reason": trouble})]

    def close(self, agent: Agent, now_ns: int) -> None:
        """Wait for the last writing, and save the end; a failure is counted and logged."""
        self._executor.shutdown(wait=True)
        try:
            checkpoint.write(checkpoint.freeze(agent, now_ns, is_last=True), self.path)
        except OSError as error:
            self.failures += 1
            log.warning(UNSAVED, self.path, error)
