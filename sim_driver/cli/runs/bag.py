"""``mrslam bag``: a run as a ROS2 recording, for the viewers of that world."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from mrslam.sim_driver.cli.console import say
from mrslam.sim_driver.cli.progress import progress_bar
from mrslam.sim_driver.evaluate.lost import anew_s
from mrslam.sim_driver.evaluate.trajectories import in_mission_time
from mrslam.sim_driver.feeds.bag_writer import BagWriter
from mrslam.sim_driver.missions.run_files import (
    BAG_FILE,
    MAP_FILE,
    METRICS_FILE,
    ROBOT_FILE,
    SCANS_FILE,
    TEAM_MAP_FILE,
    TRAJECTORY_FILE,
)
from mrslam.sim_driver.missions.run_folder import read_events, read_metrics, read_robot, robots_of
from mrslam.sim_driver.missions.run_shapes import BeganFile
from mrslam.sim_driver.replay import read_recording
from mrslam.spatial import InputError, read_map
from mrslam.spatial.files.tum import read_tum

TEAM = "team"
"""Frame of the team map."""
T = TypeVar("T")


def bag_run(run: Path, out: Path | None) -> None:
    """Write maps, trajectories and scans of a run, or of one mapped log, as one .mcap file.

    Damaged files are named and left out; raises ``InputError`` where no map or trajectory is left.
    """
    out = run / BAG_FILE if out is None else out
    folders = _folders(run)
    if not folders:
        raise InputError(f"{run}: holds no map: name the folder of a finished run, or of a mapped log")
    metrics = _usable(run / METRICS_FILE, lambda path: read_metrics(path.parent, BeganFile)) or {}
    began_s = metrics.get("began_s", {})
    placed = {name: _placed(folder) for name, folder in folders.items()}
    with BagWriter(out) as bag, progress_bar(f"writing {out.name}", len(folders)) as advance:
        for name, T_team_map in max(placed.values(), key=len).items():
            bag.transform(TEAM, f"map_{name}", 0, np.array(T_team_map), "/tf_static")
        written = 0
        for name, folder in folders.items():
            begun_s = anew_s(read_events(folder).events) if metrics else None  # agents' own events tell world time
            written += _write_robot(bag, name, folder, began_s.get(name, 0.0) if begun_s is None else begun_s)
            advance()
        if not written:
            raise InputError(f"{run}: no map or trajectory there can be used")
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


def _usable(path: Path, reader: Callable[[Path], T]) -> T | None:
    """Return what the reader makes of a file; None where there is none, or it is damaged, which is said."""
    if not path.exists():
        return None
    try:
        return reader(path)
    except (InputError, OSError) as error:
        say(str(error))
        return None


def _placed(folder: Path) -> dict[str, Any]:
    """Return where the maps of a robot's team map lie; nothing where that is not known."""
    robot = _usable(folder / ROBOT_FILE, lambda path: read_robot(path.parent))
    return {} if robot is None else robot["placed"]


def _team_frame(folder: Path) -> str | None:
    """Return the saved map in whose frame a robot's team map is; None where it is in that of its own map."""
    robot = _usable(folder / ROBOT_FILE, lambda path: read_robot(path.parent))
    chosen = None if robot is None else robot.get("chosen_frame")
    return chosen["map"] if chosen is not None and chosen["T_frame_map"] is not None else None


def _write_robot(bag: BagWriter, name: str, folder: Path, began_s: float) -> int:
    """Write what one robot left and return the number of its maps and trajectories.

    Times are the mission's, in which a recorded robot began its map at ``began_s``.
    """
    frame, written = f"map_{name}", 0
    for file, of in ((MAP_FILE, frame), (TEAM_MAP_FILE, f"map_{_team_frame(folder) or name}")):
        grid = _usable(folder / file, read_map)
        if grid is not None:
            bag.grid(f"/{name}/{Path(file).stem}", of, 0, grid)
            written += 1
    trajectory = _usable(folder / TRAJECTORY_FILE, read_tum)
    if trajectory is None:
        return written
    stamps_ns, poses = trajectory
    is_simulated = (folder / SCANS_FILE).exists()
    if not is_simulated:
        stamps_ns = in_mission_time(stamps_ns, began_s)
    bag.path(f"/{name}/path", frame, stamps_ns, poses)
    for stamp_ns, T_map_laser in zip(stamps_ns.tolist(), poses, strict=True):
        bag.transform(frame, f"laser_{name}", stamp_ns, T_map_laser)
    for sensed in _usable(folder / SCANS_FILE, read_recording) or ():
        bag.scan(f"/{name}/scan", f"laser_{name}", sensed.scan)
    return written + 1
