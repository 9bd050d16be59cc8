"""Running a mission: its folder, its shell, its metrics."""

from __future__ import annotations

import importlib.metadata
import json
import platform
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from mrslam.sim_driver.kernels import ensure_compiled
from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.missions.run_files import CHECKPOINT, CONFIG_FILE, EVENTS_FILE, ROBOT_FILE, RUN_FORMAT
from mrslam.sim_driver.missions.settings import as_table
from mrslam.sim_driver.replay import drive_holds_until_s
from mrslam.sim_driver.replay.again import copy_truth
from mrslam.sim_driver.run.earlier import clear_earlier, earlier_set_aside
from mrslam.sim_driver.run.metrics import write_metrics
from mrslam.sim_driver.run.run_process import run_processes
from mrslam.sim_driver.run.run_shares import run_in_shares
from mrslam.sim_driver.run.team_ways import fill_team_ways
from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import held, make_folder, write_text

LIBRARIES = ("mrslam", "numpy", "numba", "scipy", "opencv-python-headless", "eclipse-zenoh", "lz4")


Progress = Callable[[float, float | None, str], None]
"""Takes how far a run is: mission time so far and in all (None: not known), seconds, and a few words."""


Interrupts = Callable[[], AbstractContextManager[Callable[[], bool]]]
"""Entered for as long as a mission runs in virtual time, it yields what says whether to end it early."""


def run_mission(
    mission: Mission,
    out: Path,
    progress: Progress,
    say: Callable[[str], None],
    interrupts: Interrupts = lambda: nullcontext(lambda: False),
    processes: int = 1,
) -> dict[str, Any]:
    """Run the mission in its shell, leave everything in the folder ``out``, and return the metrics.

    Those of a mission that was interrupted say so (``interrupted``). ``processes`` : in which a mission in virtual time
    is played (:func:`mrslam.sim_driver.run.run_shares.processes_for`), the same bytes with any number.
    """
    if mission.mission.shell == "agents":
        raise InputError(f"{mission.mission.name}: these agents ran on their own; what they did cannot be run again")
    if mission.faults and mission.mission.shell == "process":
        raise InputError(f"{mission.mission.name}: [[faults]] are played in virtual time only; add --shell virtual")
    check_files(mission)
    with held(out):
        return _run_held(mission, out, progress, say, interrupts, processes)


def _run_held(
    mission: Mission,
    out: Path,
    progress: Progress,
    say: Callable[[str], None],
    interrupts: Interrupts,
    processes: int,
) -> dict[str, Any]:
    with earlier_set_aside(mission, out) as earlier:
        _begin_folder(mission, out, say, earlier)
        compile_s = ensure_compiled(say)
        start = time.monotonic()
        if mission.mission.shell == "virtual":
            with interrupts() as stop:
                outcome = run_in_shares(mission, out, progress, stop, processes)
        else:
            outcome = run_processes(mission, out, progress, say)
        wall_s = time.monotonic() - start
    if mission.replay is not None:
        copy_truth(mission, out)
        holds_s = drive_holds_until_s(mission, mission.replay, out)
        outcome["replay"] = {"of": str(mission.replay), "drive_holds_until_s": holds_s}
    fill_team_ways(out, [robot.id for robot in mission.robots], say)
    # Wall-clock figures stay out of virtual runs' metrics: the same seed gives the same bytes.
    virtual = mission.mission.shell == "virtual"
    return write_metrics(
        mission, out, wall_s=0.0 if virtual else wall_s, compile_s=0.0 if virtual else round(compile_s, 3), **outcome
    )


def check_files(mission: Mission) -> None:
    """Raise ``InputError`` for a file that the mission names and that is not there, before anything is started."""
    for name in mission.files:
        mission.find(name)


def prepare_folder(mission: Mission, out: Path, say: Callable[[str], None]) -> None:
    """Make the run's folder with the resolved configuration; raise where a file stands in its place.

    What an earlier run left there is removed: it would be taken for this one's.
    """
    make_folder(out)
    _begin_folder(mission, out, say, clear_earlier(mission, out))


def _begin_folder(mission: Mission, out: Path, say: Callable[[str], None], earlier: str | None) -> None:
    if earlier is not None:
        say(f"{out} held an earlier run of {earlier}: it is replaced")
    for robot in mission.robots:
        for left in (EVENTS_FILE, CHECKPOINT, ROBOT_FILE):
            (out / robot.id / left).unlink(missing_ok=True)
    config = {
        "format": RUN_FORMAT,
        "folder": str(mission.folder),
        "replay": None if mission.replay is None else str(mission.replay),
        "mission": as_table(mission.mission),
        "robots": as_table(mission.robots),
        "links": as_table(mission.links),
        "truth": as_table(mission.truth),
        "world": as_table(mission.world),
        "driver": as_table(mission.driver),
        "radio": as_table(mission.radio),
        "faults": as_table(mission.faults),
        "maps": as_table(mission.maps),
        "settings": as_table(mission.settings),
        "versions": {
            "python": platform.python_version(),
            **{name: importlib.metadata.version(name) for name in LIBRARIES},
        },
    }
    write_text(out / CONFIG_FILE, json.dumps(config, indent=1) + "\n")
