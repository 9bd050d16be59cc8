"""``mrslam top`` against robots in processes of their own."""

from __future__ import annotations

import contextlib
import json
import os
import pty
import select
import signal
import subprocess
import sys
import time

import pytest

from mrslam.comms import CommsConfig, ExchangeDone, PeerSeen, make_team_keys
from mrslam.comms.transport.local_robots import folder, local_robots
from mrslam.comms.zenoh import ZenohTransport
from tests.comms.processes import DEADLINE_S, Robot, free_port, robot_keys
from tests.comms.team import big_map

EAGER = CommsConfig(exchange_timeout_s=20.0, beacon_period_s=0.1, beacon_window=20)
COMMAND = [sys.executable, "-c", "from mrslam.sim_driver.cli import main; main()", "top", "--no-multicast"]


def top(*options: str) -> tuple[int, str]:
    done = subprocess.run([*COMMAND, *options], capture_output=True, text=True, timeout=300, check=False)
    return done.returncode, done.stdout + done.stderr


@pytest.fixture
def alone(tmp_path, monkeypatch):
    """Only this test's robots are on this machine."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


@pytest.fixture
def two(alone):
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    robots = [
        Robot("a", config=EAGER, listen=[endpoint], local_map=big_map(300)),
        Robot("b", config=EAGER, connect=[endpoint], listen=[f"tcp/127.0.0.1:{free_port()}"]),
    ]
    robots[1].effect(ExchangeDone, peer="a")
    robots[0].effect(ExchangeDone, peer="b")
    yield endpoint, robots
    for robot in robots:
        robot.stop()


def test_robots_of_this_machine_are_found_and_told(two):
    code, text = top("--once", "--json")
    assert code == 0
    rows = {row["robot"]: row for row in json.loads(text)["robots"]}
    assert set(rows) == {"a", "b"}
    link = rows["b"]["status"]["links"][0]
    assert link["peer"] == "a"
    assert link["state"] == "strong"
    assert link["quality"] > 0.8
    assert 0 < link["next_exchange_s"] <= 20
    assert link["bytes_received"] > 1000
    assert rows["a"]["status"]["links"][0]["bytes_sent"] > 1000
    assert rows["b"]["status"]["maps"]["a"]["revision"] == 1
    code, text = top("--once", "--connect", two[0], "--team", "team")
    assert code == 0
    assert "b - a" in text
    assert "next exchange in" in text
    # Nobody takes the watcher for a robot.
    assert {r[2].peer for robot in two[1] for r in robot.heard if isinstance(r[2], PeerSeen)} == {"a", "b"}


def test_nobody_is_said_plainly_with_what_to_check(alone):
    code, text = top("--once", "--wait", "0.5")
    assert code == 1
    for words in ("nobody is here", "mrslam run MISSION", "--connect", "mrslam doctor"):
        assert words in text
    code, text = top("--once", "--json", "--wait", "0.5", "--team", "other")
    assert code == 1
    assert json.loads(text) == {"robots": [], "closed_teams": [], "bad": {}}


def test_the_live_view_shows_a_robot_that_starts_later_and_one_that_dies(alone):
    screen, end = pty.openpty()
    live = subprocess.Popen([*COMMAND], stdout=end, env={**os.environ, "COLUMNS": "150", "LINES": "40"})
    os.close(end)
    robot = Robot("late", config=EAGER, listen=[f"tcp/127.0.0.1:{free_port()}"])
    try:
        assert _shows(screen, "late")
        robot.kill()
        assert _shows(screen, "gone")
    finally:
        live.send_signal(signal.SIGINT)
        _shows(screen, "")
        live.wait(DEADLINE_S)
        os.close(screen)
        robot.stop()
    assert live.returncode == 0


def _shows(screen: int, text: str) -> bool:
    """Read a terminal until a text is there, or with none to its end; return whether it came in time."""
    shown, deadline = "", time.monotonic() + DEADLINE_S
    while (not text or text not in shown) and time.monotonic() < deadline:
        if select.select([screen], [], [], 0.2)[0]:
            try:
                shown += os.read(screen, 65_536).decode(errors="replace")
            except OSError:  # how a terminal ends
                return not text
    return text in shown and bool(text)


def test_a_closed_team_is_seen_with_keys_only(alone, tmp_path):
    make_team_keys(tmp_path / "keys", "team", ["a", "b"])
    port = free_port()
    robot = Robot("a", config=EAGER, listen=[f"tls/127.0.0.1:{port}"], keys=robot_keys(tmp_path / "keys", "a"))
    try:
        robot.up()
        code, text = top("--once", "--wait", "1")
        assert code == 1
        assert "'team' runs on this machine and is closed" in text
        code, text = top("--once", "--json", "--keys", str(tmp_path / "keys" / "b"))
        assert code == 0
        assert [row["robot"] for row in json.loads(text)["robots"]] == ["a"]
    finally:
        robot.stop()


def test_what_a_robot_leaves_for_others_of_its_machine(alone):
    endpoint = f"tcp/0.0.0.0:{free_port()}"
    with contextlib.closing(ZenohTransport("a", "team", listen=[endpoint])):
        found = local_robots()
        assert [(robot.team, robot.robot, robot.pid) for robot in found] == [("team", "a", os.getpid())]
        assert found[0].endpoints == [endpoint.replace("0.0.0.0", "127.0.0.1")]
        assert not found[0].is_secure
        assert folder().stat().st_mode & 0o077 == 0
    assert local_robots() == []
    stale = folder() / "team.b.1.json"
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    stale.write_text(json.dumps({"team": "team", "robot": "b", "pid": ended.pid, "endpoints": [endpoint]}))
    (folder() / "broken.json").write_text("{")
    assert local_robots() == []
    assert not stale.exists()
