"""A share of the chaos missions; ``bench.chaos`` plays as many as one likes, and a broken one again by its seed."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from bench.chaos.mission import run_chaos

MISSIONS = int(os.environ.get("MRSLAM_CHAOS", "6"))


@pytest.mark.parametrize("seed", range(MISSIONS))
def test_nothing_breaks(seed: int, tmp_path: Path) -> None:
    outcome = run_chaos(seed, tmp_path)
    assert outcome.violations == []


def test_halves_of_a_house_that_looks_alike_are_taken_apart_once_both_are_seen(tmp_path: Path) -> None:
    outcome = run_chaos(2300047, tmp_path)  # before the robots have seen each other
    assert outcome.violations == []
    said = (tmp_path / "r2" / "events.jsonl").read_text()
    unmerged = [event for event in map(json.loads, said.splitlines()) if event["event"] == "unmerged"]
    assert '"merged"' in said and "another place fits" in unmerged[0]["reason"]


def test_a_map_that_its_own_scans_have_not_seen_is_doubted_by_all_who_get_it(tmp_path: Path) -> None:
    outcome = run_chaos(92293, tmp_path)  # its walls fit well enough to be looked at twice
    assert outcome.violations == []
    for robot in ("r1", "r2"):
        told = json.loads((tmp_path / robot / "robot.json").read_text())
        assert "of what its scans hit is wall in its own map" in told["unplaced"]["r3"]
