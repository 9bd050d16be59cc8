"""What a sweep's pictures show: sums, medians, runs that never merged, and the recommended setting."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrslam.sim_driver.sweep import Knob, parse_knob, plots
from mrslam.sim_driver.sweep.advice import Summary, summarise
from mrslam.sim_driver.sweep.plots import OUTCOMES, draw_all

plt = pytest.importorskip("matplotlib.pyplot")

A, B = parse_knob("comms.a=1,2"), parse_knob("comms.b=x,y")
Rows = list[dict[str, Any]]


def row(a: str, b: str, seed: int, merge_s: float | None, **more: Any) -> dict[str, Any]:
    counts = {"bytes_exchanged": 1000.0 * seed, "false_merges": 0, "missed_merges": 0, "wrong_on_the_way": 0}
    known = {"first_merge_s": merge_s, "first_correct_merge_s": merge_s, "coverage_worst": 0.5, "error_m": None}
    return {"comms.a": a, "comms.b": b, "seed": seed, "mission_s": 100.0, **known, **counts, **more}


def rows() -> Rows:
    """Four settings of three seeds; one of them never merged where b is y."""
    found = [row(a, b, seed, 10.0 * seed) for a in "12" for b in "xy" for seed in (1, 2, 3)]
    found[0] |= {"false_merges": 1}
    found[1] |= {"false_merges": 2, "error_m": 0.25}
    found[3] |= {"first_merge_s": None, "first_correct_merge_s": None}
    return found


@pytest.fixture
def drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Draw all pictures without writing them, and return what is on each, by its name."""
    figures: dict[str, Any] = {}
    monkeypatch.setattr(plots, "_save", lambda plt, figure, path: figures.setdefault(path.name, figure) and path)
    written = draw_all(rows(), summarise(rows(), (A, B)), (A, B), tmp_path)
    assert [path.name for path in written] == list(figures) == ["knobs.png", "pareto.png", "heatmap.png"]
    return figures


def cells(axis: Any) -> list[str]:
    return [text.get_text() for text in axis.texts]


def test_a_heat_map_sums_merges_up_and_takes_the_mean_of_times_and_else_the_median(drawn: dict[str, Any]) -> None:
    axes = {axis.get_title().partition(",")[0]: axis for axis in drawn["heatmap.png"].axes}
    assert {title: axis.get_title().rpartition(", ")[2] for title, axis in axes.items()} == {
        "time to first merge (s)": "mean", "exchanged (kB)": "median", "coverage of the least informed": "median",
        "merge error (m)": "median", "false merges": "in all runs", "missed merges": "in all runs",
    }  # fmt: skip
    assert cells(axes["time to first merge (s)"]) == ["20", "50", "20", "20"]  # 100 s of mission, 20 s and 30 s
    assert cells(axes["exchanged (kB)"]) == ["2"] * 4
    assert cells(axes["false merges"]) == ["3", "0", "0", "0"]
    assert cells(axes["merge error (m)"]) == ["0.25", "-", "-", "-"]
    one = axes["false merges"]
    assert (one.get_xlabel(), one.get_ylabel()) == ("comms.b", "comms.a")
    assert [text.get_color() for text in one.texts] == ["white", "black", "black", "black"]


def test_a_heat_map_says_where_no_run_ever_merged() -> None:
    never = [row(a, b, 1, None if a == "2" else 5.0) for a in "12" for b in "xy"]
    table = plots._table(never, A, B, "time to first merge (s)", OUTCOMES["time to first merge (s)"])
    np.testing.assert_array_equal(table, [[5.0, 5.0], [np.inf, np.inf]])
    _, axis = plt.subplots()
    plots._draw_table(axis, table, False)
    assert cells(axis) == ["5", "5", "never", "never"]


def test_lines_show_medians_of_each_value_and_how_many_runs_never_merged(drawn: dict[str, Any]) -> None:
    axes = drawn["knobs.png"].axes
    assert len(axes) == 2 * len(OUTCOMES) and [axis.get_xlabel() for axis in axes[:: len(OUTCOMES)]] == [A.key, B.key]
    time, of_b = axes[0], [line for line in axes[0].lines if line.get_label() in B.values]
    assert [list(line.get_ydata()) for line in of_b] == [[20.0, 20.0], [25.0, 20.0]]
    assert cells(time) == ["1 never"] and time.texts[0].xy == (0, 0)
    assert [text.get_text() for text in time.get_legend().get_texts()] == ["x", "y"]
    exchanged = [line for line in axes[1].lines if line.get_label() in B.values]
    assert [list(line.get_ydata()) for line in exchanged] == [[2.0, 2.0], [2.0, 2.0]]


def one(name: str, merge_s: float, kilobytes: float, false: int = 0, *, is_judged: bool = True) -> Summary:
    return Summary((name,), 5, merge_s, kilobytes, false, 0, 0.9, 0.05, is_judged)


@pytest.mark.parametrize(("is_judged", "label"), [(True, "the first right merge"), (False, "the first merge")])
def test_the_front_is_joined_false_merges_are_crossed_and_the_recommended_starred(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_judged: bool, label: str
) -> None:
    figures = []
    monkeypatch.setattr(plots, "_save", lambda plt, figure, path: figures.append(figure) or path)
    some = [one("best", 10.0, 50.0), one("cheap", 30.0, 20.0, 1), one("dear", 40.0, 90.0), one("never", np.inf, 1.0)]
    some[0] = one("best", 10.0, 50.0, is_judged=is_judged)
    plots._draw_pareto(plt, some, (Knob("comms.a", ("best", "cheap", "dear", "never")),), tmp_path)
    (axis,) = figures[0].axes
    shown = {line.get_label(): list(zip(line.get_xdata(), line.get_ydata(), strict=True)) for line in axis.lines}
    assert shown == {
        "a setting": [(50.0, 10.0), (90.0, 40.0)], "a setting with false merges": [(20.0, 30.0)],
        "beaten by none": [(20.0, 30.0), (50.0, 10.0)], "recommended": [(50.0, 10.0)],
    }  # fmt: skip
    assert [(text.get_text(), text.xy) for text in axis.texts] == [("cheap", (20.0, 30.0)), ("best", (50.0, 10.0))]
    assert label in axis.get_ylabel() and "kB" in axis.get_xlabel()
