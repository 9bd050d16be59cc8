"""What a robot's agent says of its beginning and of its doubts."""

from __future__ import annotations

import os
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from mrslam.agent import Agent, Event, Settings, checkpoint
from mrslam.rbpf import MapperConfig
from mrslam.sim_driver.cli.live import agent_messages
from mrslam.sim_driver.cli.live.agent_messages import WORDS, DoubtMessages, begin
from mrslam.spatial import Scan


def robot(particles: int = 3) -> Agent:
    return Agent("r1", Settings(rbpf=MapperConfig(particles=particles)), team="team", seed=0, boot_id=1)


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    lines: list[str] = []
    monkeypatch.setattr(agent_messages, "say", lines.append)
    return lines


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A robot's folder with its checkpoint after one scan, saved at noon."""
    agent = robot()
    scan = Scan(
        stamp_ns=0,
        ranges_m=np.full(180, 2.0, dtype=np.float32),
        angle_min_rad=-1.5,
        angle_increment_rad=3.0 / 180,
        range_max_m=8.0,
        range_min_m=0.1,
    )
    agent.on_scan(scan, np.zeros(3), 0)
    checkpoint.write(checkpoint.freeze(agent, 0), tmp_path / "checkpoint")
    noon_s = datetime(2026, 3, 1, 12).timestamp()
    os.utime(tmp_path / "checkpoint", (noon_s, noon_s))
    return tmp_path


def test_an_agent_that_goes_on_says_from_when(folder: Path, said: list[str]) -> None:
    agent = robot()
    (event,) = begin(agent, folder, False, 1_000_000_000)
    assert event.kind == "restarted" and event.fields["scans"] == 1
    assert agent.node.store.own_epoch == 1  # the same map to teammates
    assert said == [
        "r1 resumes from its checkpoint of 2026-03-01 12:00:00, which holds 1 scans; --fresh begins a new map"
    ]
    assert (folder / "checkpoint").exists()


def test_one_that_begins_anew_keeps_what_it_had(folder: Path, said: list[str]) -> None:
    saved = (folder / "checkpoint").read_bytes()
    agent = robot()
    assert begin(agent, folder, True, 0) == [] and agent.mapper.stats.scans == 0
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == {"checkpoint.old": saved}
    assert said == [f"r1 begins a new map; its checkpoint is kept as {folder / 'checkpoint.old'}"]
    assert begin(robot(), folder, True, 0) == [] and len(said) == 1
    assert (folder / "checkpoint.old").read_bytes() == saved


def test_one_that_begins_anew_again_and_again_keeps_all_that_it_had(folder: Path, said: list[str]) -> None:
    lives = [(folder / "checkpoint").read_bytes(), b"a second life", b"a third life"]
    for life in lives:
        (folder / "checkpoint").write_bytes(life)
        begin(robot(), folder, life != lives[1], 0)  # the second one does not fit
    kept = ["checkpoint.old", "checkpoint-2.old", "checkpoint-3.old"]
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == dict(zip(kept, lives, strict=True))
    assert [line.endswith(f"kept as {folder / name}") for line, name in zip(said, kept, strict=True)] == [True] * 3


def test_a_checkpoint_that_does_not_fit_is_kept_and_told(folder: Path, said: list[str]) -> None:
    saved = (folder / "checkpoint").read_bytes()
    (event,) = begin(robot(particles=5), folder, False, 0)
    assert event.fields["checkpoint"] is False
    assert said[0].startswith(f"{folder / 'checkpoint'}: made with other settings: rbpf.particles 3 (now 5)")
    assert "r1 begins a new map" in said[0]
    assert (folder / "checkpoint.old").read_bytes() == saved and not (folder / "checkpoint").exists()


def test_doubts_are_told_and_nothing_else(said: list[str]) -> None:
    agent, teller = robot(), DoubtMessages()
    t_ns = round(datetime(2026, 3, 1, 12, 30, 5).timestamp()) * 1_000_000_000
    fields = {"reason": "the scan shows no surfaces", "blind_s": 8.1, "map": "r1@monday"}
    fields |= {"x_m": 1.5, "y_m": -2.0, "theta_rad": 0.25}
    for kind in (*WORDS, "mapped", "link_changed"):
        teller.on_event(agent, Event(t_ns, kind, fields))
    assert [line.split(";")[0] for line in said] == [
        "12:30:05 r1 cannot use what its laser gives: the scan shows no surfaces",
        "12:30:05 r1 sees again, after 8.1 s",
        "12:30:05 r1 doubts where it is",
        "12:30:05 r1 knows again where it is",
        "12:30:05 r1 does not find its place in its map again",
        "12:30:05 r1 knows where it is in r1@monday: x 1.5 m, y -2.0 m, theta 0.25 rad in that map's frame",
        "12:30:05 r1 tracks its place in r1@monday from now on, and maps no more",
        "12:30:05 r1 has lost its place in r1@monday: the scan shows no surfaces",
        "12:30:05 r1 is not in r1@monday, as far as can be told: the scan shows no surfaces",
        "12:30:05 r1 does not know any more where it is in r1@monday: the scan shows no surfaces",
    ]


def test_saved_maps_that_come_are_told_and_what_is_good_is_no_warning() -> None:
    warned: list[str] = []
    told: list[str] = []
    teller = DoubtMessages(warned.append, told.append)
    places = {"map": "r1@monday", "x_m": 1.5, "y_m": -2.0, "theta_rad": 0.25}
    teller.on_event(robot(), Event(0, "map_updated", {"robot_id": "r2", "source": "r2"}))
    teller.on_event(robot(), Event(0, "map_updated", {"robot_id": "office@monday", "source": "r2"}))
    teller.on_event(robot(), Event(0, "localised", places))
    teller.on_event(robot(), Event(0, "not_localised", {"map": "r1@monday", "reason": "it moved"}))
    assert [line[9:] for line in told] == [
        "r1 got the saved map office@monday from r2",
        "r1 knows where it is in r1@monday: x 1.5 m, y -2.0 m, theta 0.25 rad in that map's frame",
    ]
    assert [line[9:] for line in warned] == ["r1 does not know any more where it is in r1@monday: it moved"]
