"""The files by which ``mrslam top`` finds the robots of its machine."""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path

import pytest

from mrslam.comms.transport.local_robots import announce, folder, local_robots, withdraw

LISTEN = ["tcp/0.0.0.0:7447"]


@pytest.fixture
def place(tmp_path, monkeypatch) -> Path:
    """Return where the files lie."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return folder()


@pytest.mark.parametrize(
    ("listens", "reached_at"),
    [
        ("tcp/0.0.0.0:7447", "tcp/127.0.0.1:7447"),
        ("tls/[::]:7447#iface=eth0", "tls/[::1]:7447"),
        ("tcp/10.0.0.5:1", "tcp/10.0.0.5:1"),
    ],
)
def test_a_robot_is_found_where_it_is_reached_from_here_until_it_leaves(place, listens, reached_at):
    path = announce("team", "a", [listens])
    (robot,) = local_robots()
    assert (robot.team, robot.robot, robot.pid, robot.endpoints) == ("team", "a", os.getpid(), [reached_at])
    assert robot.is_secure == listens.startswith("tls")
    assert path.parent == place and stat.S_IMODE(place.stat().st_mode) == 0o700
    withdraw(path)
    assert local_robots() == [] and not path.exists()


def test_who_listens_nowhere_leaves_no_file(place):
    assert announce("team", "a", []) is None
    withdraw(None)
    assert not place.exists() and local_robots() == []


def test_robots_of_one_name_in_two_teams_are_two(place):
    for team in ("red", "blue"):
        announce(team, "a", LISTEN)
    assert [robot.team for robot in local_robots()] == ["blue", "red"]


def test_what_a_killed_robot_left_is_removed_and_what_is_broken_passed_over(place):
    path = announce("team", "a", LISTEN)
    gone = json.loads(path.read_text()) | {"robot": "b", "pid": 2**22 + 1}  # above every process id
    (place / "team.b.1.json").write_text(json.dumps(gone))
    (place / "broken.json").write_text("{")
    assert [robot.robot for robot in local_robots()] == ["a"]
    assert sorted(one.name for one in place.iterdir()) == sorted(["broken.json", path.name])


def test_another_users_folder_is_neither_read_nor_written(place, monkeypatch):
    announce("team", "a", LISTEN)
    monkeypatch.setattr(os, "getuid", lambda: place.stat().st_uid + 1)
    assert local_robots() == []
    assert announce("team", "b", LISTEN) is None and len(list(place.iterdir())) == 1
