from __future__ import annotations

from pathlib import Path

import pytest

from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.missions.traces import LinkTrace, TracedLinks
from mrslam.sim_driver.run.team import read_trace
from mrslam.spatial import InputError


def read(tmp_path: Path, text: str) -> LinkTrace:
    path = tmp_path / "t.csv"
    path.write_text(text)
    return LinkTrace.read(path)


def test_quality_is_a_staircase_and_the_same_both_ways(tmp_path: Path) -> None:
    trace = read(tmp_path, "# comment\nt_s,a,b,quality\n10,r1,r2,0.5\n20,r2,r1,0.9\n")
    at = [trace.quality("r2", "r1", round(t * 1e9)) for t in (0, 9.9, 10, 19.9, 20, 1e6)]
    assert at == [0.0, 0.0, 0.5, 0.5, 0.9, 0.9]
    assert trace.quality("r1", "r3", 0) == 0.0
    assert TracedLinks(trace, "r1", ["r2", "r3"]).qualities(15_000_000_000) == {"r2": 0.5, "r3": 0.0}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "holds no link quality"),
        (f"0,r1,{'2' * 200_000},0.5\n", "t.csv: not a CSV file"),
        ("0,r1,r2\n", "line 1: needs t_s,a,b,quality"),
        ("0,r1,r2,high\n", "line 1: needs"),
        ("0,r1,r2,1.5\n", "quality in 0..1"),
        ("0,r1,r2,nan\n", "quality in 0..1"),
        ("0,r1,r1,0.5\n", "two robots"),
        ("5,r1,r2,0.5\n4,r1,r2,0.5\n", "line 2: times of a pair must not run backward"),
    ],
)
def test_broken_traces_name_the_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read(tmp_path, text)


def test_a_trace_of_other_robots_is_told(tmp_path: Path) -> None:
    read(tmp_path, "0,r1,rX,1.0\n")
    tables = {"links": {"trace": str(tmp_path / "t.csv")}, "robots": [{"id": r, "log": "x"} for r in ("r1", "r2")]}
    with pytest.raises(InputError, match="tells of r1-rX, and of no pair of r1, r2"):
        read_trace(make_mission(tables, tmp_path / "m.toml"))


@pytest.mark.parametrize(("source", "message"), [("trace", "no trace is given"), ("model", "no radio to model")])
def test_link_qualities_from_nowhere_are_refused(tmp_path: Path, source: str, message: str) -> None:
    tables = {"comms": {"link_source": source}, "robots": [{"id": r, "log": "x"} for r in ("r1", "r2")]}
    with pytest.raises(InputError, match=message):
        read_trace(make_mission(tables, tmp_path / "m.toml"))
