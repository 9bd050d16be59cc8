"""The virtual-time shell: any number of agents in one process, seeded, as fast as the processor allows.

One seed gives the same bytes on every run: agents take their turns in a fixed order, messages arrive in the order of
their virtual times, and an alignment's outcome arrives a fixed span after it was begun.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from agent.effects import AlignJob
from agent.runner import Runner
from alignment import Alignment, Rejection

ALIGN_NS = 500_000_000
"""How long an alignment takes in virtual time, nanoseconds."""


class Network(Protocol):
    """An in-memory network on virtual time."""

    def advance(self, now_ns: int) -> None:
        """Move virtual time on; messages due by then can be polled."""


class VirtualRobot:
    """One agent that takes its turns in virtual time."""

    def __init__(self, runner: Runner) -> None:
        """Take a wired agent."""
        self.runner = runner
        self._job: tuple[AlignJob, Alignment | Rejection, int] | None = None

    def step(self, now_ns: int) -> None:
        """Do everything that is due at this virtual time."""
        self.runner.receive(0.0, lambda: now_ns)
        while self.runner.sense(now_ns) is not None:
            pass
        self.runner.tick(now_ns)
        self.runner.keep(now_ns, now_ns)
        self._align(now_ns)
        self.runner.body.act(self.runner.agent, now_ns)

    def _align(self, now_ns: int) -> None:
        agent = self.runner.agent
        if self._job is not None and now_ns >= self._job[2]:
            job, outcome, _ = self._job
            self._job = None
            self.runner.perform(agent.on_aligned(job, outcome, now_ns))
        if self._job is None and (due := agent.next_alignment(now_ns)) is not None:
            self._job = (due, self.runner.align(due), now_ns + ALIGN_NS)


def run_virtual(
    robots: Sequence[VirtualRobot],
    network: Network,
    *,
    step_ns: int,
    duration_ns: int | None,
    linger_ns: int,
    progress: Callable[[int], None] = lambda now_ns: None,
) -> int:
    """Run the robots until ``duration_ns``, or until ``linger_ns`` after all have finished; return the time.

    ``progress`` is told the virtual time at every step.
    """
    now_ns = 0
    idle_since_ns: int | None = None
    while duration_ns is None or now_ns < duration_ns:
        network.advance(now_ns)
        for robot in robots:
            robot.step(now_ns)
        progress(now_ns)
        if not all(robot.runner.body.finished for robot in robots):
            idle_since_ns = None
        elif idle_since_ns is None:
            idle_since_ns = now_ns
        elif now_ns - idle_since_ns >= linger_ns:
            break
        now_ns += step_ns
    for robot in robots:
        robot.runner.close(now_ns)
    return now_ns
