"""``mrslam eval``: what a run is worth, as JSON or as tables."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from mrslam.sim_driver.evaluate import References, assess
from mrslam.sim_driver.evaluate.in_saved_maps import as_words
from mrslam.sim_driver.evaluate.sides import when_text
from mrslam.sim_driver.evaluate.trajectories import Trajectory
from mrslam.sim_driver.kernels import ensure_compiled
from mrslam.spatial import InputError, read_map
from mrslam.spatial.files.tum import read_tum

ROBOT_ROWS = {
    "ATE m": ("trajectory", "ate_rmse_m"),
    "RPE m/s": ("trajectory", "rpe_rmse_m"),
    "relations m": ("relations", "mean_m"),
    "relations deg": ("relations", "mean_deg"),
    "relations used": ("relations", "count"),
    "relations given": ("relations", "given"),
    "team's ATE m": ("team", "ate_rmse_m"),
    "team's relations m": ("team", "mean_m"),
    "team's relations deg": ("team", "mean_deg"),
    "team's relations used": ("team", "count"),
    "own coverage": ("map", "coverage_own"),
    "team coverage": ("map", "coverage_team"),
    "walls right": ("map", "occupied_precision"),
    "walls found": ("map", "occupied_recall"),
    "floor right": ("map", "free_agreement"),
    "ghost cells": ("map", "ghost_cells"),
    "CPU s": ("usage", "cpu_s"),
    "MB": ("usage", "peak_rss_mb"),
}
"""Measure -> where its value stands in a robot's row."""


def eval_run(run: Path, relations: Path | None, reference: list[str], true_map: Path | None, as_json: bool) -> None:
    """Judge a run's folder and print the outcome."""
    references = References(
        relations=relations,
        trajectories=dict(_reference(text) for text in reference),
        true_map=None if true_map is None else read_map(true_map),
    )
    if true_map is not None:
        ensure_compiled(lambda text: None, ("alignment",))
    assessment = assess(run, references)
    if as_json:
        print(json.dumps(assessment, allow_nan=False))
    else:
        print_tables(assessment, Console())


def _reference(text: str) -> tuple[str, Trajectory]:
    robot, equals, name = text.rpartition("=")
    if equals and not robot:
        raise InputError(f"--reference wants FILE or ROBOT=FILE, got {text!r}")
    return robot, read_tum(Path(name))


def print_tables(assessment: dict[str, Any], console: Console) -> None:
    """Print the assessment for people; measures that no robot has are left out."""
    _print_robots(assessment["robots"], console)
    _print_pairs(assessment["pairs"], console)
    for row in assessment["saved_maps"]:
        _say(as_words(row), console)
    mission = assessment["mission"]
    traffic, tried = mission["bytes"], mission["exchanges"]
    seconds = [mission["first_merge_s"], mission["first_correct_merge_s"]]
    first, correct = ("none" if s is None else f"{s:.0f} s" for s in seconds)
    lines = [
        f"first merge {first}, first correct merge {correct}; "
        f"{mission['correct_merges']} correct, {mission['false_merges']} false, {mission['missed_merges']} missed",
        f"alignments: {mission['alignments_accepted']} of {mission['alignments_tried']} tries accepted",
        f"exchanges: {tried['opened']} opened, {tried['done']} ends completed, {tried['failed']} failed",
        f"traffic: {traffic['exchanges'] / 1e3:.1f} kB in exchanges; whole maps would have cost "
        f"{traffic['full_lz4'] / 1e3:.0f} kB with LZ4, {traffic['full_raw'] / 1e3:.0f} kB raw",
    ]
    lanes = {lane: traffic[lane] for lane in ("beacon", "status", "control", "bulk") if lane in traffic}
    if lanes:
        lines.append("by kind: " + ", ".join(f"{lane} {count / 1e3:.1f} kB" for lane, count in lanes.items()))
    lines += [f"not judged: {reason}" for reason in assessment["not_judged"]]
    for line in lines:
        _say(line, console)


def _print_robots(robots: dict[str, Any], console: Console) -> None:
    """A line a measure, a column a robot."""
    table = Table("", *robots, box=None)
    for title, (part, key) in ROBOT_ROWS.items():
        values = [(row[part] or {}).get(key) for row in robots.values()]
        if any(value is not None for value in values):
            table.add_row(title, *("-" if value is None else f"{value:g}" for value in values))
    console.print(table)


def _print_pairs(pairs: list[dict[str, Any]], console: Console) -> None:
    for pair in pairs:
        text = f"{pair['a']}-{pair['b']}: {pair['verdict']}"
        if pair["accepted_at_s"] is not None:
            text += f" {when_text(pair)}"
        if pair["error_m"] is not None:
            text += f", {pair['error_m']:.3f} m / {pair['error_deg']:.2f} deg off by {pair['judged_by']}"
            if pair["alignment_m"] is not None:
                text += f" (where the maps meet {pair['alignment_m']:.3f} m / {pair['alignment_deg']:.2f} deg)"
        elif pair["status"] != "accepted" and pair["reason"]:
            text += f" ({pair['reason']})"
        if pair["true_overlap"] is not None:
            text += f"; the maps share {100 * pair['true_overlap']:.0f} %"
        _say(text, console)
        for robot, view in pair["views"].items():
            off = "" if view["error_m"] is None else f", {view['error_m']:.3f} m / {view['error_deg']:.2f} deg off"
            _say(f"  by {robot}: {view['status']}{off}", console)


def _say(text: str, console: Console) -> None:
    console.print(text, highlight=False, soft_wrap=True, markup=False)
