"""What a robot leaves, and what it does where nothing can be left."""

from __future__ import annotations

import errno
import json
from pathlib import Path
from typing import Any

import pytest

from mrslam.agent import Agent, Event, Settings, write_robot
from mrslam.agent.shells import outputs
from mrslam.agent.shells.outputs import EventLog


def test_events_go_on_where_they_were(tmp_path: Path) -> None:
    for t in (1, 2):
        events = EventLog(tmp_path, "r1")
        events.write(Event(t * 1_000_000_000, "merged", {"a": "r1"}))
        events.close()
    lines = [json.loads(line) for line in (tmp_path / "events.jsonl").read_text().splitlines()]
    assert lines == [{"t": float(t), "robot": "r1", "event": "merged", "a": "r1"} for t in (1, 2)]


def test_a_line_that_was_cut_off_does_not_spoil_the_next(tmp_path: Path) -> None:
    (tmp_path / "events.jsonl").write_text('{"t": 1.0, "rob')
    events = EventLog(tmp_path, "r1")
    events.write(Event(2_000_000_000, "merged"))
    events.close()
    torn, line = (tmp_path / "events.jsonl").read_text().splitlines()
    assert torn == '{"t": 1.0, "rob' and json.loads(line)["t"] == 2.0


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full here")
def test_a_full_disk_loses_events_and_says_so_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "events.jsonl").symlink_to("/dev/full")
    events = EventLog(tmp_path, "r1")
    for _ in range(3):
        events.write(Event(0, "merged"))
    assert events.lost == 3
    assert [record.message for record in caplog.records] == ["r1: events cannot be written (No space left on device)"]


def test_what_cannot_be_written_is_told_and_the_rest_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def full(path: Path, *_: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(outputs, "write_image", full)
    write_robot(Agent("r1", Settings()), tmp_path, {})
    assert "team_map.png cannot be written (No space left on device)" in caplog.text
    assert {path.name for path in tmp_path.iterdir()} >= {"robot.json", "map.yaml", "team_map.yaml", "trajectory.tum"}
