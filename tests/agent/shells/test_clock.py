"""Mission time, and how long it lasts."""

from __future__ import annotations

from types import SimpleNamespace

from mrslam.agent.shells.clock import SharedClock, WallClock

S = 1_000_000_000


def test_a_span_of_mission_time_lasts_shorter_the_faster_a_mission_is_played() -> None:
    assert WallClock().wall_s(3 * S) == 3.0
    assert SharedClock(SimpleNamespace(value=0), speed=4.0).wall_s(3 * S) == 0.75


def test_a_shared_clock_shows_what_the_other_process_says() -> None:
    counter = SimpleNamespace(value=5)
    clock = SharedClock(counter)
    counter.value = 7 * S
    assert clock.now_ns() == 7 * S
