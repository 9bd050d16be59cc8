"""Threads of one mapper."""

from __future__ import annotations

import threading

import pytest

from rbpf.crew import Crew, Pending


@pytest.mark.parametrize("threads", [1, 2, 3, 5])
def test_every_part_is_done_once_whoever_does_it(threads: int) -> None:
    crew, done = Crew(threads), [0] * 30

    def job(first: int, last: int) -> None:
        for i in range(first, last):
            done[i] += 1

    def task() -> str:
        for _ in range(20):
            crew.share(job, 30)
        return "ready"

    pending = crew.begin(task)
    assert pending.result() == "ready" == pending.result()
    assert done == [20] * 30


def test_who_waits_takes_its_share() -> None:
    crew, here = Crew(2), threading.Event()
    names: list[str] = []

    def job(first: int, last: int) -> None:
        names.append(threading.current_thread().name)
        if threading.current_thread() is threading.main_thread():
            here.set()
        else:
            assert here.wait(30.0), "the waiting thread did not help"

    crew.begin(lambda: crew.share(job, 2)).result()
    assert len(set(names)) == 2


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_what_goes_wrong_is_told_to_who_waits(threads: int) -> None:
    crew = Crew(threads)

    def job(first: int, last: int) -> None:
        if first <= 7 < last:
            raise ValueError("seven")

    with pytest.raises(ValueError, match="seven"):
        crew.begin(lambda: crew.share(job, 10)).result()


def test_alone_a_task_is_done_at_once() -> None:
    done: list[int] = []
    Crew(1).begin(lambda: done.append(1))
    assert done == [1]
    assert Pending.done(3).result() == 3
