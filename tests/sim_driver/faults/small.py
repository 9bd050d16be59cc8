"""A small mission with faults, in virtual time."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from mrslam.sim_driver.missions.mission import Mission, make_mission


def small(tmp_path: Path, *faults: dict[str, Any], **mission: Any) -> Mission:
    tables = {
        "mission": {"shell": "virtual", "duration_s": 20.0, "seed": 4, **mission},
        "world": {"name": "arena2"},
        "robots": [{"id": "r1"}, {"id": "r2"}],
        "rbpf": {"particles": 3, "threads": 1},
        "comms": {"exchange_timeout_s": 2.0},
        "agent": {"checkpoint_interval_s": 2.0},
        "faults": list(faults),
    }
    return make_mission(tables, tmp_path / "small.toml")


def events(folder: Path, robot: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / robot / "events.jsonl").read_text().splitlines()]


def quiet(*_: Any) -> None:
    """No progress is shown."""
