"""What ``mrslam eval`` prints of an assessment, and the references that it takes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from mrslam.sim_driver.cli.runs.eval import ROBOT_ROWS, _reference, print_tables
from mrslam.spatial import InputError
from mrslam.spatial.files.tum import write_tum

PAIR = {
    "a": "r1", "b": "r2", "verdict": "unknown", "status": "rejected", "accepted_at_s": None, "error_m": None,
    "error_deg": None, "judged_by": None, "alignment_m": None, "alignment_deg": None, "reason": "too little",
    "true_overlap": 0.25, "views": {"r1": {"status": "rejected", "error_m": None, "error_deg": None}},
}  # fmt: skip
MISSION = {
    "bytes": {"exchanges": 2500, "full_lz4": 9000, "full_raw": 80_000, "beacon": 1500},
    "exchanges": {"opened": 3, "done": 4, "failed": 1}, "first_merge_s": 12.0, "first_correct_merge_s": None,
    "correct_merges": 0, "false_merges": 1, "missed_merges": 2, "alignments_accepted": 1, "alignments_tried": 5,
}  # fmt: skip


def printed(robots: dict[str, Any], **pair: Any) -> list[str]:
    console = Console(width=200)
    assessment = {
        "robots": robots, "pairs": [{**PAIR, **pair}], "mission": MISSION, "not_judged": ["r2: no truth"],
        "saved_maps": [{"robot": "r1", "map": "office@monday", "localised_s": 11.2, "lost_s": None, "reason": ""}],
    }  # fmt: skip
    with console.capture() as shown:
        print_tables(assessment, console)
    return [" ".join(line.split()) for line in shown.get().splitlines()]


def robot(**parts: Any) -> dict[str, Any]:
    return dict.fromkeys({part for part, _ in ROBOT_ROWS.values()}) | parts


def test_a_measure_is_printed_where_any_robot_has_it() -> None:
    lines = printed({"r1": robot(trajectory={"ate_rmse_m": 0.125}), "r2": robot(usage={"cpu_s": 3.0})})
    assert "ATE m 0.125 -" in lines and "CPU s - 3" in lines
    assert not any(line.startswith("MB") for line in lines)


def test_pairs_say_why_they_do_not_fit_or_how_far_they_are_off() -> None:
    assert "r1-r2: unknown (too little); the maps share 25 %" in printed({"r1": robot()})
    off = {"status": "accepted", "verdict": "wrong", "error_m": 1.5, "error_deg": 3.25, "judged_by": "truth"}
    lines = printed({"r1": robot()}, **off)
    assert "r1-r2: wrong, 1.500 m / 3.25 deg off by truth; the maps share 25 %" in lines


def test_the_mission_is_told_in_lines() -> None:
    lines = printed({"r1": robot()})
    assert "first merge 12 s, first correct merge none; 0 correct, 1 false, 2 missed" in lines
    assert "alignments: 1 of 5 tries accepted" in lines
    assert "exchanges: 3 opened, 4 ends completed, 1 failed" in lines
    assert "traffic: 2.5 kB in exchanges; whole maps would have cost 9 kB with LZ4, 80 kB raw" in lines
    assert "r1 was localised in office@monday after 11 s" in lines
    assert "by kind: beacon 1.5 kB" in lines and "not judged: r2: no truth" in lines


def test_a_reference_is_of_all_robots_or_of_one(tmp_path: Path) -> None:
    path = tmp_path / "way.tum"
    write_tum(path, np.arange(3) * 10**9, np.zeros((3, 3)))
    assert _reference(str(path))[0] == "" and _reference(f"r1={path}")[0] == "r1"
    assert len(_reference(f"r1={path}")[1][0]) == 3
    with pytest.raises(InputError, match=f"--reference wants FILE or ROBOT=FILE, got '={path}'"):
        _reference(f"={path}")
