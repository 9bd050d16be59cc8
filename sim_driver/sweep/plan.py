"""What a sweep consists of: every combination of the knobs' values, each with every seed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any

from mrslam.sim_driver.missions.mission import Mission, make_mission
from mrslam.sim_driver.missions.sections import SweepConfig
from mrslam.sim_driver.missions.settings import build, made_with, parse_assignment, read_toml, with_overrides
from mrslam.sim_driver.missions.shipped import find_mission
from mrslam.sim_driver.replay.again import REPLAYABLE
from mrslam.spatial import InputError, read_map

DRIVES = ("auto", "recorded", "anew")
"""Whether the points of a seed replay one recorded drive; "auto": where what is varied allows it."""
MOST_POINTS = 100_000
"""Most runs of a sweep: at a minute each on eight cores they take nine days."""


@dataclass(frozen=True)
class Knob:
    """A setting and the values it takes."""

    key: str
    """``section.key``."""
    values: tuple[str, ...]
    """As written; each must be a valid value of the setting."""


@dataclass(frozen=True)
class Point:
    """One run of a sweep."""

    settings: tuple[str, ...]
    """A value of every knob, in the knobs' order."""
    seed: int
    assignments: tuple[str, ...]
    """``section.key=value`` of every knob."""
    name: str
    """Unique for what is run: the mission, its settings, the seed and the program's version."""


@dataclass(frozen=True)
class Plan:
    """A whole sweep."""

    path: Path
    """Mission file, absolute."""
    tables: dict[str, Any]
    """The mission, without the knobs."""
    knobs: tuple[Knob, ...]
    seeds: tuple[int, ...]
    recorded: bool
    """Whether all points of one seed share one recorded drive, or every point drives anew."""
    points: tuple[Point, ...]
    files: str = ""
    """Digest of the files that the mission reads: with other contents its runs are others."""

    def drive_name(self, seed: int) -> str:
        """Return the name of what the seed's drive is recorded under."""
        return _digest(self.tables, self.files, str(seed), "drive")


def parse_knob(text: str) -> Knob:
    """Return the knob of ``section.key=v1,v2,...``; commas inside brackets or quotes belong to the value."""
    key, equals, raw = text.partition("=")
    values = tuple(value.strip() for value in _split(raw))
    if not equals or not all(values) or len(key.strip().split(".")) != 2:
        raise InputError(f"--vary wants section.key=value,value,... , got {text!r}")
    if len(set(values)) != len(values):
        raise InputError(f"--vary {text}: a value is there twice")
    return Knob(key.strip(), values)


def _split(raw: str) -> list[str]:
    parts, depth, quote = [""], 0, ""
    for c in raw:
        if quote:
            quote = "" if c == quote else quote
        elif c in "\"'":
            quote = c
        else:
            depth += (c in "[{") - (c in "]}")
        if c == "," and depth == 0 and not quote:
            parts.append("")
        else:
            parts[-1] += c
    return parts


def make_plan(
    path: Path,
    knobs: Sequence[Knob] = (),
    seeds: int | None = None,
    drive: str = "auto",
    assignments: Sequence[str] = (),
) -> Plan:
    """Return the plan of a sweep; every combination is checked now, so that no run fails over a value hours later.

    Settings to vary and seeds that are not given are those of the mission's section ``[sweep]``.
    """
    path = find_mission(path)
    given = with_overrides(read_toml(path), ['mission.shell="virtual"'])
    made_with(lambda tables: make_mission(tables, path), given, assignments, str(path))  # says what is wrong, and where
    tables = with_overrides(given, assignments)
    planned = build(SweepConfig, tables.pop("sweep", {}), f"{path}: sweep")
    knobs = tuple(knobs or [parse_knob(text) for text in planned.vary])
    _check_knobs(knobs)
    tables.setdefault("rbpf", {}).setdefault("threads", 1)  # points run side by side
    mission = make_mission(tables, path)
    first, count, files = mission.mission.seed, seeds or planned.seeds, _contents(mission)
    recorded = _is_recorded(drive, knobs, tables)
    combinations = _combinations(path, tables, knobs, count)
    seed_list = tuple(range(first, first + count))
    points = tuple(
        Point(settings, seed, chosen, _digest(tables, files, *chosen, str(seed), "recorded" if recorded else "anew"))
        for settings, chosen in combinations
        for seed in seed_list
    )
    return Plan(path.resolve(), tables, knobs, seed_list, recorded, points, files)


def _check_knobs(knobs: Sequence[Knob]) -> None:
    """Raise where there is nothing to vary, or one setting is varied twice."""
    if not knobs:
        raise InputError("a sweep needs something to vary: --vary section.key=value,value,...")
    keys = [knob.key for knob in knobs]
    if len(set(keys)) != len(keys):
        raise InputError(f"one setting is varied twice among {', '.join(keys)}")
    for key in keys:
        parse_assignment(f"{key}=0")
        if key == "mission.seed":
            raise InputError("mission.seed is not varied: every setting runs with --seeds seeds, from mission.seed on")


def _is_recorded(drive: str, knobs: Sequence[Knob], tables: dict[str, Any]) -> bool:
    """Return whether each seed's drive is recorded once and replayed: what is varied must not change the drive."""
    if drive not in DRIVES:
        raise InputError(f"--drive must be one of {', '.join(DRIVES)}, got {drive!r}")
    needs_drive = sorted({knob.key.split(".")[0] for knob in knobs} - set(REPLAYABLE))
    if tables.get("faults"):
        needs_drive.append("faults")  # what a dead robot did not sense cannot be played again
    if drive == "recorded" and needs_drive:
        raise InputError(f"--drive recorded: {', '.join(needs_drive)} changes where robots drive or what they hear")
    return drive != "anew" and not needs_drive


def _combinations(
    path: Path, tables: dict[str, Any], knobs: Sequence[Knob], seeds: int
) -> list[tuple[tuple[str, ...], tuple[str, ...]]]:
    """Return all combinations of values, each with its ``section.key=value`` assignments; each makes a mission."""
    found = []
    combinations = list(product(*(knob.values for knob in knobs)))
    if len(combinations) * seeds > MOST_POINTS:
        raise InputError(f"{len(combinations)} settings x {seeds} seeds are more than {MOST_POINTS} runs")
    for settings in combinations:
        chosen = tuple(f"{knob.key}={value}" for knob, value in zip(knobs, settings, strict=True))
        made_with(lambda tables: make_mission(tables, path), tables, chosen, str(path), "--vary")
        found.append((settings, chosen))
    return found


def _contents(mission: Mission) -> str:
    """Return a digest of the contents of the files that a mission reads, as far as they are there now."""
    digest = hashlib.sha256()
    for name in (*mission.files, *(() if mission.world is None else (mission.world.name,))):
        with suppress(InputError, OSError):  # a built-in world is no file; what is missing the runs will say
            path = mission.find(name)
            for file in [path] if path.is_file() else sorted(one for one in path.rglob("*") if one.is_file()):
                digest.update(file.read_bytes())
            if path.suffix.lower() in (".yaml", ".yml"):
                digest.update(read_map(path).cells.tobytes())  # of a picture beside it
    return digest.hexdigest()


def _digest(tables: dict[str, Any], *parts: str) -> str:
    text = json.dumps([version("mrslam"), tables, *parts], sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:16]
