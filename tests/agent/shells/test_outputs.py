"""What a robot leaves, and what it does where nothing can be left."""

from __future__ import annotations

import json
import resource
from pathlib import Path
from typing import Any

import pytest

from mrslam.agent import Agent, Event, Settings, write_robot
from mrslam.agent.shells import outputs
from mrslam.agent.shells.outputs import EventLog
from tests.full_disk import full_disk


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
    events.close()
    assert caplog.messages[1:] == ["r1: 3 events are not in events.jsonl"]


def test_what_cannot_be_written_is_told_and_the_rest_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(outputs, "write_image", full_disk)
    write_robot(Agent("r1", Settings()), tmp_path, {})
    assert "team_map.png cannot be written (No space left on device)" in caplog.text
    assert {path.name for path in tmp_path.iterdir()} >= {"robot.json", "map.yaml", "team_map.yaml", "trajectory.tum"}


def test_an_event_that_a_full_disk_cuts_off_just_before_its_end_does_not_spoil_the_next(tmp_path: Path) -> None:
    """The disk is full one byte too early, after a line that was cut off before."""
    path = tmp_path / "events.jsonl"
    path.write_text('{"t": 1.0, "rob')
    events = EventLog(tmp_path, "r1")
    line = '{"t": 2.0, "robot": "r1", "event": "merged"}'
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + 1 + len(line), limits[1]))
    try:
        events.write(Event(2_000_000_000, "merged"))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    events.write(Event(3_000_000_000, "merged"))
    events.close()
    assert path.read_text().splitlines() == ['{"t": 1.0, "rob', line, line.replace("2.0", "3.0")]


class LittleRoom:
    """A file on a disk that is full after some bytes."""

    def __init__(self, file: Any, room: int) -> None:
        self._file, self._room = file, room

    def write(self, raw: bytes) -> int:
        return int(self._file.write(raw[: self._room]))

    def close(self) -> None:
        self._file.close()


@pytest.mark.parametrize(("cut", "lost"), [(1, 0), (2, 1), (20, 1)])
def test_an_event_that_was_cut_off_is_lost_unless_only_the_end_of_its_line_is_missing(
    cut: int, lost: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    events = EventLog(tmp_path, "r1")
    line = b'{"t": 2.0, "robot": "r1", "event": "merged"}\n'
    monkeypatch.setattr(events, "_file", LittleRoom(events._file, len(line) - cut))
    events.write(Event(2_000_000_000, "merged"))
    events.close()
    assert (tmp_path / "events.jsonl").read_bytes() == line[:-cut]
    assert events.lost == lost and caplog.text.count("events cannot be written (one was cut off)") == lost


def test_files_of_an_earlier_run_do_not_stay(tmp_path: Path) -> None:
    (tmp_path / "team").mkdir()
    (tmp_path / "team" / "ghost.tum").write_text("0 0 0 0 0 0 0 1\n")
    earlier = [tmp_path / name for name in ("tracked.tum", "team_overlay.png")]
    for path in earlier:
        path.write_text("0 0 0 0 0 0 0 1\n")
    write_robot(Agent("r1", Settings()), tmp_path, {})
    assert not any(path.exists() for path in (tmp_path / "team", *earlier))
