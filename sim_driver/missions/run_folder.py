"""A run's folder, read: what was to happen, what each robot left, and what came out of it.

The one place where these files are read; their shapes are checked. One that is empty, cut off or of other types raises
an ``InputError`` of one line.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from mrslam.sim_driver.missions.run_files import CONFIG_FILE, EVENTS_FILE, METRICS_FILE, ROBOT_FILE
from mrslam.sim_driver.missions.run_shapes import EVENTS, AnyEvent, ConfigFile, MetricsFile, RobotFile
from mrslam.sim_driver.missions.sections import RobotConfig
from mrslam.spatial import InputError
from mrslam.spatial.errors import first_line
from mrslam.spatial.files.atomic import is_file

Event = dict[str, Any]
"""One line of ``events.jsonl``: ``t`` (mission seconds), ``robot``, ``event`` (its kind), and the kind's own fields."""
LARGEST_BYTES = 256 * 2**20
"""Longest JSON file that is read, bytes: a mission of 100 robots leaves a few megabytes."""
LONGEST_LINE = 2**20
"""Longest event that is read, bytes: an alignment with its evidence is about a thousand."""
CUT_OFF = "Input data was truncated"
"""What msgspec says of the beginning of a JSON text: every crash in mid-line leaves one, and nothing else is lost."""


def read_config(run: Path) -> dict[str, Any]:
    """Return a run's ``config.json``; raise ``InputError`` where the folder is no run's."""
    path = run / CONFIG_FILE
    if path.exists():
        return read_table(path, ConfigFile)
    if not run.exists():
        raise InputError(f"{run}: no such folder; name the one that a run left (its --out)")
    raise InputError(f"{run}: not a run's folder ({CONFIG_FILE} is missing)")


def robots_of(run: Path) -> list[str] | None:
    """Return the robots that the run's ``config.json`` names, in its order; None where the folder is no run's."""
    if not is_file(run / CONFIG_FILE):
        return None
    try:
        return [RobotConfig(id=robot["id"]).id for robot in read_config(run)["robots"]]
    except (InputError, TypeError, KeyError, AttributeError):
        return None


def read_metrics(run: Path, shape: type[Any] = MetricsFile) -> dict[str, Any]:
    """Return a run's ``metrics.json``; raise ``InputError`` where the run did not finish."""
    if not (run / METRICS_FILE).exists():
        raise InputError(f"{run}: the run did not finish (no {METRICS_FILE})")
    return read_table(run / METRICS_FILE, shape)


def read_robot(folder: Path) -> dict[str, Any] | None:
    """Return the ``robot.json`` in a robot's folder, None where there is none; raise ``InputError`` if damaged."""
    path = folder / ROBOT_FILE
    if not path.exists():
        return None
    robot = read_table(path, RobotFile)
    for pair in robot["pairs"]:
        if pair["status"] == "accepted" and None in (pair["T_a_b"], pair["accepted_at_s"], pair["confidence"]):
            raise InputError(f"{path}: {pair['a']} and {pair['b']} are merged without a transform, time or confidence")
    return robot


@dataclass(frozen=True)
class EventFile:
    """The events of a robot's folder, in the order they were written."""

    events: list[Event] = field(default_factory=list)
    damage: str = ""
    """What was left out and why, in one line; empty for lines that a crash cut off, which are expected."""


def read_events(folder: Path) -> EventFile:
    """Return the events in a robot's folder; none where there is no file. Lines that cannot be used are left out."""
    path = folder / EVENTS_FILE
    if not path.exists():
        return EventFile()
    events: list[Event] = []
    reasons: list[str] = []
    try:
        with path.open("rb") as lines:
            for number, line in enumerate(iter(lambda: lines.readline(LONGEST_LINE), b""), start=1):
                try:
                    events += [_event(line)] if line.strip() else []
                except (ValueError, RecursionError) as error:
                    reasons += [] if str(error) == CUT_OFF else [f"line {number}: {first_line(error)}"]
    except OSError as error:
        return EventFile(events, f"{path}: cannot be read ({error.strerror or error})")
    return EventFile(events, f"{path}: {len(reasons)} lines cannot be used ({reasons[0]})" if reasons else "")


def _event(line: bytes) -> Event:
    event: Event = msgspec.json.decode(line)
    msgspec.convert(event, AnyEvent)
    msgspec.convert(event, EVENTS.get(event["event"], AnyEvent))
    return event


def read_table(path: Path, shape: type[Any]) -> dict[str, Any]:
    """Return the JSON table in a file; raise ``InputError`` where it is none, or lacks what ``shape`` names."""
    if not is_file(path):
        raise InputError(f"{path}: is no file")
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise InputError(f"{path}: longer than {LARGEST_BYTES // 2**20} MB")
        table: dict[str, Any] = msgspec.json.decode(path.read_bytes())
        msgspec.convert(table, shape)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from error
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"{path}: empty, cut off or damaged ({first_line(error)})") from error
    return table
