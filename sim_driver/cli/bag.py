"""``mrslam bag``: a run as a ROS2 recording, for the viewers of that world."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrslam.sim_driver.cli.console import say
from mrslam.sim_driver.cli.progress import progress_bar
from mrslam.sim_driver.evaluate.trajectories import in_mission_time
from mrslam.sim_driver.feeds.bag_writer import BagWriter
from mrslam.sim_driver.missions.run_files import (
    BAG_FILE,
    MAP_FILE,
    METRICS_FILE,
    SCANS_FILE,
    TRAJECTORY_FILE,
)
from mrslam.sim_driver.missions.run_folder import read_metrics, read_robot, robots_of
from mrslam.sim_driver.replay import read_recording
from mrslam.spatial import InputError, read_map
from mrslam.spatial.files.atomic import is_file
from mrslam.spatial.files.tum import read_tum

TEAM = "team"


def bag_run(run: Path, out: Path | None) -> None:
    """Write maps, ways and scans of a run, or of one mapped log, as one .mcap file."""
    out = run / BAG_FILE if out is None else out
    folders = _folders(run)
    if not folders:
        raise InputError(f"{run}: holds no map: name the folder of a finished run, or of a mapped log")
    robots = {name: read_robot(folder) or {} for name, folder in folders.items()}
    is_run = run not in folders.values() and is_file(run / METRICS_FILE)  # a mapped log has metrics of its own
    began_s = read_metrics(run).get("began_s", {}) if is_run else {}
    anchor = max(sorted(robots), key=lambda name: len(robots[name].get("placed", {})))
    with BagWriter(out) as bag, progress_bar(f"writing {out.name}", len(folders)) as advance:
        for name, T_team_map in robots[anchor].get("placed", {}).items():
            bag.transform(TEAM, f"map_{name}", 0, np.array(T_team_map), is_static=True)
        for name, folder in folders.items():
            _write_robot(bag, name, folder, began_s.get(name, 0.0))
            advance()
    say(f"{out}: {out.stat().st_size / 1e6:.1f} MB, {len(folders)} robots")


def _folders(run: Path) -> dict[str, Path]:
    """Return the folders that hold maps, by robot: those of the run's own robots, or that of a mapped log.

    In a folder of neither, as that of several agents, all count.
    """
    robots = robots_of(run)
    if robots is None and (run / MAP_FILE).exists():
        return {run.resolve().name: run}
    folders = run.glob("*/") if robots is None else (run / robot_id for robot_id in robots)
    return {folder.name: folder for folder in sorted(folders) if (folder / MAP_FILE).exists()}


def _write_robot(bag: BagWriter, name: str, folder: Path, began_s: float) -> None:
    """Write what one robot left. Times are the mission's, in which a recorded robot began at ``began_s``."""
    frame, laser = f"map_{name}", f"laser_{name}"
    for kind in ("map", "team_map"):
        if (folder / f"{kind}.yaml").exists():
            bag.grid(f"/{name}/{kind}", frame, 0, read_map(folder / f"{kind}.yaml"))
    stamps_ns, poses = read_tum(folder / TRAJECTORY_FILE)
    is_simulated = (folder / SCANS_FILE).exists()
    if not is_simulated:
        stamps_ns = in_mission_time(stamps_ns, began_s)
    bag.path(f"/{name}/path", frame, stamps_ns, poses)
    for stamp_ns, T_map_laser in zip(stamps_ns.tolist(), poses, strict=True):
        bag.transform(frame, laser, stamp_ns, T_map_laser)
    for sensed in read_recording(folder / SCANS_FILE) if is_simulated else ():
        bag.scan(f"/{name}/scan", laser, sensed.scan)
