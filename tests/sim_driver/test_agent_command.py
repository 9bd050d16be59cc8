"""``mrslam agent``: real processes, a driver that sends scans, a log played as a laser, a restart."""

from __future__ import annotations

import itertools
import json
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from typer.testing import CliRunner

from mrslam.comms import make_team_keys
from mrslam.comms.zenoh import SensorPublisher
from mrslam.sim_driver.cli.app import app
from mrslam.sim_driver.feeds import Reading, open_feed
from mrslam.sim_driver.report import write_report
from mrslam.sim_driver.run.gather import gather
from mrslam.spatial import write_map
from mrslam.spatial.files.saved_map import read_saved_map
from tests.comms.processes import free_port
from tests.merge.plans import building
from tests.sim_driver.beside import beside


def address(kind: str = "tcp") -> str:
    return f"{kind}/127.0.0.1:{free_port()}"


STARTED: list[subprocess.Popen[str]] = []


@pytest.fixture(autouse=True)
def nobody_is_left() -> Iterator[None]:
    """End what a failed test left running."""
    yield
    while STARTED:
        STARTED.pop().kill()


def start(*arguments: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", "from mrslam.sim_driver.cli import main; main()", "agent", *arguments]
    STARTED.append(subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True))
    return STARTED[-1]


def stop(process: subprocess.Popen[str]) -> str:
    process.send_signal(signal.SIGTERM)
    words, _ = process.communicate(timeout=300)
    assert process.returncode == 0, words
    return words


def count(out: Path, event: str) -> int:
    path = out / "events.jsonl"
    return path.read_text().count(f'"event": "{event}"') if path.exists() else 0


def wait_for(true: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    """Wait until it is true; the process must live."""
    deadline = time.monotonic() + 300
    while not true():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.1)


@contextmanager
def driver(robot: str, team: str, sensors: str, readings: Sequence[Reading]) -> Iterator[None]:
    """A laser that runs on and on, whether anyone listens or not."""
    with closing(SensorPublisher(robot, team, sensors)) as publisher:

        def drive(over: threading.Event) -> None:
            for reading in itertools.cycle(readings):
                publisher.scan(reading.scan, reading.T_odom_base)
                if over.wait(0.03):
                    return

        with beside(drive):
            yield


def test_to_localise_takes_a_saved_map(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["agent", "r1", "--localise", "--duration", "1", "--out", str(tmp_path / "r1")])
    assert result.exit_code == 2 and "--localise needs a saved map" in " ".join(result.output.split())


def test_drivers_feed_an_agent_and_it_goes_on_after_a_kill(data_dir: Path, tmp_path: Path) -> None:
    readings = open_feed(data_dir / "slam" / "mit-csail.clf.gz").readings[:300]
    sensors, out = address(), tmp_path / "r1"
    options = ("r1", "--team", "drivers", "--no-multicast", "--sensors", sensors, "--out", str(out))
    options += ("--set", "rbpf.particles=3", "--set", "agent.checkpoint_interval_s=0.5")
    with driver("r1", "drivers", sensors, readings):
        process = start(*options)
        wait_for(lambda: count(out, "mapped") >= 5 and (out / "checkpoint").exists(), process)
        first_ns = (out / "checkpoint").stat().st_mtime_ns  # it may have been begun before the first scan
        wait_for(lambda: (out / "checkpoint").stat().st_mtime_ns > first_ns, process)
        process.kill()
        process.communicate()
        process = start(*options)
        wait_for(lambda: count(out, "restarted") == 1, process)
        words = stop(process)
    assert "everything is in" in words and "r1 resumes from its checkpoint of 20" in words
    events = map(json.loads, (out / "events.jsonl").read_text().splitlines())
    back = next(event for event in events if event["event"] == "restarted")
    assert back["checkpoint"] and back["scans"] > 0
    assert json.loads((out / "robot.json").read_text())["scans"] >= back["scans"]


def test_a_log_is_gone_on_with_after_a_restart(data_dir: Path, tmp_path: Path) -> None:
    out, log = tmp_path / "r1", str(data_dir / "slam" / "mit-csail.clf.gz")
    options = ("r1", "--team", "again", "--no-multicast", "--log", log, "--out", str(out))
    options += ("--set", "rbpf.particles=3", "--set", "agent.checkpoint_interval_s=0.5")
    process = start(*options)
    wait_for(lambda: count(out, "mapped") >= 3, process)
    stop(process)
    before = (out / "trajectory.tum").read_text().splitlines()
    process = start(*options)
    wait_for(lambda: count(out, "restarted") == 1 and count(out, "mapped") >= 5, process)
    assert "continues after the last scan" in stop(process)
    stamps = [float(line.split()[0]) for line in (out / "trajectory.tum").read_text().splitlines()]
    assert len(stamps) > len(before) and stamps == sorted(set(stamps))


def test_an_agent_that_cannot_write_says_so_and_ends(tmp_path: Path) -> None:
    (tmp_path / "r1").write_text("")
    process = start("r1", "--no-multicast", "--mode", "central", "--out", str(tmp_path / "r1"))
    words, _ = process.communicate(timeout=120)
    assert process.returncode == 1 and "cannot be made a folder" in words


def test_what_goes_wrong_once_it_is_on_the_network_ends_it_too(tmp_path: Path) -> None:
    (tmp_path / "r1" / "events.jsonl").mkdir(parents=True)
    process = start("r1", "--no-multicast", "--mode", "central", "--out", str(tmp_path / "r1"))
    words, _ = process.communicate(timeout=120)
    assert process.returncode == 1 and "events.jsonl" in words


def test_two_agents_do_not_write_into_one_folder(tmp_path: Path) -> None:
    options = ("r1", "--team", "twice", "--no-multicast", "--mode", "central", "--out", str(tmp_path / "r1"))
    first = start(*options)
    wait_for((tmp_path / "r1" / "agent.json").exists, first)
    second = start(*options)
    words, _ = second.communicate(timeout=120)
    assert second.returncode == 1 and "another process writes there" in words
    stop(first)


def test_agents_with_keys_take_each_others_maps(data_dir: Path, tmp_path: Path) -> None:
    make_team_keys(tmp_path / "keys", "locked", ["base", "r1"])
    sensors, meeting = address(), address("tls")
    common = ("--team", "locked", "--no-multicast", "--set", "rbpf.particles=3", "--set", "comms.exchange_timeout_s=1")
    base = ("base", *common, "--mode", "central", "--keys", str(tmp_path / "keys" / "base"), "--listen", meeting)
    r1 = ("r1", *common, "--sensors", sensors, "--keys", str(tmp_path / "keys" / "r1"), "--connect", meeting)
    readings = open_feed(data_dir / "slam" / "mit-csail.clf.gz").readings[:300]
    with driver("r1", "locked", sensors, readings):
        station = start(*base, "--out", str(tmp_path / "base"))
        robot = start(*r1, "--out", str(tmp_path / "r1"))
        wait_for(lambda: count(tmp_path / "base", "map_updated") > 0, robot)
        stop(robot)
        stop(station)
    assert count(tmp_path / "base", "dropped") == 0
    _, metrics = gather([tmp_path], tmp_path / "run", print)
    assert metrics["links"][0]["exchanges"] > 0 and not metrics["robots_lost"]
    assert metrics["mission_s"] < 300.0 and metrics["name"] == "locked"
    assert write_report(tmp_path / "run").exists()


@pytest.mark.parametrize("option", [("--log", "nowhere.clf"), ("--listen", "nonsense"), ("--set", "rbpf.particle=3")])
def test_mistakes_are_one_line(option: tuple[str, str], tmp_path: Path) -> None:
    process = start("r1", "--no-multicast", "--sensors", address(), "--out", str(tmp_path), *option)
    words, _ = process.communicate(timeout=300)
    assert process.returncode == 1
    assert "mrslam: " in words and "Traceback" not in words


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--map", "x.mrslam", "--near", "a,b"), "--near wants X,Y or X,Y,THETA in metres and radians"),
        (("--map", "x.mrslam", "--near", "1"), "none beyond 1e+06, got '1'"),
        (("--near", "1,2"), "--near is a place of one saved map: name one map with it"),
        (("--save", "x.txt"), "x.txt: name a saved map"),
        (("--set", "rbpf.particle=3"), "--set: rbpf: unknown key 'particle'"),
    ],
)
def test_a_hint_is_a_place_of_one_map_and_what_is_saved_is_a_saved_map(
    options: tuple[str, ...], words: str, tmp_path: Path
) -> None:
    process = start("r1", "--no-multicast", "--sensors", address(), *options, "--out", str(tmp_path / "r1"))
    told, _ = process.communicate(timeout=300)
    assert process.returncode == 1 and words in told.replace("\n", " ") and not (tmp_path / "r1").exists()


def test_a_session_is_saved_at_the_end(data_dir: Path, tmp_path: Path) -> None:
    log = data_dir / "multi_session" / "arena_raw_2.clf.gz"
    process = start(
        "r1", "--log", str(log), "--no-multicast", "--out", str(tmp_path / "r1"), "--set", "rbpf.particles=4",
        "--duration", "5", "--save", str(tmp_path / "arena.mrslam"),
    )  # fmt: skip
    words, _ = process.communicate(timeout=300)
    assert process.returncode == 0 and "1 session" in words
    (session,) = read_saved_map(tmp_path / "arena.mrslam").sessions
    assert session.name.startswith("r1@")


def test_a_session_goes_on_with_the_saved_map_that_it_was_given(data_dir: Path, tmp_path: Path) -> None:
    other = tmp_path / "hall.yaml"
    write_map(other, building())
    log = data_dir / "multi_session" / "arena_raw_2.clf.gz"
    process = start(
        "r1", "--log", str(log), "--no-multicast", "--out", str(tmp_path / "r1"), "--set", "rbpf.particles=4",
        "--duration", "5", "--map", str(other), "--save", str(tmp_path / "both.mrslam"),
    )  # fmt: skip
    words, _ = process.communicate(timeout=300)
    assert process.returncode == 1 and not (tmp_path / "both.mrslam").exists()
    assert f"not written, for nothing fits {other}:" in " ".join(
        words.split()
    )  # it comes first: what was seen now wins


def test_a_saved_map_is_looked_for_and_a_missing_one_is_one_line(data_dir: Path, tmp_path: Path) -> None:
    yaml = data_dir / "worlds" / "mrl_arena" / "mrl_arena.yaml"
    log = data_dir / "multi_session" / "arena_raw_2.clf.gz"
    common = ("r1", "--log", str(log), "--no-multicast", "--out", str(tmp_path / "r1"), "--set", "rbpf.particles=4")
    process = start(*common, "--map", str(yaml), "--duration", "3")
    words, _ = process.communicate(timeout=300)
    assert process.returncode == 0 and "r1 looks for its place in mrl_arena@mrl_arena" in words
    (place,) = json.loads((tmp_path / "r1" / "robot.json").read_text())["saved_maps"]
    assert place["map"] == "mrl_arena@mrl_arena" and place["state"] in ("not yet", "ambiguous")
    process = start(*common, "--map", str(tmp_path / "nowhere"))
    words, _ = process.communicate(timeout=300)
    assert process.returncode != 0
    assert [line for line in words.splitlines() if "nowhere" in line] and "Traceback" not in words
