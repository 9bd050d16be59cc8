"""A robot that is down at the mission's end: what it had merged is in the results, by its events."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from mrslam.sim_driver.evaluate import assess
from mrslam.sim_driver.evaluate.lost import map_begun_s, pairs_by_events
from mrslam.sim_driver.missions.run_folder import read_metrics
from mrslam.sim_driver.report import write_report
from tests.sim_driver.runs import played

TABLES: dict[str, Any] = {
    "mission": {"shell": "virtual", "seed": 3, "duration_s": 32.0},
    "world": {"name": "arena1"},
    "robots": [
        {"id": "r1", "start": [2.0, 2.0, 0.0], "mode": "mapper"},
        {"id": "r2", "start": [3.0, 2.5, 1.0]},
    ],
    "rbpf": {"particles": 5, "threads": 1},
    "comms": {"exchange_timeout_s": 5.0, "beacon_window": 16},
    "faults": [{"kind": "crash", "robot": "r2", "at_s": 31.0, "for_s": 60.0}],
}


def merged(t: float, a: str = "a", b: str = "b", x_m: float = 1.0) -> dict[str, Any]:
    return {"t": t, "event": "merged", "a": a, "b": b, "T_a_b": [x_m, 0.0, 0.0], "confidence": 0.9}


def test_merges_of_a_robot_that_is_down_at_the_end_are_in_the_results(tmp_path: Path) -> None:
    run = played(TABLES, tmp_path / "run")
    metrics = read_metrics(run)
    assert metrics["robots_lost"] == ["r2"]
    (pair,) = metrics["pairs"]
    assert (pair["status"], pair["accepted_by"], pair["judged_by"]) == ("accepted", ["r2"], "simulated truth")
    assert pair["error_m"] < 0.2 and pair["both_at_s"] is not None
    judged = assess(run)
    assert judged["pairs"][0]["verdict"] == "correct merge" and judged["mission"]["correct_merges"] == 1
    assert not [line for line in judged["not_judged"] if "no such" in line]
    assert write_report(run).exists()


def test_the_last_alignment_counts() -> None:
    better = {"t": 5.0, "event": "alignment", "a": "a", "b": "b", "T_a_b": [2.0, 0.0, 0.0], "confidence": 0.7}
    failed = {**better, "t": 6.0, "T_a_b": None}
    (row,) = pairs_by_events([merged(3.0), better, failed])
    assert (row["T_a_b"], row["confidence"], row["accepted_at_s"]) == ([2.0, 0.0, 0.0], 0.7, 3.0)


def test_what_was_taken_back_is_not_merged() -> None:
    back = {"t": 4.0, "event": "unmerged", "a": "a", "b": "b", "reason": "contradicted"}
    rows = pairs_by_events([merged(3.0), merged(3.5, "a", "c"), back])
    assert [(row["b"], row["status"], row["T_a_b"]) for row in rows] == [
        ("b", "revoked", None),
        ("c", "accepted", [1.0, 0.0, 0.0]),
    ]
    (row,) = pairs_by_events([merged(3.0), back, merged(5.0, x_m=4.0)])
    assert (row["status"], row["accepted_at_s"], row["T_a_b"][0]) == ("accepted", 5.0, 4.0)


@pytest.mark.parametrize(
    ("between", "is_new"),
    [
        ({"event": "given_up"}, True),
        ({"event": "lost"}, True),
        ({"event": "restarted", "checkpoint": False}, True),
        ({"event": "restarted", "checkpoint": True}, False),
    ],
)
def test_a_new_map_begins_without_merges(between: dict[str, Any], is_new: bool) -> None:
    mapped = [{"t": t, "event": "mapped"} for t in (1.0, 8.0)]
    events = [mapped[0], merged(3.0), {"t": 7.0, **between}, mapped[1]]
    assert [row["b"] for row in pairs_by_events(events)] == ([] if is_new else ["b"])
    assert map_begun_s(events) == (8.0 if is_new else 1.0)


def test_without_events_nothing_is_known() -> None:
    assert pairs_by_events([]) == [] and map_begun_s([]) == 0.0
