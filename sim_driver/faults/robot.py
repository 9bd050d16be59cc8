"""A robot in virtual time that dies and comes back, whose clock goes wrong and whose disk fills up, as told."""

from __future__ import annotations

import errno
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from mrslam.agent import Inline, Runner, VirtualRobot
from mrslam.sim_driver.faults.clock import shown_ns
from mrslam.sim_driver.faults.config import FaultConfig


@dataclass(frozen=True)
class Start:
    """How a robot's computer comes up."""

    life: int = 0
    """How often it died before."""
    now_ns: int = 0
    """Mission time."""
    resumes: bool = False
    """Whether it may go on from its checkpoint."""


class FaultyDisk(Inline):
    """Writes at once, or not at all while the disk is full."""

    def __init__(self, faults: Sequence[FaultConfig]) -> None:
        """Take the robot's faults."""
        self._faults = [fault for fault in faults if fault.kind == "disk_full"]
        self.now_ns = 0
        """Mission time; whoever owns the robot moves it on."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Run the job unless there is no room for what it writes."""
        if not any(fault.active(self.now_ns) for fault in self._faults):
            return super().submit(fn, *args, **kwargs)
        full: Future[Any] = Future()
        full.set_exception(OSError(errno.ENOSPC, "No space left on device"))
        return full


class MortalRobot:
    """Takes its turns in virtual time while it lives."""

    def __init__(
        self,
        make: Callable[[Start], Runner],
        faults: Sequence[FaultConfig],
        die: Callable[[], None],
        disk: FaultyDisk,
    ) -> None:
        """Take what makes the robot anew, its faults, what its end is to the world, and its disk."""
        self._make, self._die, self._disk = make, die, disk
        self._crashes = [fault for fault in faults if fault.kind in ("crash", "amnesia")]
        self._faults = tuple(faults)
        self.lives = 0
        """How often it came back."""
        self._from_nothing = False
        self._robot: VirtualRobot | None = VirtualRobot(make(Start()))
        self._last: Runner = self._robot.runner

    @property
    def runner(self) -> Runner:
        """The robot's present life, or its last one."""
        return self._last

    @property
    def finished(self) -> bool:
        """Whether there is nothing left for the robot to do; one that is down may come back."""
        return self._last.body.finished

    @property
    def alive(self) -> bool:
        """Whether its computer runs."""
        return self._robot is not None

    def local_ns(self, now_ns: int) -> int:
        """Return what the robot's clock shows at this mission time."""
        return shown_ns(self._faults, now_ns)

    def step(self, now_ns: int, worker: ThreadPoolExecutor) -> None:
        """Do everything that is due at this mission time, where the robot lives."""
        self._disk.now_ns = now_ns
        if self._robot is not None:
            self._robot.step(self.local_ns(now_ns), worker)

    def flush(self, now_ns: int) -> None:
        """Send what the step had to send; then die, or come back, where it is time to."""
        if self._robot is not None:
            self._robot.flush(now_ns)
        down = [fault for fault in self._crashes if fault.active(now_ns)]
        if down and self._robot is not None:
            self._robot = None
            self._last.events.close()
            self._die()
        elif not down and self._robot is None:
            self.lives += 1
            self._last = self._make(Start(self.lives, now_ns, not self._from_nothing))
            self._robot, self._from_nothing = VirtualRobot(self._last), False
        self._from_nothing |= any(fault.kind == "amnesia" for fault in down)  # it may begin while the robot is down

    def close(self, now_ns: int) -> None:
        """The mission is over: a robot that lives writes its files."""
        if self._robot is not None:
            self._robot.close(self.local_ns(now_ns))


class Twin:
    """A second process with a robot's id, for a while."""

    finished = True

    def __init__(self, make: Callable[[], Runner], fault: FaultConfig) -> None:
        """Take what makes it, and when it is there."""
        self._make, self._fault = make, fault
        self._robot: VirtualRobot | None = None

    def step(self, now_ns: int, worker: ThreadPoolExecutor) -> None:
        """Take its turn while it is there."""
        if self._robot is not None:
            self._robot.step(now_ns, worker)

    def flush(self, now_ns: int) -> None:
        """Send what the step had to send; then come, or go."""
        if self._robot is not None:
            self._robot.flush(now_ns)
        if self._robot is None and self._fault.active(now_ns):
            self._robot = VirtualRobot(self._make())
        elif self._robot is not None and not self._fault.active(now_ns):
            self._robot.close(now_ns)
            self._robot = None

    def close(self, now_ns: int) -> None:
        """The mission is over."""
        if self._robot is not None:
            self._robot.close(now_ns)
