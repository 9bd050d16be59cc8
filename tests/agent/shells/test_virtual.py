"""When a run in virtual time ends."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

from mrslam.agent.shells.virtual import run_virtual
from mrslam.comms import MemoryNetwork

STEP_NS, LINGER_NS = 10, 50


class Waiting:
    """A robot that has nothing to do within these times."""

    def __init__(self, *idle: range) -> None:
        self.idle, self.finished, self.closed_ns = idle, False, -1

    def step(self, now_ns: int, worker: ThreadPoolExecutor) -> None:
        self.finished = any(now_ns in times for times in self.idle)

    def flush(self, now_ns: int) -> None:
        pass

    def close(self, now_ns: int) -> None:
        self.closed_ns = now_ns


@pytest.mark.parametrize(
    ("robots", "end_ns"),
    [
        ([Waiting(range(30, 1000))], 80),
        ([Waiting(range(30, 1000)), Waiting(range(100, 1000))], 150),
        ([Waiting(range(30, 60), range(90, 1000))], 140),
        ([Waiting()], 400),
    ],
    ids=["one", "the last one counts", "one that has something to do again", "none ever finishes"],
)
def test_a_run_ends_when_all_have_been_idle_for_as_long_as_they_linger(robots: list[Waiting], end_ns: int) -> None:
    ended = run_virtual(robots, MemoryNetwork(), step_ns=STEP_NS, duration_ns=400, linger_ns=LINGER_NS, threads=1)
    assert ended == end_ns and all(robot.closed_ns == end_ns for robot in robots)


class Breaking(Waiting):
    """A robot whose files cannot be written."""

    def close(self, now_ns: int) -> None:
        super().close(now_ns)
        raise RuntimeError("a robot's end")


def test_all_robots_are_closed_though_one_of_them_fails_and_its_failure_is_raised() -> None:
    robots = [Waiting(), Breaking(), Waiting()]
    with pytest.raises(RuntimeError, match="a robot's end"):
        run_virtual(robots, MemoryNetwork(), step_ns=STEP_NS, duration_ns=STEP_NS, linger_ns=LINGER_NS, threads=1)
    assert [robot.closed_ns for robot in robots] == 3 * [STEP_NS]


class Noting(Waiting):
    """A robot that notes its turns."""

    def __init__(self, notes: list[str]) -> None:
        super().__init__()
        self.notes = notes

    def step(self, now_ns: int, worker: ThreadPoolExecutor) -> None:
        self.notes.append("step")

    def flush(self, now_ns: int) -> None:
        self.notes.append("flush")


def test_robots_of_other_processes_are_met_between_turns_and_sending() -> None:
    notes: list[str] = []
    robots = [Noting(notes), Noting(notes)]
    run_virtual(
        robots, MemoryNetwork(), step_ns=STEP_NS, duration_ns=2 * STEP_NS, linger_ns=LINGER_NS, threads=1,
        meet=lambda: notes.append("meet"),
    )  # fmt: skip
    assert notes == 2 * ["step", "step", "meet", "flush", "flush"]
