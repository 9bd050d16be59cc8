"""``mrslam top``: whom it looks for, what it says where nobody is, and how a single look ends."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from typer.testing import CliRunner

from mrslam.comms import CommsNode, load_keys, make_team_keys, status_report
from mrslam.comms.transport.local_robots import announce
from mrslam.comms.zenoh import ZenohTransport
from mrslam.sim_driver.cli.app import app
from mrslam.sim_driver.cli.live.top import Watch, nobody
from tests.comms.processes import free_port
from tests.sim_driver.beside import beside

DEADLINE_S = 300.0


@pytest.fixture(autouse=True)
def alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only this test's robots are on this machine."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


@contextmanager
def robot(name: str, team: str, listen: str, keys: Path | None = None) -> Iterator[None]:
    """A robot that says again and again how it is."""
    given = None if keys is None else load_keys(keys, name, team)
    with closing(ZenohTransport(name, team, listen=[listen], keys=given)) as transport:
        node = CommsNode(name, team, 1)

        def live(over: threading.Event) -> None:
            while not over.is_set():
                transport.poll(0.05)
                transport.send(status_report(node, time.monotonic_ns()))

        with beside(live):
            yield


def looks_until(watch: Watch, true: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + DEADLINE_S
    while not true():
        assert time.monotonic() < deadline_s, watch.view.snapshot(0.0)
        watch.look()


def seen(watch: Watch) -> set[tuple[str, str]]:
    return {(row["team"], row["robot"]) for row in watch.view.snapshot(time.monotonic()) if row["status"] is not None}


def heard_s(watch: Watch) -> float:
    """Return when the first robot's newest status came, seconds of the monotonic clock."""
    return -float(watch.view.snapshot(0.0)[0]["status"]["age_s"])


def test_robots_of_this_machine_are_found_also_those_that_start_later() -> None:
    with robot("a", "red", f"tcp/127.0.0.1:{free_port()}"), closing(Watch(None, [], [], None, False)) as watch:
        looks_until(watch, lambda: seen(watch) == {("red", "a")})
        with robot("b", "blue", f"tcp/127.0.0.1:{free_port()}"):
            looks_until(watch, lambda: seen(watch) == {("red", "a"), ("blue", "b")})


def test_who_is_named_is_looked_for_there_and_nowhere_else() -> None:
    there = f"tcp/127.0.0.1:{free_port()}"
    with (
        robot("a", "red", there),
        robot("b", "red", f"tcp/127.0.0.1:{free_port()}"),
        closing(Watch("red", [], [there], None, False)) as watch,
    ):
        looks_until(watch, lambda: seen(watch) != set())
        first_s = heard_s(watch)
        looks_until(watch, lambda: heard_s(watch) > first_s + 1.0)  # the other one would have been seen by then
        assert seen(watch) == {("red", "a")}


def test_a_closed_team_is_seen_with_keys_and_is_the_one_that_is_watched(tmp_path: Path) -> None:
    make_team_keys(tmp_path / "keys", "locked", ["a", "b"])
    with robot("a", "locked", f"tls/127.0.0.1:{free_port()}", tmp_path / "keys" / "a"):
        with closing(Watch(None, [], [], tmp_path / "keys" / "b", False)) as watch:
            assert watch.team == "locked" and watch.closed_teams() == []
            looks_until(watch, lambda: seen(watch) == {("locked", "a")})
        with closing(Watch(None, [], [], None, False)) as watch:
            assert watch.closed_teams() == ["locked"]
            assert "team 'locked' runs on this machine and is closed: give a key folder" in nobody(watch, 2.0)


def test_of_closed_teams_those_that_were_asked_for_are_said() -> None:
    for team, kind in (("red", "tls"), ("blue", "tls"), ("green", "tcp")):
        announce(team, "a", [f"{kind}/127.0.0.1:{free_port()}"])
    with closing(Watch("blue", [], [f"tcp/127.0.0.1:{free_port()}"], None, False)) as watch:
        assert watch.closed_teams() == ["blue"]
        words = nobody(watch, 2.5)
    assert words.startswith("nobody is here: no robot of team 'blue' was seen in 2.5 s\n") and "'red'" not in words
    with closing(Watch(None, [], [f"tcp/127.0.0.1:{free_port()}"], None, False)) as watch:
        assert watch.closed_teams() == ["blue", "red"]
        assert nobody(watch, 2.5).startswith("nobody is here: no robot of any team was seen in 2.5 s\n")


def test_one_look_ends_with_1_where_nobody_is_and_says_so_in_words_or_in_json() -> None:
    result = CliRunner().invoke(app, ["top", "--no-multicast", "--once", "--wait", "0"])
    assert result.exit_code == 1 and "no robot of any team was seen in 0 s" in " ".join(result.output.split())
    announce("red", "a", [f"tls/127.0.0.1:{free_port()}"])
    result = CliRunner().invoke(app, ["top", "--no-multicast", "--json", "--wait", "0"])
    assert result.exit_code == 1
    assert json.loads(result.stdout) == {"robots": [], "closed_teams": ["red"], "bad": {}}


def test_one_look_waits_for_what_robots_say_of_themselves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there = f"tcp/127.0.0.1:{free_port()}"
    arguments = ["top", "--no-multicast", "--json", "--team", "red", "--connect", there, "--wait", str(DEADLINE_S)]
    with robot("a", "red", there):
        monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "elsewhere"))  # as if it ran on another machine
        result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    (row,) = json.loads(result.stdout)["robots"]
    assert (row["team"], row["robot"], row["here"], row["status"]["mode"]) == ("red", "a", True, "distributed")
