"""A run's folder, read: what was to happen, what each robot left, and what came out of it.

The one place where these files are read. One that is empty, cut off or of other types raises an ``InputError``.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NotRequired, TypedDict

import msgspec

from mrslam.sim_driver.missions.run_files import CONFIG_FILE, EVENTS_FILE, METRICS_FILE, ROBOT_FILE
from mrslam.sim_driver.missions.sections import RobotConfig
from mrslam.spatial import InputError
from mrslam.spatial.errors import first_line
from mrslam.spatial.files.atomic import is_file

Event = dict[str, Any]
"""One line of ``events.jsonl``: ``t`` (mission seconds), ``robot``, ``event`` (its kind), and the kind's own fields."""
log = logging.getLogger(__name__)


class _Config(TypedDict):
    robots: list[dict[str, Any]]
    mission: NotRequired[dict[str, Any]]
    settings: NotRequired[dict[str, Any]]


class _Metrics(TypedDict):
    name: str
    mission_s: float
    robots_lost: list[str]


class _Pair(TypedDict):
    a: str
    b: str
    status: str
    T_a_b: tuple[float, float, float] | None
    accepted_at_s: float | None
    reason: str


class _Link(TypedDict):
    peer: str
    exchanges: int
    bytes_sent: int
    bytes_full_lz4: int
    bytes_full_raw: int


class _Robot(TypedDict):
    id: str
    mode: str
    known_area_m2: float
    placed: dict[str, tuple[float, float, float]]
    pairs: list[_Pair]
    links: list[_Link]


class _Event(TypedDict):
    t: float
    event: str


def read_config(run: Path) -> dict[str, Any]:
    """Return a run's ``config.json``; raise ``InputError`` where the folder is no run's."""
    path = run / CONFIG_FILE
    if is_file(path):
        return _read(path, _Config)
    if not run.exists():
        raise InputError(f"{run}: no such folder; name the one that a run left (its --out)")
    raise InputError(f"{run}: not a run's folder ({CONFIG_FILE} is missing)")


def robots_of(run: Path) -> list[str] | None:
    """Return the robots that the run's ``config.json`` names, in its order; None where the folder is no run's."""
    if not is_file(run / CONFIG_FILE):
        return None
    try:
        return [RobotConfig(id=robot["id"]).id for robot in read_config(run)["robots"]]
    except (InputError, TypeError, KeyError):
        return None


def read_metrics(run: Path) -> dict[str, Any]:
    """Return a run's ``metrics.json``; raise ``InputError`` where the run did not finish."""
    if not is_file(run / METRICS_FILE):
        raise InputError(f"{run}: the run did not finish (no {METRICS_FILE})")
    return _read(run / METRICS_FILE, _Metrics)


def read_robot(folder: Path) -> dict[str, Any] | None:
    """Return the ``robot.json`` in a robot's folder, None where there is none; raise ``InputError`` if damaged."""
    return _read(folder / ROBOT_FILE, _Robot) if is_file(folder / ROBOT_FILE) else None


def read_robots(run: Path, robot_ids: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Return the ``robot.json`` of every robot that ended, by id, in order of ids; a damaged one counts as missing."""
    robots: dict[str, dict[str, Any]] = {}
    for robot_id in sorted(robot_ids):
        try:
            robot = read_robot(run / robot_id)
        except InputError as error:
            log.warning("%s; %s counts as lost", error, robot_id)
            continue
        if robot is not None:
            robots[robot_id] = robot
    return robots


def read_events(folder: Path) -> list[Event]:
    """Return the events in a robot's folder in the order they were written; none where there is no file.

    Lines that a crash or a full disk cut off are left out.
    """
    path = folder / EVENTS_FILE
    if not is_file(path):
        return []
    events: list[Event] = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        try:
            event = json.loads(line)
            msgspec.convert(event, _Event)
        except ValueError:  # json's and msgspec's errors are both
            continue
        events.append(event)
    return events


def _read(path: Path, shape: Any) -> dict[str, Any]:
    """Return the JSON table in a file; raise ``InputError`` where it is none, or lacks what ``shape`` names."""
    try:
        table: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        msgspec.convert(table, shape)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from error
    except ValueError as error:
        raise InputError(f"{path}: empty, cut off or damaged ({first_line(error)})") from error
    return table
