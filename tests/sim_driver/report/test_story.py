"""What is said of a run in words."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from mrslam.sim_driver.report.story import _pair_sentence, event_words, headline, sentences

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


def told(low: float, high: float, *events: dict[str, Any]) -> list[str]:
    """Return what is said of a robot that was alone and at the end knew this share of the building."""
    mission = SimpleNamespace(robots=[SimpleNamespace(id="r1", mode="distributed")], faults=(), replay=None)
    run: Any = SimpleNamespace(mission=mission, robots={"r1": {}}, robots_lost=(), damage=(), events={"r1": events})
    figures = {"coverage_worst": low, "coverage_best": high, "bytes": {"exchanges": 0, "full_lz4": 0}}
    return [text for _, text in sentences(run, {"pairs": [], "saved_maps": [], "mission": figures})]


def test_shares_that_read_alike_are_told_once() -> None:
    assert told(0.982, 0.984) == ["Each robot knows 98 % of the building.", "No maps went over the radio."]
    assert told(0.52, 0.984)[0] == "Each robot knows 52 to 98 % of the building."


def test_a_laser_that_failed_more_than_once_was_of_no_use_for_all_that_time() -> None:
    blind, sees = {"event": "blind"}, {"event": "sees", "blind_s": 2.4}
    words = told(0.5, 0.5, blind, sees, blind, {**sees, "blind_s": 3.2}, blind)
    assert words[0] == "The laser of r1 was of no use for 6 s and at the end; it went on by its wheels."


@pytest.mark.parametrize(
    ("noted_by", "said"),
    [
        ({"r1": 2, "r2": 2}, "r1 and r2 exchanged maps 2 times, but were not merged: no room for doubt."),
        ({"r1": 0, "r2": 1}, "r1 and r2 exchanged maps once, but were not merged: no room for doubt."),
        ({"r1": 0, "r2": 0}, "r1 and r2 never exchanged maps."),
    ],
)
def test_an_exchange_that_a_lost_robot_did_not_note_counts(noted_by: dict[str, int], said: str) -> None:
    events: dict[str, Any] = {
        one: [{"event": "exchange_done", "peer": other}] * noted_by[one] for one, other in (("r1", "r2"), ("r2", "r1"))
    }
    pair = {
        "a": "r1", "b": "r2", "status": "rejected", "verdict": "", "placed_together_by": [],
        "reason": "no room for doubt",
    }  # fmt: skip
    run: Any = SimpleNamespace(events=events)
    assert _pair_sentence(pair, run) == ("bad", said)
