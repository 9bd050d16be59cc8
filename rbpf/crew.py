"""Threads of one mapper: one task in the background, and particles shared among whoever has nothing else to do."""

from __future__ import annotations

import os
import sys
import threading
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from itertools import pairwise
from typing import Any, Generic, TypeVar

T = TypeVar("T")

PARTS = 4
"""A shared job is cut into so many parts for each thread: who comes late still finds some."""
HAND_OVER_S = 1e-4
"""A thread that needs the interpreter waits no longer for another to let go of it (Python's own: 5 ms)."""


def hand_over_quickly() -> None:
    """Shorten the interpreter's switch interval for this process, which is to do nothing but map.

    Where other threads have much to do in Python (an agent under a flood of messages) they would hold up the mapper's.
    """
    sys.setswitchinterval(HAND_OVER_S)


class Pending(Generic[T]):
    """What a background task will return, or has returned."""

    def __init__(self, crew: Crew | None, future: Future[T]) -> None:
        self._crew, self._future = crew, future

    @classmethod
    def done(cls, value: T) -> Pending[T]:
        """Return one that is there already."""
        future: Future[T] = Future()
        future.set_result(value)
        return cls(None, future)

    def result(self) -> T:
        """Return it; meanwhile this thread takes its share of the work. Raises what the task raised."""
        if self._crew is not None:
            self._crew.help_until_done(self._future)
        return self._future.result()


class Crew:
    """Does one task at a time beside the thread that asked for it; results must not depend on who does what."""

    def __init__(self, threads: int) -> None:
        """Use ``threads`` threads with the caller's, or as many as there are cores if 0; alone, do all at once."""
        self.threads = threads or len(os.sched_getaffinity(0))
        self._pool = ThreadPoolExecutor(self.threads - 1, thread_name_prefix="rbpf") if self.threads > 1 else None
        self._news = threading.Condition()
        self._shared: _Shared | None = None
        self._task: Future[Any] | None = None

    @property
    def is_idle(self) -> bool:
        """Whether there is another thread, and it has nothing to do."""
        return self._pool is not None and (self._task is None or self._task.done())

    def both(self, one: Callable[[], T], other: Callable[[], T]) -> tuple[T, T]:
        """Return what both return, doing the one here and the other beside it; an idle crew only."""
        assert self._pool is not None
        beside = self._pool.submit(other)
        return one(), beside.result()

    def begin(self, task: Callable[[], T]) -> Pending[T]:
        """Begin a task; the one before must be done."""
        if self._pool is None:
            return Pending.done(task())
        self._task = future = self._pool.submit(task)
        future.add_done_callback(self._tell)
        return Pending(self, future)

    def share(
        self,
        job: Callable[[int, int], None],
        count: int,
        *,
        before: Callable[[], None] | None = None,
        beside: Callable[[], None] | None = None,
    ) -> None:
        """Call ``job(first, last)`` for ranges that together are ``0 .. count - 1``, and wait for all of them.

        ``before`` is called before them; ``beside`` at any time, by anyone, and must not care for what the others do.
        """
        if self._pool is None:
            for alone in (beside, before):
                if alone is not None:
                    alone()
            job(0, count)
            return
        shared = self._shared = _Shared()
        if beside is not None:
            self._put([beside])
        if before is not None:
            before()
        parts = min(PARTS * self.threads, count)
        bounds = [count * k // parts for k in range(parts + 1)]
        self._put([partial(job, first, last) for first, last in pairwise(bounds)])
        for _ in range(self.threads - 2):  # one is here, and the caller's comes when it waits
            self._pool.submit(shared.work)
        shared.work()
        shared.wait()
        self._shared = None

    def _put(self, parts: Sequence[Callable[[], None]]) -> None:
        """Offer parts of what is shared to whoever has nothing else to do."""
        assert self._shared is not None
        self._shared.put(parts)
        with self._news:
            self._news.notify_all()

    def help_until_done(self, task: Future[T]) -> None:
        """Work on what is shared until the task is done."""
        while True:
            with self._news:
                self._news.wait_for(lambda: task.done() or (self._shared is not None and self._shared.is_left))
                shared = self._shared
            if task.done():
                return
            if shared is not None:
                shared.work()

    def _tell(self, _: Future[T]) -> None:
        with self._news:
            self._news.notify_all()


class _Shared:
    """A job in parts."""

    def __init__(self) -> None:
        self._parts: deque[Callable[[], None]] = deque()
        self._undone = 0
        self._errors: list[BaseException] = []
        self._news = threading.Condition()

    def put(self, parts: Sequence[Callable[[], None]]) -> None:
        """Add parts."""
        with self._news:
            self._parts.extend(parts)
            self._undone += len(parts)

    @property
    def is_left(self) -> bool:
        """Whether there is a part that nobody has taken."""
        return bool(self._parts)

    def work(self) -> None:
        """Do parts until none is left."""
        while True:
            with self._news:
                if not self._parts:
                    return
                part = self._parts.popleft()
            try:
                part()
            except BaseException as error:  # noqa: BLE001 - told by `wait` to who shared the job
                self._errors.append(error)
            with self._news:
                self._undone -= 1
                self._news.notify_all()

    def wait(self) -> None:
        """Wait for all parts; raise what one of them raised."""
        with self._news:
            self._news.wait_for(lambda: self._undone == 0)
        if self._errors:
            raise self._errors[0]
