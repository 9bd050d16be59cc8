"""The folders of agents that ran on their own, put together as the folder of a run: to be judged, and read as a page.

Agents tell times by the world's clock; a run's time begins at 0, with the first of all their events. Stamps of
trajectories stay as the drivers or the log gave them, so that references and relations still fit.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from mrslam.sim_driver.missions.agent_record import AgentRecord
from mrslam.sim_driver.missions.locate import locate
from mrslam.sim_driver.missions.mission import Mission, make_mission, make_settings
from mrslam.sim_driver.missions.run_files import AGENT_FILE, EVENTS_FILE, OF_AGENT, ROBOT_FILE, TEAM_FOLDER
from mrslam.sim_driver.missions.run_folder import Event, read_events, read_robot
from mrslam.sim_driver.missions.sections import OWN_SECTIONS
from mrslam.sim_driver.run.metrics import write_metrics
from mrslam.sim_driver.run.run import prepare_folder
from mrslam.sim_driver.run.team_ways import fill_team_ways
from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import is_file, make_folder, write_text

TICK = ("agent", "tick_s")
"""The setting of these sections that a mission has only once."""


def gather(folders: Sequence[Path], out: Path, say: Callable[[str], None]) -> tuple[Mission, dict[str, Any]]:
    """Put agents' folders together as a run's in ``out`` and return its mission and metrics.

    Each of ``folders`` is an agent's, or holds those of several. What is there is only read. Raises ``InputError``
    where one is no agent's, two are of one robot or of different teams, or ``out`` is among them.
    """
    agents = _agents(folders)
    sources = {record.id: folder for folder, record in agents.items()}
    records = sorted(agents.values(), key=lambda record: record.id)
    for robot_id, source in sources.items():
        if source.resolve() in ((out / robot_id).resolve(), out.resolve()):
            raise InputError(f"{source}: the agent's own folder; name another one with --out")
    mission = _mission(records, out, say)
    prepare_folder(mission, out, say)
    events = {record.id: _events(record, sources[record.id], say) for record in records}
    times = [event["t"] for told in events.values() for event in told]
    begin_s, end_s = min(times, default=0.0), max(times, default=0.0)
    for record in records:
        _take(record, sources[record.id], out / record.id, events[record.id], begin_s, say)
    fill_team_ways(out, [record.id for record in records], say)
    began = {robot_id: round(_first_scan_s(told, begin_s) - begin_s, 3) for robot_id, told in events.items()}
    span_s = round(end_s - begin_s, 3)
    return mission, write_metrics(mission, out, wall_s=span_s, mission_s=span_s, shell="agents", began_s=began)


def _agents(folders: Sequence[Path]) -> dict[Path, AgentRecord]:
    """Return the agents' folders with what they say of themselves; one folder may hold many."""
    found: dict[Path, AgentRecord] = {}
    for folder in folders:
        if not folder.is_dir():
            raise InputError(f"{folder}: no such folder; name those that agents left (their --out)")
        inner = (
            [folder] if is_file(folder / AGENT_FILE) else sorted(path.parent for path in folder.glob(f"*/{AGENT_FILE}"))
        )
        if not inner:
            raise InputError(f"{folder}: neither an agent's folder nor one with agents' folders in it ({AGENT_FILE})")
        found |= {path: AgentRecord.read(path) for path in inner}
    for path, record in found.items():
        make_settings(record.settings, str(path / AGENT_FILE))
    seen: dict[str, Path] = {}
    for path, record in found.items():
        if record.id in seen:
            raise InputError(f"{path} and {seen[record.id]} are both of {record.id}")
        seen[record.id] = path
    teams = sorted({record.team for record in found.values()})
    if len(teams) > 1:
        raise InputError(f"these agents are of several teams ({', '.join(teams)}); gather those of one")
    return found


def _mission(records: Sequence[AgentRecord], out: Path, say: Callable[[str], None]) -> Mission:
    """Return what they did as a mission: the first robot's settings, and for each other robot its own over them.

    Where others differ in what a mission has only once, that is said.
    """
    first = records[0]
    robots = []
    for record in records:
        own, hidden = _own_settings(record, first)
        if hidden:
            say(f"{record.id} ran with other settings than {first.id} ({', '.join(hidden)}); {first.id}'s are shown")
        robots.append({"id": record.id, "mode": record.mode, "log": _log(record, say), **own})
    tables = {**first.settings, "mission": {"name": first.team, "shell": "agents"}, "robots": robots}
    return make_mission(tables, out / "agents")


def _own_settings(record: AgentRecord, first: AgentRecord) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """Return the settings in which a robot differs from the first, by section, and those no robot has for itself."""
    own: dict[str, dict[str, Any]] = {}
    hidden = []
    for section, table in record.settings.items():
        for key, value in table.items():
            if value == first.settings.get(section, {}).get(key):
                continue
            if section in OWN_SECTIONS and (section, key) != TICK:
                own.setdefault(section, {})[key] = value
            else:
                hidden.append(f"{section}.{key}")
    return own, hidden


def _log(record: AgentRecord, say: Callable[[str], None]) -> str | None:
    """Return the agent's log where it can be read here."""
    if record.log is None:
        return None
    try:
        return str(locate(record.log))
    except InputError as error:
        say(f"{record.id}: its log is not here, and its scans are not shown ({error})")
        return None


def _events(record: AgentRecord, source: Path, say: Callable[[str], None]) -> list[Event]:
    """Return what happened since the agent began its map."""
    read = read_events(source)
    if read.damage:
        say(read.damage)
    return [event for event in read.events if event["t"] >= record.begun_s]


def _take(
    record: AgentRecord, source: Path, target: Path, events: Sequence[Event], begin_s: float, say: Callable[[str], None]
) -> None:
    """Copy what the agent left, with times from the run's begin on."""
    make_folder(target)
    for name in OF_AGENT:
        if is_file(source / name):
            shutil.copyfile(source / name, target / name)
    if (source / TEAM_FOLDER).is_dir():
        shutil.copytree(source / TEAM_FOLDER, target / TEAM_FOLDER, dirs_exist_ok=True)
    told = [json.dumps({**event, "t": round(event["t"] - begin_s, 3)}) + "\n" for event in events]
    write_text(target / EVENTS_FILE, "".join(told))
    try:
        robot = read_robot(source)
    except InputError as error:
        say(f"{error}; of {record.id} there are only its events")
        return
    if robot is None:
        say(f"{record.id} has not ended: there are only its events")
        return
    if not record.ended:
        say(f"{record.id} has not ended since it was started last: its maps are of the time before")
    for pair in robot["pairs"]:
        if pair["accepted_at_s"] is not None:
            pair["accepted_at_s"] = max(0.0, round(pair["accepted_at_s"] - begin_s, 3))
    write_text(target / ROBOT_FILE, json.dumps(robot, indent=1) + "\n")


def _first_scan_s(events: Sequence[Event], default_s: float) -> float:
    """Return when the robot mapped its first scan, by the world's clock."""
    return float(next((event["t"] for event in events if event["event"] == "mapped"), default_s))
