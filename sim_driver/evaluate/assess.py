"""The whole assessment of a run: per robot, per pair and of the mission, and what could not be judged and why."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from mrslam.sim_driver.evaluate.events import first_merge_s
from mrslam.sim_driver.evaluate.judges import Judgement, PairJudge, References, map_judge, pair_judge, relations_of
from mrslam.sim_driver.evaluate.network import bytes_by_kind, exchanges, link_rows
from mrslam.sim_driver.evaluate.relations import own_errors
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.evaluate.sides import givers_of, pairs_of, sides_of, speaker_of
from mrslam.sim_driver.evaluate.trajectories import errors
from mrslam.sim_driver.evaluate.truth import MUST_MERGE, Judge, team_frames
from mrslam.sim_driver.missions.usage import read_usage
from mrslam.spatial import InputError
from mrslam.spatial.se2 import Transform

ACCURATE = ((0.5, 5.0), (0.15, 1.0))
"""Alignments within (m, deg) are counted as successes, coarse and fine."""
BINS = (0.0, 0.15, 0.3, 0.5, 1.0)
"""Bins of the true overlap of two maps."""
GHOST_M = 0.3
"""Wall cells this near to where a teammate drove, with no true wall there, are its ghost."""


def assess(folder: Path, references: References | None = None) -> dict[str, Any]:
    """Return everything that can be said of the run in ``folder``, as plain JSON values."""
    references = references or References()
    run = RunResults.read(folder)
    _check_names(run, references)
    not_judged: list[str] = [f"{robot}: was lost in the run" for robot in run.metrics["robots_lost"]]
    judge = pair_judge(run, references)
    robots = _robots(run, references, not_judged)
    pairs = [_pair(run, judge, a, b, not_judged) for a, b in pairs_of(run.robots)]
    return {
        "name": run.metrics["name"],
        "mission": _mission(run, judge, robots, pairs),
        "robots": robots,
        "pairs": pairs,
        "links": link_rows(run),
        "not_judged": not_judged,
    }


def _check_names(run: RunResults, references: References) -> None:
    """Refuse reference trajectories of robots that the run has not, or whose true ones it has."""
    robots = [robot.id for robot in run.mission.robots]
    all_simulated = {robot.id for robot in run.mission.robots if robot.mode != "central"} <= run.truth.keys()
    for name in references.trajectories:
        if name and name not in robots:
            raise InputError(f"reference of {name}: no such robot in this run; its robots are {', '.join(robots)}")
        if name in run.truth or (not name and all_simulated):
            raise InputError("reference: the run was simulated and knows its true trajectories; leave it out")


def _robots(run: RunResults, references: References, not_judged: list[str]) -> dict[str, Any]:
    relations = relations_of(run, references)
    against = map_judge(run, references)
    frames = {} if against is None else team_frames(against[1], run.robots)
    rows = {}
    for robot_id, robot in run.robots.items():
        row: dict[str, Any] = {"known_area_m2": robot["known_area_m2"], "exchanges": exchanges(run.events[robot_id])}
        trajectory = run.trajectory(robot_id)
        reference = run.laser_truth(robot_id) or references.trajectory(robot_id)
        row["trajectory"] = None if reference is None else errors(trajectory, reference)
        if row["trajectory"] is None and robot["mode"] != "central":
            why = "no true or reference trajectory" if reference is None else "no common stamps with the reference"
            not_judged.append(f"{robot_id}, trajectory: {why}")
        row["relations"] = None
        if relations is not None and len(trajectory[0]):
            off = own_errors(relations, *trajectory)
            row["relations"] = _relation_row(off, len(relations[0])) if len(off) else None
            if not len(off):
                not_judged.append(f"{robot_id}, relations: none of {len(relations[0])} lies within its trajectory")
        row["map"] = None
        if against is None:
            not_judged.append(f"{robot_id}, map: no true map")
        elif robot_id not in frames:
            not_judged.append(f"{robot_id}, map: its place in the true map was not found")
        else:
            row["map"] = _map_row(run, robot_id, against[0], against[1].get(robot_id), frames[robot_id])
        row["usage"] = read_usage(run.folder / robot_id)
        if row["usage"] is None:
            not_judged.append(f"{robot_id}, CPU and memory: robots of a virtual run share one process")
        rows[robot_id] = row
    return rows


def _relation_row(off: np.ndarray[Any, Any], given: int) -> dict[str, Any]:
    mean, std = off.mean(axis=0), off.std(axis=0)
    return {
        "count": len(off),
        "given": given,
        "mean_m": round(float(mean[0]), 4),
        "std_m": round(float(std[0]), 4),
        "mean_deg": round(float(mean[1]), 4),
        "std_deg": round(float(std[1]), 4),
    }


def _map_row(run: RunResults, robot_id: str, truth: Judge, T_own: Transform | None, T: Transform) -> dict[str, Any]:
    """Return what the robot's maps are worth; ``T_own`` (None without one) and ``T`` say where own and team map lie."""
    team = run.map(robot_id, "team_map")
    paths = [poses[:, :2] for other, (_, poses) in run.truth.items() if other != robot_id]
    return {
        "coverage_own": None if T_own is None else round(truth.coverage(run.map(robot_id), T_own), 4),
        "coverage_team": round(truth.coverage(team, T), 4),
        "occupied_precision": round(truth.occupied_precision(team, T), 4),
        "occupied_recall": _rounded(truth.occupied_recall(team, T)),
        "free_agreement": _rounded(truth.free_agreement(team, T)),
        "ghost_cells": truth.ghosts(team, T, np.concatenate(paths), GHOST_M) if paths else None,
    }


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 4)


def _pair(run: RunResults, judge: PairJudge, a: str, b: str, not_judged: list[str]) -> dict[str, Any]:
    """Return what every robot believes of the pair, and what that is worth."""
    views = {}
    for robot_id, robot in run.robots.items():
        for view in robot["pairs"]:
            if (view["a"], view["b"]) == (a, b):
                views[robot_id] = _view(view, judge.judge(a, b, np.array(view["T_a_b"])) if view["T_a_b"] else None)
    speaker = speaker_of(views, a, b)
    never = {"status": "never met", "accepted_at_s": None, "reason": ""}
    said = {
        **(_view(never, None) if speaker is None else views[speaker]),
        **sides_of(views, a, b, givers_of(run.robots)),
    }
    shared = judge.overlap(a, b)
    met = bool(views) or bool(exchanges(run.events[a], b)["done"])
    verdict = _verdict(said, met, shared, views)
    if said["status"] == "accepted" and said["error_m"] is None:
        not_judged.append(f"{a}-{b}, merge: {said['judged_by']}")
    elif said["status"] != "accepted" and shared is None:
        not_judged.append(f"{a}-{b}, whether it should have merged: the true overlap of the maps is not known")
    return {"a": a, "b": b, "verdict": verdict, "true_overlap": _rounded(shared), **said, "views": views}


def _view(view: dict[str, Any], judged: Judgement | str | None) -> dict[str, Any]:
    known = judged if isinstance(judged, Judgement) else None
    return {
        "status": "rejected" if view["status"] == "untried" else view["status"],
        "accepted_at_s": view["accepted_at_s"],
        "reason": view["reason"],
        "attempts": view.get("attempts", 0),
        "error_m": None if known is None else round(known.error_m, 4),
        "error_deg": None if known is None else round(known.error_deg, 4),
        "alignment_m": None if known is None else _rounded(known.alignment_m),
        "alignment_deg": None if known is None else _rounded(known.alignment_deg),
        "judged_by": judged if known is None else known.judged_by,
        "is_false": None if known is None else known.is_false,
    }


def _verdict(said: dict[str, Any], met: bool, shared: float | None, views: dict[str, Any]) -> str:
    if any(view["is_false"] for view in views.values()):
        return "false merge"
    if said["status"] == "accepted":
        if said["both_at_s"] is None:
            return "merged by one only"
        return "merged, not judged" if said["is_false"] is None else "correct merge"
    if shared is not None and shared >= MUST_MERGE:
        return "missed merge" if met else "never met, though the maps overlap"
    return "not merged" if met else "never met"


def _mission(run: RunResults, judge: PairJudge, robots: dict[str, Any], pairs: list[dict[str, Any]]) -> dict[str, Any]:
    merges = sorted(
        (e for events in run.events.values() for e in events if e["event"] == "merged" and _is_of_last_maps(run, e)),
        key=lambda event: event["t"],
    )
    judged = [(event, judge.judge(event["a"], event["b"], np.array(event["T_a_b"]))) for event in merges]
    correct = [event["t"] for event, verdict in judged if isinstance(verdict, Judgement) and not verdict.is_false]
    wrong = [event["t"] for event, verdict in judged if isinstance(verdict, Judgement) and verdict.is_false]
    attempts = [event for events in run.events.values() for event in events if event["event"] == "alignment"]
    coverage = [row["map"]["coverage_team"] for row in robots.values() if row["map"] is not None]
    verdicts = [pair["verdict"] for pair in pairs]
    return {
        "mission_s": run.metrics["mission_s"],
        "first_merge_s": first_merge_s(run.events.values()),
        "first_correct_merge_s": min(correct, default=None),
        "wrong_merges_on_the_way": len(wrong),
        "correct_merges": verdicts.count("correct merge"),
        "one_sided_merges": verdicts.count("merged by one only"),
        "false_merges": verdicts.count("false merge"),
        "missed_merges": sum(verdict in ("missed merge", "never met, though the maps overlap") for verdict in verdicts),
        "false_merges_without_overlap": sum(
            pair["verdict"] == "false merge" and (pair["true_overlap"] or 0.0) < BINS[1] for pair in pairs
        ),
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


def _is_of_last_maps(run: RunResults, merge: dict[str, Any]) -> bool:
    """Return whether a merge is of the maps that there are at the end: a simulated robot may have begun a new one."""
    return all(merge["t"] >= run.map_begun_s.get(robot, 0.0) for robot in (merge["a"], merge["b"]))


def _success(pairs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return how many pairs were aligned within the two accuracies, by bin of their maps' true overlap."""
    rows = []
    for low, high in pairwise(BINS):
        inside = [p for p in pairs if p["true_overlap"] is not None and low <= p["true_overlap"] < high + (high == 1.0)]
        row: dict[str, Any] = {"overlap": [low, high], "pairs": len(inside)}
        for off_m, off_deg in ACCURATE:
            good = [
                p for p in inside if p["error_m"] is not None and p["error_m"] <= off_m and p["error_deg"] <= off_deg
            ]
            row[f"within_{off_m:g}m_{off_deg:g}deg"] = len(good)
        rows.append(row)
    return rows
