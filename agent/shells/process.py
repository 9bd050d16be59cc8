"""The process shell: one robot in one operating-system process, over a real transport.

Scans are never kept waiting by alignment: that runs on a worker thread of lower priority (its kernels and OpenCV
release the interpreter lock). The transport's callbacks only enqueue; everything an agent does happens on this one
loop.
"""

from __future__ import annotations

import contextlib
import os
import sys
import threading
import time
from array import array
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from mrslam.agent.effects import Event, Job, Outcome
from mrslam.agent.shells.body import Sensed
from mrslam.agent.shells.clock import Clock, WallClock
from mrslam.agent.shells.overload import Overload
from mrslam.agent.shells.runner import Runner
from mrslam.agent.shells.status import status_of

IDLE_S = 0.02
"""Longest wait for the network when nothing else is due, seconds of wall time: a fifth of a tick."""
STATUS_NS = 1_000_000_000
"""Mission time between two status messages, nanoseconds: what a person watching can follow."""
GIL_S = 0.001
"""After this time a thread that computes in Python hands over to the scans' thread, seconds. The interpreter's 5 ms
would add up over the hand-overs in one scan."""
STEP_BACK = 5
"""Niceness of the alignment thread above that of the scans' thread: about a third of its share of a busy processor."""


def _step_back() -> None:
    """Let the other threads of this process go first, where the system knows priorities of threads."""
    with contextlib.suppress(OSError, AttributeError):
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), STEP_BACK)


class ProcessShell:
    """Runs one agent by a clock until it is stopped."""

    def __init__(self, runner: Runner, clock: Clock) -> None:
        """Take a wired agent."""
        self.runner, self.clock = runner, clock
        self.scan_ages_s = array("f")
        """How old each scan was when it had been mapped, seconds of wall time."""
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="align", initializer=_step_back)
        self._job: tuple[Job, Future[Outcome]] | None = None
        self._mapper = runner.agent.mapper
        self._load = Overload(runner.agent.settings.rbpf.particles, self._mapper.particles_most)
        self._next_tick_ns = 0
        self._next_status_ns = 0

    def run(self, stop: Callable[[], bool]) -> None:
        """Loop until ``stop()``; then write the robot's files and close everything."""
        sys.setswitchinterval(GIL_S)
        try:
            while not (stop() or self.runner.agent.node.must_stop):
                if not self._step():
                    self.runner.receive(self._idle_s(), self.clock.now_ns)
        finally:
            self._worker.shutdown(wait=True, cancel_futures=True)
            self.runner.close(self.clock.now_ns())

    def _step(self) -> bool:
        """Do what is due now; return whether there was a scan, so that the next follows at once."""
        self.runner.receive(0.0, self.clock.now_ns)
        now_ns = self.clock.now_ns()
        sensed = self.runner.sense(now_ns)
        if sensed is not None:
            self.scan_ages_s.append(self._age_s(sensed))
            self._keep_up(self.scan_ages_s[-1])
        if now_ns >= self._next_tick_ns:
            self._next_tick_ns = now_ns + round(self.runner.agent.settings.agent.tick_s * 1e9)
            self.runner.tick(now_ns)
        self.runner.keep(time.monotonic_ns(), now_ns)
        if now_ns >= self._next_status_ns:
            self._next_status_ns = now_ns + STATUS_NS
            self.runner.perform([status_of(self.runner.agent, now_ns)])
        self._work(now_ns)
        self.runner.body.act(self.runner.agent, now_ns)
        return sensed is not None

    def _age_s(self, sensed: Sensed) -> float:
        if sensed.taken_s is not None:
            return time.monotonic() - sensed.taken_s
        return max(self.clock.wall_s(self.clock.now_ns() - sensed.t_ns), 0.0)

    def _keep_up(self, age_s: float) -> None:
        """Give particles up where the mapper is slower than the laser; where mission time waits, there is no need."""
        if not isinstance(self.clock, WallClock):
            return
        if self._mapper is not self.runner.agent.mapper:  # a new map, with all its particles
            self._mapper, self._load = self.runner.agent.mapper, Overload(self._load.wanted)
        lost = getattr(self.runner.body, "scans_lost", 0)
        now_ns, before = self.clock.now_ns(), self._load.count
        count = self._load.look(age_s, lost, now_ns / 1e9)
        if count is not None:
            self._mapper.use_particles(count)
            name = "overloaded" if count < before else "relieved"
            fields = {"particles": count, "of": self._load.wanted, "scan_age_s": round(age_s, 3), "scans_lost": lost}
            self.runner.perform([Event(now_ns, name, fields)])

    def scan_age_ms(self) -> dict[str, float]:
        """Return percentiles of the age of scans, milliseconds of wall time; empty where there was none."""
        if not self.scan_ages_s:
            return {}
        ages_ms = 1e3 * np.array(self.scan_ages_s)
        return {
            name: round(float(np.percentile(ages_ms, q)), 1) for name, q in (("p50", 50), ("p99", 99), ("max", 100))
        }

    def _work(self, now_ns: int) -> None:
        agent = self.runner.agent
        if self._job is not None and self._job[1].done():
            job, future = self._job
            self._job = None
            self.runner.perform(agent.on_done(job, future.result(), now_ns))
        if self._job is None and (due := agent.next_job(now_ns)) is not None:
            self._job = (due, self._worker.submit(self.runner.work, due))

    def _idle_s(self) -> float:
        next_scan_ns = self.runner.body.next_ns
        due_ns = self._next_tick_ns if next_scan_ns is None else min(self._next_tick_ns, next_scan_ns)
        return min(max(self.clock.wall_s(due_ns - self.clock.now_ns()), 0.0), IDLE_S)
