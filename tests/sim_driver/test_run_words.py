"""What ``mrslam run`` says of a mission that has ended, and how its options change the mission."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import typer

from mrslam.sim_driver.cli.runs.run import RunOptions, _mission, report

OUT = Path("out")


def pair(**more: Any) -> dict[str, Any]:
    return {
        "a": "r1", "b": "r2", "status": "accepted", "accepted_by": ["r1", "r2"], "accepted_at_s": 10.0,
        "both_at_s": 12.0, "not_by": {}, "placed_together_by": ["r1", "r2"], "confidence": 0.87, "error_m": None,
        "error_deg": None, "reason": "", **more,
    }  # fmt: skip


def told(capsys: pytest.CaptureFixture[str], **more: Any) -> list[str]:
    metrics = {"pairs": [], "links": [], "robots_lost": [], "mission_s": 61.4, **more}
    report(metrics, OUT, 7.6)
    return capsys.readouterr().err.splitlines()


def test_of_pairs_it_says_how_sure_and_how_far_off_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    unknown, known, last = told(capsys, pairs=[pair(), pair(error_m=0.0421, error_deg=0.376)])
    assert unknown.startswith("r1 and r2 merged after 12 s") and unknown.endswith(" (confidence 0.87)")
    assert known.endswith(" (confidence 0.87, 0.042 m / 0.38 deg off)")
    assert last == "61 s of mission in 8 s; look at out/report.html"


def test_of_pairs_that_were_not_merged_it_says_why(capsys: pytest.CaptureFixture[str]) -> None:
    apart = pair(status="rejected", accepted_by=[], accepted_at_s=None, both_at_s=None, placed_together_by=[],
                 not_by={"r1": "too little overlap", "r2": ""}, reason="too little overlap")  # fmt: skip
    said, _ = told(capsys, pairs=[apart])
    assert "too little overlap" in said and "confidence" not in said


def test_of_links_it_says_what_was_sent_and_what_whole_maps_would_have_cost(
    capsys: pytest.CaptureFixture[str],
) -> None:
    link = {"a": "r1", "b": "r2", "exchanges": 3, "bytes_sent": 25_000, "bytes_full_lz4": 100_000}
    nothing = {"a": "b1", "b": "b2", "exchanges": 1, "bytes_sent": 90, "bytes_full_lz4": 0}
    said, _ = told(capsys, links=[link, nothing])
    assert said == "r1-r2: 3 exchanges, 25.0 kB (75 % less than whole maps with LZ4)"


def test_robots_that_were_lost_and_scans_that_came_too_late_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    lost, late, _ = told(capsys, robots_lost=["r3"], scans_lost={"r1": 0, "r2": 4})
    assert lost == "r3 was lost: see out/r3"
    assert late.endswith(" before they could be taken: r2 4")
    assert len(told(capsys, scans_lost={"r1": 0, "r2": 0})) == 1


def options(**more: Any) -> RunOptions:
    given = {
        "mission": None, "recorded": None, "out": OUT, "shell": None, "speed": None, "seed": None, "assignments": [],
        "rrd": None, "view": False, "as_json": False,
    }  # fmt: skip
    return RunOptions(**{**given, **more})


def test_options_and_settings_are_laid_over_the_missions_the_later_over_the_earlier() -> None:
    asked = options(shell="virtual", seed=0, assignments=["mission.seed=5", "rbpf.particles=3"])
    assert asked.overrides == ['mission.shell="virtual"', "mission.seed=0", "mission.seed=5", "rbpf.particles=3"]
    assert options().overrides == []


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({}, "name either a mission file, or --from"),
        ({"mission": Path("m.toml"), "recorded": Path("run")}, "name either a mission file, or --from"),
        ({"recorded": Path("run"), "speed": 2.0}, "--from plays in virtual time"),
        ({"recorded": Path("x") / ".." / "out"}, "--out must be another folder than --from"),
    ],
)
def test_options_that_contradict_each_other_are_refused(more: dict[str, Any], words: str) -> None:
    with pytest.raises(typer.BadParameter, match=words):
        _mission(options(**more))
