"""A sweep as pictures: outcomes against each setting varied, a heat map for two of them, and bytes against time."""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.sweep.advice import Summary, mean_merge_s, merge_s, pareto, recommend
from mrslam.sim_driver.sweep.plan import Knob
from mrslam.sim_driver.sweep.table import Rows
from mrslam.spatial import InputError

Value = Callable[[dict[str, Any]], float | None]
Table = NDArray[np.float64]

OUTCOMES: dict[str, Value] = {
    "time to first merge (s)": lambda row: merge_s(row),
    "exchanged (kB)": lambda row: row["bytes_exchanged"] / 1e3,
    "coverage of the least informed": lambda row: row["coverage_worst"],
    "merge error (m)": lambda row: row["error_m"],
    "false merges": lambda row: row["false_merges"],
    "missed merges": lambda row: row["missed_merges"],
}
"""Title -> value of a run; None: nothing to show, inf: never."""
SUMMED = {"merges": ", in all runs", "time": ", mean"}
"""How a heat map sums up runs where that is not their median, by the first or the last word of the title."""
DARK = 0.6
"""Cells above this share of the colour scale get white text, 0..1: black on them has too little contrast."""
INKS = ("#1f77b4", "#e66101", "#2c9646", "#c82850", "#7854be", "#009eaa", "#cd8c00", "#6e6e6e")
"""Colours of lines, one for each value of a second setting."""


def draw_all(rows: Rows, summaries: list[Summary], knobs: tuple[Knob, ...], out: Path) -> list[Path]:
    """Write the pictures and return them; raise ``InputError`` where matplotlib is not installed."""
    try:
        matplotlib = importlib.import_module("matplotlib")
    except ImportError as error:
        raise InputError("plots need matplotlib: pip install 'mrslam[sweep]'") from error
    matplotlib.use("Agg")
    plt = importlib.import_module("matplotlib.pyplot")
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "figure.dpi": 110})
    drawn = [_draw_knobs(plt, rows, knobs, out), _draw_pareto(plt, summaries, knobs, out)]
    if len(knobs) >= 2:
        drawn.append(_draw_heat(plt, rows, knobs[0], knobs[1], out))
    return drawn


def _draw_knobs(plt: Any, rows: Rows, knobs: tuple[Knob, ...], out: Path) -> Path:
    """A row a knob, a column an outcome: median and quartiles over seeds, a line a value of the next knob."""
    figure, axes = plt.subplots(
        len(knobs), len(OUTCOMES), figsize=(3.1 * len(OUTCOMES), 2.7 * len(knobs)), squeeze=False, layout="constrained"
    )
    for i, knob in enumerate(knobs):
        other = knobs[(i + 1) % len(knobs)] if len(knobs) > 1 else None
        for axis, (title, value) in zip(axes[i], OUTCOMES.items(), strict=True):
            for k, level in enumerate(other.values if other else ("",)):
                here = [row for row in rows if other is None or str(row[other.key]) == level]
                _draw_line(axis, here, knob, value, INKS[k % len(INKS)], level)
            axis.set_xticks(range(len(knob.values)), knob.values)
            axis.set_xlabel(knob.key)
            axis.set_title(title, fontsize=9)
            axis.set_ylim(bottom=0)
        if other is not None:
            axes[i][0].legend(title=other.key, fontsize=7, title_fontsize=7, frameon=False)
    return _save(plt, figure, out / "knobs.png")


def _draw_line(axis: Any, rows: Rows, knob: Knob, value: Value, ink: str, label: str) -> None:
    centres, lows, highs, places = [], [], [], []
    for x, setting in enumerate(knob.values):
        values = [value(row) for row in rows if str(row[knob.key]) == setting]
        known = np.array([v for v in values if v is not None and math.isfinite(v)])
        never = sum(v is not None and not math.isfinite(v) for v in values)
        if known.size:
            places.append(x)
            low, centre, high = np.percentile(known, [25, 50, 75])
            centres.append(centre)
            lows.append(low)
            highs.append(high)
            axis.plot(np.full(known.size, x), known, ".", color=ink, alpha=0.3, markersize=4)
        if never:
            axis.annotate(f"{never} never", (x, 0), color=ink, fontsize=6, ha="center", va="bottom")
    axis.plot(places, centres, "o-", color=ink, label=label, markersize=4)
    axis.fill_between(places, lows, highs, color=ink, alpha=0.12, linewidth=0)


def _draw_heat(plt: Any, rows: Rows, down: Knob, across: Knob, out: Path) -> Path:
    """Medians over seeds (and over all further settings) by two settings."""
    figure, axes = plt.subplots(2, 3, figsize=(12, 6.4), layout="constrained")
    for axis, (title, value) in zip(axes.flat, OUTCOMES.items(), strict=True):
        _draw_table(axis, _table(rows, down, across, title, value), title.startswith("coverage"))
        axis.set_xticks(range(len(across.values)), across.values)
        axis.set_yticks(range(len(down.values)), down.values)
        axis.set_xlabel(across.key)
        axis.set_ylabel(down.key)
        axis.set_title(title + SUMMED.get(title.split()[0], SUMMED.get(title.split()[-1], ", median")), fontsize=9)
    return _save(plt, figure, out / "heatmap.png")


def _table(rows: Rows, down: Knob, across: Knob, title: str, value: Value) -> Table:
    """Return an outcome by two settings: NaN where there is none, inf where it never happened."""
    table = np.full((len(down.values), len(across.values)), np.nan)
    for i, first in enumerate(down.values):
        for j, second in enumerate(across.values):
            here = [row for row in rows if (str(row[down.key]), str(row[across.key])) == (first, second)]
            values = [v for row in here if (v := value(row)) is not None]
            if values and title.startswith("time"):
                table[i, j] = mean_merge_s(here)
            elif values:
                table[i, j] = np.sum(values) if title.endswith("merges") else np.median(values)
    return table


def _draw_table(axis: Any, table: Table, good_high: bool) -> None:
    """Draw a table as coloured cells with their values; white text on dark cells."""
    shown = np.where(np.isfinite(table), table, np.nan)
    axis.imshow(shown, cmap="YlGnBu" if good_high else "YlOrRd", aspect="auto", vmin=None if good_high else 0)
    known = shown[np.isfinite(shown)]
    top = known.max() if known.size else 0.0
    least = known.min() if good_high and known.size else 0.0
    for (i, j), v in np.ndenumerate(table):
        text = "-" if np.isnan(v) else ("never" if np.isinf(v) else f"{v:.3g}")
        dark = np.isfinite(v) and top > least and (v - least) / (top - least) > DARK
        axis.text(j, i, text, ha="center", va="center", color="white" if dark else "black", fontsize=9)


def _draw_pareto(plt: Any, summaries: list[Summary], knobs: tuple[Knob, ...], out: Path) -> Path:
    """Every combination as a point; the line joins those nothing else beats."""
    figure, axis = plt.subplots(figsize=(8, 5), layout="constrained")
    merged = [one for one in summaries if math.isfinite(one.merge_s)]
    stained = [one for one in merged if one.false_merges]
    front, best = pareto(summaries), recommend(summaries)
    _plot(axis, [one for one in merged if not one.false_merges], "o", color="#9aa5b1", label="a setting")
    if stained:
        _plot(axis, stained, "x", color="#c82850", label="a setting with false merges")
    _plot(axis, front, "o-", color="#1f77b4", label="beaten by none", drawstyle="steps-post")
    for one in front:
        place = one.kilobytes, one.merge_s
        axis.annotate(" / ".join(one.settings), place, (5, 5), textcoords="offset points", fontsize=8)
    if best is not None:
        _plot(axis, [best], "*", color="#e66101", markersize=16, label="recommended", zorder=5)
    right = "right " if all(one.is_judged for one in summaries) else ""
    axis.set_xlabel("exchanged in the mission, kB (median over seeds)")
    axis.set_ylabel(f"time to the first {right}merge, s (mean over seeds)")
    axis.set_title("labels: " + " / ".join(knob.key for knob in knobs), fontsize=9)
    axis.legend(frameon=False, fontsize=8)
    return _save(plt, figure, out / "pareto.png")


def _plot(axis: Any, summaries: Sequence[Summary], mark: str, **style: Any) -> None:
    axis.plot([one.kilobytes for one in summaries], [one.merge_s for one in summaries], mark, **style)


def _save(plt: Any, figure: Any, path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, metadata={"Software": None})
    plt.close(figure)
    return path
