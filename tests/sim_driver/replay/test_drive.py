"""Up to when a replay's robots would have driven as they did in the run that it plays again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.replay import drive_holds_until_s


def event(t: float, kind: str, **fields: Any) -> dict[str, Any]:
    pair = {"a": "r1", "b": "r2", "reason": "", "T_a_b": [1.0, 0.0, 0.0], "confidence": 0.9}
    more = {"status": "accepted", "evidence": {}} if kind == "alignment" else {}
    return {"t": t, "robot": "r1", "event": kind, **pair, **more, **fields}


MERGED = event(10.0, "merged")
FITS_NOT = event(4.0, "alignment", status="rejected", T_a_b=None)
TOLD = event(20.0, "map_updated", robot_id="r2")


@pytest.mark.parametrize(
    ("then", "now", "holds_s"),
    [
        ([MERGED], [MERGED], None),
        ([MERGED], [event(15.0, "merged")], 10.0),
        ([], [MERGED], 10.0),
        ([MERGED, TOLD], [MERGED], 20.0),  # what comes after the last event that both have
        ([MERGED], [FITS_NOT, MERGED], None),  # what does not fit changes nothing that a robot drives by
        ([event(4.0, "map_updated", robot_id="r2"), MERGED], [MERGED], 10.0),  # alone it drives by its own scans
        ([TOLD], [], None),  # never merged
    ],
)
def test_a_drive_holds_until_robots_that_have_merged_know_something_else(
    tmp_path: Path, then: list[dict[str, Any]], now: list[dict[str, Any]], holds_s: float | None
) -> None:
    mission = make_mission({"world": {"name": "arena1"}, "robots": [{"id": "r1"}]}, tmp_path / "m.toml")
    idle = make_mission({"world": {"name": "arena1"}, "robots": [{"id": "r1", "driver": "idle"}]}, tmp_path / "m.toml")
    for run, events in (("then", then), ("now", now)):
        (tmp_path / run / "r1").mkdir(parents=True)
        (tmp_path / run / "r1" / "events.jsonl").write_text("".join(json.dumps(one) + "\n" for one in events))
    assert drive_holds_until_s(mission, tmp_path / "then", tmp_path / "now") == holds_s
    assert drive_holds_until_s(idle, tmp_path / "then", tmp_path / "now") is None
