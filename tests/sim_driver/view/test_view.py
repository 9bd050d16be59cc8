"""The view: it shows what is there, and whatever becomes of the viewer, the run is the same."""

from __future__ import annotations

import dataclasses
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from mrslam.agent import Event
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.run.run import run_mission
from mrslam.sim_driver.view import ViewOptions
from mrslam.sim_driver.view.files import join_recordings, open_recording
from mrslam.sim_driver.view.frame import Frame
from mrslam.sim_driver.view.watch import Handover
from mrslam.spatial import InputError, Scan

TABLES = {
    "mission": {"seed": 2, "duration_s": 12.0, "shell": "virtual", "record": False},
    "world": {"name": "arena2"},
    "robots": [{"id": "r1"}, {"id": "r2"}],
    "rbpf": {"particles": 4},
    "comms": {"exchange_timeout_s": 3.0, "beacon_window": 8},
}


def run(out: Path, view: ViewOptions | None = None) -> dict[str, bytes]:
    mission = make_mission(TABLES, Path("small.toml"))
    if view is not None:
        mission = dataclasses.replace(mission, view=view)
    run_mission(mission, out, lambda mission_s, total_s, text: None, lambda text: None)
    files = {str(p.relative_to(out)): p.read_bytes() for p in sorted(out.rglob("*")) if p.is_file()}
    return {name: content for name, content in files.items() if not name.endswith(".rrd")}


@pytest.fixture(scope="module")
def unseen(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    return run(tmp_path_factory.mktemp("view") / "unseen")


def test_a_recording_holds_every_robot_and_changes_nothing(unseen: dict[str, bytes], tmp_path: Path) -> None:
    options = ViewOptions(record=True, run_id="small-2", robots=("r1", "r2"))
    assert run(tmp_path / "seen", options) == unseen
    parts = [tmp_path / "seen" / robot / "view.rrd" for robot in ("r1", "r2")]
    assert all(part.stat().st_size > 1000 for part in parts)
    join_recordings(parts, tmp_path / "run.rrd")
    assert not any(part.exists() for part in parts)
    told = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", "print", "-v", str(tmp_path / "run.rrd")],
        capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    for path in (
        "r1/maps/r1/grid",
        "r2/maps/r2/grid",
        "r1/scan",
        "r2/particles",
        "r1/robot",
        "r1/links/r2",
        "r1/events",
    ):
        assert f"/{path}" in told, path
    assert told.count("small-2") >= 1


def test_a_viewer_that_is_not_there_changes_nothing(unseen: dict[str, bytes], tmp_path: Path) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    options = ViewOptions(address=f"rerun+http://127.0.0.1:{port}/proxy", robots=("r1", "r2"))
    assert run(tmp_path / "seen", options) == unseen


def test_a_viewer_that_never_answers_changes_nothing(unseen: dict[str, bytes], tmp_path: Path) -> None:
    with socket.socket() as mute:  # takes connections and never says a word
        mute.bind(("127.0.0.1", 0))
        mute.listen()
        options = ViewOptions(address=f"rerun+http://127.0.0.1:{mute.getsockname()[1]}/proxy", robots=("r1", "r2"))
        assert run(tmp_path / "seen", options) == unseen


class Slow:
    """A stream that takes a frame only when it is let."""

    def __init__(self, fails: bool = False) -> None:
        self.may, self.fails = threading.Semaphore(0), fails
        self.shown: list[int] = []
        self.told: list[str] = []
        self.threads: set[str] = set()
        self.closed = threading.Event()

    def open(self) -> None:
        self.threads.add(threading.current_thread().name)

    def show(self, frame: Frame) -> None:
        self.shown.append(frame.t_ns)
        if self.fails:
            raise OSError("the viewer went away")
        self.may.acquire()

    def tell(self, event: Event) -> None:
        self.told.append(event.kind)

    def close(self) -> None:
        self.closed.set()


def frame(t_ns: int) -> Frame:
    scan = Scan(
        stamp_ns=t_ns, ranges_m=np.ones(4, np.float32), angle_min_rad=0.0, angle_increment_rad=0.1, range_max_m=5.0
    )
    return Frame(t_ns, np.zeros(3), scan, scan, np.zeros((2, 3)))


def until(true) -> None:
    deadline = time.monotonic() + 20.0
    while not true():
        assert time.monotonic() < deadline
        threading.Event().wait(0.005)


def test_the_latest_frame_wins_and_no_event_is_lost() -> None:
    stream = Slow()
    view = Handover(stream)
    view.show(frame(0))
    until(lambda: stream.shown == [0])
    for t in range(1, 50):  # while the viewer is busy with the first
        view.show(frame(t))
        view.tell(Event(t, "merged"))
    stream.may.release()
    until(lambda: stream.shown == [0, 49])
    stream.may.release(5)
    view.close()
    assert stream.closed.is_set() and stream.told == ["merged"] * 49
    assert stream.threads == {"view"}  # never the caller's


def test_a_viewer_that_hangs_at_the_end_is_left_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mrslam.sim_driver.view.watch.CLOSE_S", 0.05)
    stream = Slow()
    view = Handover(stream)
    view.show(frame(0))
    until(lambda: stream.shown == [0])
    view.close()
    assert not stream.closed.is_set()
    stream.may.release()


def test_a_viewer_that_fails_ends_the_view_only(caplog: pytest.LogCaptureFixture) -> None:
    view = Handover(Slow(fails=True))
    view.show(frame(0))
    view.close()
    view.show(frame(1))
    assert "the view of a robot ended" in caplog.text


def test_a_run_without_a_recording_says_how_to_make_one(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--rrd"):
        open_recording(tmp_path)
    with pytest.raises(InputError, match="no robot recorded"):
        join_recordings([tmp_path / "none.rrd"], tmp_path / "run.rrd")
