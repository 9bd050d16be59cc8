"""From a run's folder back to a mission: the same robots, drive and radio, under settings of your choice."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mrslam.agent import Settings
from mrslam.sim_driver.missions.mission import Mission, make_mission
from mrslam.sim_driver.missions.run_files import CONFIG_FILE, LINKS_FILE, RUN_FORMAT, SCANS_FILE, TRUTH_FILE
from mrslam.sim_driver.missions.run_folder import read_config, read_metrics
from mrslam.sim_driver.missions.settings import made_with, parse_assignment
from mrslam.sim_driver.simulation.simulation import is_simulated
from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import write_bytes

REPLAYABLE = (*(section.name for section in dataclasses.fields(Settings)), "truth")
"""Sections whose settings can change without driving anew."""


def mission_of(run: Path, assignments: Sequence[str] = ()) -> Mission:
    """Return the mission that the run's folder holds the results of, with ``section.key=value`` laid over it."""
    config = read_config(run)
    always = ("mission", "robots", "links", "truth", "radio")
    tables: dict[str, Any] = {name: config[name] for name in always if name in config}
    tables |= {name: config[name] for name in ("world", "driver", "faults", "maps") if config.get(name) is not None}
    tables |= config.get("settings", {})
    _check_config(tables, run / CONFIG_FILE, config.get("format", 1))
    path = run / CONFIG_FILE
    mission = made_with(lambda tables: make_mission(tables, path), tables, assignments, str(path))
    source = config.get("replay")
    return dataclasses.replace(
        mission, folder=Path(config.get("folder", run)), replay=None if source is None else Path(source)
    )


def _check_config(tables: dict[str, Any], path: Path, written: object) -> None:
    """Raise where the file itself holds what no mission can, naming it; other errors are of ``--set``.

    ``written`` : the file's own ``format``.
    """
    try:
        make_mission(tables, path)
    except InputError as error:
        reason = str(error).removeprefix(f"{path}: ")
        if written != RUN_FORMAT:
            made = f"a run of format {written}, this program reads {RUN_FORMAT}; run the mission again"
            raise InputError(f"{path}: {made} ({reason})") from error
        raise InputError(f"{path}: {reason}") from error


def replay_mission(run: Path, assignments: Sequence[str] = ()) -> Mission:
    """Return the mission that plays a run again; what would need driving anew is refused."""
    for text in assignments:
        (section, key), _ = parse_assignment(text)
        if section not in REPLAYABLE and (section, key) != ("mission", "seed"):
            raise InputError(f"--set {text}: a replay keeps the drive and the radio; {section}.{key} needs a new run")
    if read_config(run).get("mission", {}).get("shell") == "agents":
        raise InputError(f"{run}: gathered of agents that ran on their own; that cannot be played again")
    if read_config(run).get("faults"):
        raise InputError(f"{run}: this run had [[faults]]; what robots sensed meanwhile cannot be played again")
    virtually = ['mission.shell="virtual"', f"mission.duration_s={_mission_s(run)!r}"]
    mission = mission_of(run, [*assignments, *virtually])
    source = run.resolve() if mission.replay is None else mission.replay
    for robot in mission.robots:
        if is_simulated(mission, robot) and not (source / robot.id / SCANS_FILE).exists():
            raise InputError(f"{source / robot.id}: no {SCANS_FILE}; the run was made with mission.record = false")
    return dataclasses.replace(mission, replay=source)


def _mission_s(run: Path) -> float:
    return float(read_metrics(run)["mission_s"])


def copy_truth(mission: Mission, out: Path) -> None:
    """Take over what the recorded run knew of the truth, so that the replay is judged by it, too."""
    assert mission.replay is not None
    for robot in mission.robots:
        truth = mission.replay / robot.id / TRUTH_FILE
        if truth.exists():
            write_bytes(out / robot.id / TRUTH_FILE, truth.read_bytes())
    links = mission.replay / LINKS_FILE
    if links.exists():
        shutil.copyfile(links, out / LINKS_FILE)
