"""What is said of a run in words."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from mrslam.sim_driver.report.story import event_words, headline

ALL = ("r1", "r2", "r3")


@pytest.mark.parametrize(
    ("placed", "said"),
    [
        ((ALL, ALL, ALL), "All 3 robots share one map"),
        ((ALL, ("r1", "r2"), ("r3",)), "1 of 3 robots has the maps of all in one"),
        ((ALL, ALL, ("r3",)), "2 of 3 robots have the maps of all in one"),
        ((("r1", "r2"), ("r1", "r2"), ("r3",)), "2 of 3 robots share one map"),
        ((("r1",), ("r2",), ("r3",)), "No maps were merged: 3 robots, 3 separate maps"),
        ((("r1",),), "One robot mapped on its own"),
    ],
)
def test_the_headline_counts_who_has_whose_map(placed: tuple[tuple[str, ...], ...], said: str) -> None:
    modes = [SimpleNamespace(id=robot, mode="distributed") for robot in ALL[: len(placed)]]
    robots = {robot: {"placed": dict.fromkeys(maps)} for robot, maps in zip(ALL, placed, strict=False)}
    run: Any = SimpleNamespace(mission=SimpleNamespace(robots=modes), robots=robots)
    assert headline(run) == said


def test_an_exchange_that_both_ends_note_is_told_once() -> None:
    sizes = {"event": "exchange_done", "bytes_sent": 1500, "bytes_received": 500}
    words = [event_words({"robot": one, "peer": other, **sizes}) for one, other in (("r1", "r2"), ("r2", "r1"))]
    assert words == [("plain", "r1 and r2 exchanged maps, 2.0 kB"), None]
