"""The virtual-time shell: any number of agents in one process, seeded, as fast as the processor allows.

One seed gives the same bytes on every run and with any number of threads: within a step no agent sees what another
does, what they send goes out when all are through, messages arrive in the order of their virtual times, and an
alignment, which runs beside the turns, is done a fixed span after it was begun. (Turns side by side in threads were
tried: handing over the interpreter's lock cost what they won.)
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Protocol

from mrslam.agent.effects import Job, Outcome
from mrslam.agent.shells.ending import take_all
from mrslam.agent.shells.runner import Runner
from mrslam.comms import Incoming, PeerJoined, PeerLeft, Send, Transport

ALIGN_NS = 500_000_000
"""Virtual time an alignment takes, nanoseconds: the order of what it takes on a processor (docs/alignment.md)."""


class Network(Protocol):
    """An in-memory network on virtual time."""

    def advance(self, now_ns: int) -> None:
        """Move virtual time on; messages due up to ``now_ns`` can be polled."""


class Outbox:
    """A robot's end of the network that keeps what it sends until all robots have had their turn."""

    def __init__(self, inner: Transport) -> None:
        """Take the end itself."""
        self._inner = inner
        self._waiting: list[Send] = []

    def send(self, effect: Send) -> None:
        """Keep the message."""
        self._waiting.append(effect)

    def flush(self) -> None:
        """Send what was kept, in its order."""
        for effect in self._waiting:
            self._inner.send(effect)
        self._waiting.clear()

    @property
    def waiting(self) -> list[Send]:
        """What was kept, in its order."""
        return list(self._waiting)

    def poll(self, timeout_s: float) -> list[Incoming | PeerJoined | PeerLeft]:
        """Return what has arrived."""
        return self._inner.poll(timeout_s)

    def close(self) -> None:
        """Send the last and leave."""
        self.flush()
        self._inner.close()


class TakesTurns(Protocol):
    """A robot in virtual time."""

    @property
    def finished(self) -> bool:
        """Whether there is nothing left for the robot to do."""

    def step(self, now_ns: int, worker: ThreadPoolExecutor) -> None:
        """Do everything that is due at this virtual time, beside the other robots' steps."""

    def flush(self, now_ns: int) -> None:
        """Do what concerns others, in its turn after all have stepped."""

    def close(self, now_ns: int) -> None:
        """The mission is over."""


class VirtualRobot:
    """One agent that takes its turns in virtual time."""

    def __init__(self, runner: Runner) -> None:
        """Take a wired agent."""
        self.runner = runner
        self._job: tuple[Job, Future[Outcome], int] | None = None
        self.outbox = runner.transport = Outbox(runner.transport)
        """What the present step sends, once all robots are through with it."""

    def step(self, now_ns: int, worker: ThreadPoolExecutor) -> None:
        """Do everything that is due at this virtual time; alignments run on ``worker``."""
        if self.runner.agent.node.must_stop:  # another process had this robot's id before
            return
        self.runner.receive(0.0, lambda: now_ns)
        while self.runner.sense(now_ns) is not None:
            pass
        self.runner.tick(now_ns)
        self.runner.keep(now_ns, now_ns)
        self._work(now_ns, worker)
        self.runner.body.act(self.runner.agent, now_ns)

    def flush(self, now_ns: int) -> None:
        """Send what the step had to send."""
        self.outbox.flush()

    @property
    def finished(self) -> bool:
        """Whether there is nothing left for the robot to do."""
        return self.runner.body.finished or self.runner.agent.node.must_stop

    def close(self, now_ns: int) -> None:
        """Leave the network and write the robot's files."""
        self.runner.close(now_ns)

    def _work(self, now_ns: int, worker: ThreadPoolExecutor) -> None:
        agent = self.runner.agent
        if self._job is not None and now_ns >= self._job[2]:
            job, outcome, _ = self._job
            self._job = None
            self.runner.perform(agent.on_done(job, outcome.result(), now_ns))
        if self._job is None and (due := agent.next_job(now_ns)) is not None:
            self._job = (due, worker.submit(self.runner.work, due), now_ns + ALIGN_NS)


def run_virtual(
    robots: Sequence[TakesTurns],
    network: Network,
    *,
    step_ns: int,
    duration_ns: int | None,
    linger_ns: int,
    progress: Callable[[int], None] = lambda now_ns: None,
    stop: Callable[[], bool] = lambda: False,
    threads: int = 0,
    meet: Callable[[], None] = lambda: None,
) -> int:
    """Run the robots until ``duration_ns``, or until ``linger_ns`` after all have finished; return the time.

    ``progress`` is called with the virtual time at every step, after which ``stop()`` may end it in good order;
    ``threads`` : for alignments, 0 = the number of cores. ``meet`` is called in every step when all robots here had
    their turn, and before anything is sent: robots of other processes take their turns meanwhile.
    """
    with ThreadPoolExecutor(threads or len(os.sched_getaffinity(0)), thread_name_prefix="align") as worker:
        return _run(robots, network, worker, step_ns, duration_ns, linger_ns, progress, stop, meet)


def _run(
    robots: Sequence[TakesTurns],
    network: Network,
    worker: ThreadPoolExecutor,
    step_ns: int,
    duration_ns: int | None,
    linger_ns: int,
    progress: Callable[[int], None],
    stop: Callable[[], bool],
    meet: Callable[[], None],
) -> int:
    now_ns = 0
    idle_since_ns: int | None = None
    while duration_ns is None or now_ns < duration_ns:
        network.advance(now_ns)
        for robot in robots:
            robot.step(now_ns, worker)
        meet()
        for robot in robots:
            robot.flush(now_ns)
        progress(now_ns)
        if stop():
            break
        if not all(robot.finished for robot in robots):
            idle_since_ns = None
        elif idle_since_ns is None:
            idle_since_ns = now_ns
        elif now_ns - idle_since_ns >= linger_ns:
            break
        now_ns += step_ns
    take_all(partial(robot.close, now_ns) for robot in robots)
    return now_ns
