"""Sums up what ``experiments.py`` measured: a table, and a plot of what is known over time."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np


def summary(rows: list[dict[str, Any]], names: Sequence[str]) -> str:
    """Return a Markdown table of all runs, a line an experiment, in the order of ``names``."""
    lines = [
        "| experiment | seeds | agree, worst | coverage, worst | explored, worst | in one map | way m, median / worst "
        "| way deg, median / worst | false | pairs aligned | missed "
        "| error m, median / worst | error deg, median / worst | first merge s | finished s | CPU s |",
        "|" + "---|" * 16,
    ]
    for name in names:
        runs = [row for row in rows if row["name"] == name]
        if not runs:
            continue
        pairs = [pair for row in runs for pair in row["pairs"]]
        total = len(pairs) + sum(len(row["rejected"]) for row in runs)
        errors = np.array([pair[2:4] for pair in pairs] or [[np.nan, np.nan]])
        ways = np.array([way[2:] for row in runs for way in row["ways"]] or [[np.nan, np.nan]])
        way, worst_way = np.median(ways, axis=0), ways.max(axis=0)
        placed = [{(a, b) for a, b, *_ in row["ways"]} for row in runs]
        in_one_map = sum((b, a) in seen for seen in placed for a, b in seen) // 2
        first = [min(pair[4] for pair in row["pairs"]) for row in runs if row["pairs"]]
        middle, worst = np.median(errors, axis=0), errors.max(axis=0)
        lines.append(
            f"| {name} | {len(runs)} | {min(r['agree'] for r in runs):.4f} | {min(r['coverage'] for r in runs):.4f} "
            f"| {min(r['explored'] for r in runs):.4f} "
            f"| {in_one_map}/{total} | {way[0]:.3f} / {worst_way[0]:.3f} | {way[1]:.2f} / {worst_way[1]:.2f} "
            f"| {sum(r['false_merges'] for r in runs)} "
            f"| {len(pairs)}/{total} | {sum(r['missed_merges'] for r in runs)} "
            f"| {middle[0]:.3f} / {worst[0]:.3f} | {middle[1]:.2f} / {worst[1]:.2f} "
            f"| {np.median(first) if first else np.nan:.0f} | {np.median([r['mission_s'] for r in runs]):.0f} "
            f"| {np.median([r['cpu_s'] for r in runs]):.0f} |"
        )
    return "\n".join(lines) + "\n"


def draw(rows: list[dict[str, Any]], path: Path) -> None:
    """Draw the known area over time, the mean over seeds, for every number of robots."""
    try:
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot as plt
    except ImportError:
        print("no matplotlib (pip install 'mrslam[sweep]'): no plot", file=sys.stderr)
        return
    figure, axes = plt.subplots(figsize=(7.0, 4.0), dpi=110)
    for n in (1, 2, 3, 6):
        runs = [row["known"] for row in rows if row["name"] == f"office-{n}"]
        if not runs:
            continue
        times = np.arange(0.0, 401.0, 10.0)
        curves = np.array([np.interp(times, *np.array(known).T) for known in runs])
        axes.plot(times, curves.mean(axis=0), label=f"{n} robot{'s' if n > 1 else ''} ({len(runs)} seeds)")
    axes.set_xlabel("mission time, s")
    axes.set_ylabel("known by the best informed robot, m²")
    axes.set_xlim(0.0, 400.0)
    axes.set_ylim(bottom=0.0)
    axes.grid(alpha=0.3)
    if axes.lines:
        axes.legend()
    figure.tight_layout()
    figure.savefig(path)
