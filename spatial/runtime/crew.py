"""Threads of one mapper: one task in the background, and jobs in parts that idle threads share."""

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
"""Parts of a shared job for each thread: a thread that becomes idle late still finds some."""
HAND_OVER_S = 1e-4
"""Longest wait of a thread for the interpreter while another holds it, seconds (Python's own: 5 ms): far below the
time between two scans."""


def hand_over_quickly() -> None:
    """Shorten the interpreter's switch interval for this process, which must do nothing but map.

    Where other threads have much to do in Python (an agent under a flood of messages) they would hold up the mapper's.
    """
    sys.setswitchinterval(HAND_OVER_S)


class Pending(Generic[T]):
    """What a background task will return, or has returned."""

    def __init__(self, crew: Crew | None, future: Future[T]) -> None:
        self._crew, self._future = crew, future

    @classmethod
    def done(cls, value: T) -> Pending[T]:
        """Return one whose task is done."""
        future: Future[T] = Future()
        future.set_result(value)
        return cls(None, future)

    @property
    def is_done(self) -> bool:
        """Whether the task has ended."""
        return self._future.done()

    def result(self) -> T:
        """Wait for the task, working on shared jobs meanwhile; return its result, or raise what it raised."""
        if self._crew is not None:
            self._crew.help_until_done(self._future)
        return self._future.result()


class Crew:
    """Runs one task at a time beside the calling thread; results must not depend on which thread does what."""

    def __init__(self, threads: int) -> None:
        """Use ``threads`` threads, the caller's included, or one a core if 0; with one, tasks run at once."""
        self.threads = threads or len(os.sched_getaffinity(0))
        self._pool = ThreadPoolExecutor(self.threads - 1, thread_name_prefix="rbpf") if self.threads > 1 else None
        self._news = threading.Condition()
        self._shared: _Shared | None = None
        self._task: Future[Any] | None = None

    @property
    def is_idle(self) -> bool:
        """Whether there is another thread, and it is idle."""
        return self._pool is not None and (self._task is None or self._task.done())

    def both(self, one: Callable[[], T], other: Callable[[], T]) -> tuple[T, T]:
        """Return the results of two functions, the second run on another thread; the crew must be idle."""
        assert self._pool is not None
        beside = self._pool.submit(other)
        return one(), beside.result()

    def begin(self, task: Callable[[], T]) -> Pending[T]:
        """Begin a task; the one before it must be done."""
        if self._pool is None:
            return Pending.done(task())
        self._task = future = self._pool.submit(task)
        future.add_done_callback(self._notify)
        return Pending(self, future)

    def share(
        self,
        job: Callable[[int, int], None],
        count: int,
        *,
        before: Callable[[], None] | None = None,
        beside: Callable[[], None] | None = None,
    ) -> None:
        """Call ``job(first, last)`` for ranges that together are ``0 .. count - 1``, on all threads, and wait for them.

        ``before`` is called before them; ``beside`` at any time and on any thread, so it must be independent of both.
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
        for _ in range(self.threads - 2):  # the task runs on one of the others, and the caller's joins when it waits
            self._pool.submit(shared.work)
        shared.work()
        shared.wait()
        self._shared = None

    def _put(self, parts: Sequence[Callable[[], None]]) -> None:
        """Offer parts of the shared job to idle threads."""
        assert self._shared is not None
        self._shared.put(parts)
        with self._news:
            self._news.notify_all()

    def help_until_done(self, task: Future[T]) -> None:
        """Work on shared jobs until the task is done."""
        while True:
            with self._news:
                self._news.wait_for(lambda: task.done() or (self._shared is not None and self._shared.is_left))
                shared = self._shared
            if task.done():
                return
            if shared is not None:
                shared.work()

    def _notify(self, _: Future[T]) -> None:
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
        """Whether there is a part that no thread has taken."""
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
            except BaseException as error:  # noqa: BLE001 - raised by `wait` in the thread that shared the job
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
