"""Threads that share the particles among them."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


class Crew:
    """Does a job for a range of particles at a time; results must not depend on how they are shared."""

    def __init__(self, threads: int, particles: int) -> None:
        """Start ``threads`` threads, or as many as there are cores if 0, but no more than there are particles."""
        threads = min(threads or len(os.sched_getaffinity(0)), particles)
        self._threads = threads
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="rbpf") if threads > 1 else None

    def share(self, job: Callable[[int, int], None], count: int) -> None:
        """Call ``job(first, last)`` for ranges that together are ``0 .. count - 1``, and wait for all of them."""
        if self._pool is None:
            job(0, count)
            return
        bounds = [count * k // self._threads for k in range(self._threads + 1)]
        list(self._pool.map(job, bounds[:-1], bounds[1:]))
