"""Threads of one mapper."""

from __future__ import annotations

import threading
from collections.abc import Callable

import pytest

from mrslam.spatial.runtime.crew import Crew, Pending


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


def test_an_idle_crew_does_two_things_at_once() -> None:
    crew, met = Crew(2), threading.Barrier(2, timeout=30.0)
    assert crew.is_idle and not Crew(1).is_idle
    crew.both(met.wait, met.wait)  # neither goes on without the other
    held = threading.Event()
    pending = crew.begin(held.wait)
    assert not crew.is_idle
    held.set()
    pending.result()
    assert crew.is_idle


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


def test_a_shared_job_is_over_when_its_last_part_is() -> None:
    crew, begun, over = Crew(2), threading.Event(), threading.Event()

    def job(first: int, last: int) -> None:
        if threading.current_thread() is threading.main_thread():
            begun.set()
            assert not returned.wait(0.2), "returned before the part on this thread was done"
            over.set()
        else:
            assert begun.wait(30.0), "the waiting thread did not help"

    returned = threading.Event()

    def task() -> bool:
        crew.share(job, 2)
        returned.set()
        return over.is_set()

    assert crew.begin(task).result()


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_what_comes_before_is_done_before_and_what_is_beside_is_done_once(threads: int) -> None:
    crew = Crew(threads)
    for _ in range(50):
        events: list[str] = []

        def job(first: int, last: int, events: list[str] = events) -> None:
            events.extend("j" * (last - first))

        def task(job: Callable[[int, int], None] = job, events: list[str] = events) -> None:
            crew.share(job, 5, before=lambda: events.append("b"), beside=lambda: events.append("s"))

        crew.begin(task).result()
        assert sorted(events) == ["b", *"jjjjj", "s"]
        assert events.index("b") < events.index("j")


def test_what_is_beside_does_not_wait_for_what_comes_before() -> None:
    crew, here = Crew(2), threading.Event()

    def before() -> None:
        assert here.wait(30.0), "what is beside waited"

    crew.begin(lambda: crew.share(lambda first, last: None, 3, before=before, beside=here.set)).result()


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
