"""The assessment of the mission as a whole: sums over robots and pairs, and the merges on the way."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from mrslam.sim_driver.evaluate.events import first_merge_s
from mrslam.sim_driver.evaluate.judges import Judgement, PairJudge
from mrslam.sim_driver.evaluate.network import bytes_by_kind
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.missions.run_folder import Event

ACCURATE = ((0.5, 5.0), (0.15, 1.0))
"""Alignments within (m, deg) are counted as successes, coarse and fine: the limits of docs/alignment.md."""
BINS = (0.0, 0.15, 0.3, 0.5, 1.0)
"""Bins of the true overlap of two maps, 0..1."""
MISSED = ("missed merge", "never met, though the maps overlap")
"""Verdicts on pairs that should have been merged."""

Row = dict[str, Any]


def mission_row(run: RunResults, judge: PairJudge, robots: dict[str, Row], pairs: list[Row]) -> Row:
    """Return the mission's row, from those of its robots and pairs."""
    attempts = _events(run, "alignment")
    coverage = [row["map"]["coverage_team"] for row in robots.values() if row["map"] is not None]
    return {
        "mission_s": run.metrics["mission_s"],
        "first_merge_s": first_merge_s(run.events.values()),
        **_merges_on_the_way(run, judge),
        **_verdicts(pairs),
        "coverage_best": max(coverage, default=None),
        "coverage_worst": min(coverage, default=None),
        "alignments_tried": len(attempts),
        "alignments_accepted": sum(event["status"] == "accepted" for event in attempts),
        "success_by_overlap": _success(pairs),
        "bytes": bytes_by_kind(run),
        "exchanges": {
            key: sum(row["exchanges"][key] for row in robots.values())
            for key in ("started", "done", "failed", "opened")
        },
    }


def _events(run: RunResults, kind: str) -> list[Event]:
    return [event for events in run.events.values() for event in events if event["event"] == kind]


def _merges_on_the_way(run: RunResults, judge: PairJudge) -> Row:
    """Return when the first merge was right, and how many were wrong, also those taken back later."""
    known = {robot.id for robot in run.mission.robots}
    correct_s, wrong = [], 0
    for event in _events(run, "merged"):
        if not {event["a"], event["b"]} <= known or not _is_of_last_maps(run, event):
            continue
        judged = judge.judge(event["a"], event["b"], np.array(event["T_a_b"]))
        if isinstance(judged, Judgement):
            correct_s += [] if judged.is_false else [event["t"]]
            wrong += judged.is_false
    return {"first_correct_merge_s": min(correct_s, default=None), "wrong_merges_on_the_way": wrong}


def _is_of_last_maps(run: RunResults, merge: Event) -> bool:
    """Return whether a merge is of the maps that there are at the end: a simulated robot may have begun a new one."""
    return all(merge["t"] >= run.map_begun_s.get(robot, 0.0) for robot in (merge["a"], merge["b"]))


def _verdicts(pairs: list[Row]) -> Row:
    """Return how many pairs got which verdict."""
    verdicts = [pair["verdict"] for pair in pairs]
    false = [pair for pair in pairs if pair["verdict"] == "false merge"]
    return {
        "correct_merges": verdicts.count("correct merge"),
        "one_sided_merges": verdicts.count("merged by one only"),
        "false_merges": len(false),
        "missed_merges": sum(verdict in MISSED for verdict in verdicts),
        "false_merges_without_overlap": sum((pair["true_overlap"] or 0.0) < BINS[1] for pair in false),
    }


def _success(pairs: list[Row]) -> list[Row]:
    """Return how many pairs were aligned within the two accuracies, by bin of their maps' true overlap."""
    return [_bin(pairs, low, high) for low, high in pairwise(BINS)]


def _bin(pairs: list[Row], low: float, high: float) -> Row:
    inside = [p for p in pairs if p["true_overlap"] is not None and low <= p["true_overlap"] < high + (high == 1.0)]
    judged = [pair for pair in inside if pair["error_m"] is not None]
    row: Row = {"overlap": [low, high], "pairs": len(inside)}
    for off_m, off_deg in ACCURATE:
        good = [pair for pair in judged if pair["error_m"] <= off_m and pair["error_deg"] <= off_deg]
        row[f"within_{off_m:g}m_{off_deg:g}deg"] = len(good)
    return row
