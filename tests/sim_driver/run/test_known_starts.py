"""Robots whose starts are known merge where nothing but the starts says which of two places is right."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.replay.again import mission_of
from mrslam.spatial import InputError
from tests.sim_driver.runs import played


def tables(*, known: bool) -> dict[str, Any]:
    return {
        "mission": {"shell": "virtual", "seed": 3, "duration_s": 30.0},
        "world": {"name": "symmetric-house"},
        "robots": [
            {"id": "r1", "start": [2.0, 2.0, 0.0], "start_known": known},
            {"id": "r2", "start": [3.0, 2.5, 1.0], "start_known": known},
        ],
        "rbpf": {"particles": 4, "threads": 1},
        "comms": {"exchange_timeout_s": 5.0, "beacon_window": 16},
        "mutual_detection": {"encounters": False},  # the robots see each other, which says it, too
    }


def test_in_a_house_that_looks_the_same_turned_around_the_starts_decide(tmp_path: Path) -> None:
    pairs = {}
    for known in (False, True):
        run = played(tables(known=known), tmp_path / str(known))
        (pairs[known],) = json.loads((run / "metrics.json").read_text())["pairs"]
    assert pairs[False]["status"] == "rejected" and "ambiguous" in pairs[False]["reason"]
    assert (pairs[True]["status"], pairs[True]["accepted_by"]) == ("accepted", ["r1", "r2"])
    assert pairs[True]["error_m"] < 0.1
    assert mission_of(tmp_path / "True").settings_of["r2"].agent.starts["r1"] == [2.0, 2.0, 0.0]


def test_a_known_start_is_given(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"robots\.r1\.start_known must be false where no start is given"):
        make_mission({"world": {"name": "arena1"}, "robots": [{"id": "r1", "start_known": True}]}, tmp_path / "m.toml")
