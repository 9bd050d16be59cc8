"""What one robot leaves in its folder: maps, team map, trajectory, events, and a summary for the mission's metrics."""

from __future__ import annotations

import json
import logging
import os
import shutil
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from mrslam.agent.chosen_frame import in_frame
from mrslam.agent.core import Agent
from mrslam.agent.effects import Event
from mrslam.agent.saved_maps import Whereabouts
from mrslam.agent.shells.files import (
    EVENTS_FILE,
    KEYFRAMES_FILE,
    MAP_FILE,
    ROBOT_FILE,
    TEAM_FOLDER,
    TEAM_IMAGE_FILE,
    TEAM_MAP_FILE,
    TEAM_OVERLAY_FILE,
    TRACKED_FILE,
    TRAJECTORY_FILE,
    team_file,
)
from mrslam.merge.draw import draw_team, overlaid
from mrslam.merge.graph.edges import pair_of
from mrslam.spatial import write_map
from mrslam.spatial.files.atomic import write_text
from mrslam.spatial.files.full_disk import unwritten_is_logged
from mrslam.spatial.files.images import write_image
from mrslam.spatial.files.keyframes import write_keyframes
from mrslam.spatial.files.tum import write_tum
from mrslam.spatial.se2 import Transform

log = logging.getLogger(__name__)


class EventLog:
    """Writes events as JSON lines, each at once: what is written survives a crash.

    While the disk is full events are lost, and counted; the robot continues.
    """

    def __init__(self, folder: Path, robot_id: str) -> None:
        """Open ``events.jsonl`` in the folder for appending: a robot that starts again continues its file."""
        folder.mkdir(parents=True, exist_ok=True)
        self._file = (folder / EVENTS_FILE).open("a+b", buffering=0)
        self._robot_id = robot_id
        self.lost = 0
        """Events that could not be written, or not whole."""
        self._torn = self._ends_within_a_line()

    def write(self, event: Event) -> None:
        """Append one event: ``t`` (mission seconds), ``robot``, ``event`` and its own fields."""
        line = {"t": round(event.t_ns / 1e9, 3), "robot": self._robot_id, "event": event.kind, **event.fields}
        raw = (b"\n" if self._torn else b"") + json.dumps(line, allow_nan=False).encode() + b"\n"
        try:
            written = self._file.write(raw) or 0
        except OSError as error:
            self._lose(error.strerror)
            return
        self._torn = written < len(raw)
        if written < len(raw) - 1:  # all but the end of the line is the whole event
            self._lose("one was cut off")

    def close(self) -> None:
        """Close the file; log how many events are not in it."""
        self._file.close()
        if self.lost:
            log.warning("%s: %d events are not in %s", self._robot_id, self.lost, EVENTS_FILE)

    def _lose(self, reason: str | None) -> None:
        if self.lost == 0:
            log.warning("%s: events cannot be written (%s)", self._robot_id, reason)
        self.lost += 1

    def _ends_within_a_line(self) -> bool:
        """Return whether what is there was cut off, by a crash or a full disk."""
        if self._file.seek(0, os.SEEK_END) == 0:
            return False
        self._file.seek(-1, os.SEEK_END)
        return self._file.read(1) != b"\n"


def write_robot(
    agent: Agent, folder: Path, sent_bytes: Mapping[str, int], unwritten: Mapping[str, int] | None = None
) -> None:
    """Write a robot's final results into its folder; a file that cannot be written is logged and skipped.

    ``unwritten`` : what could not be written while it ran -> how often, for its summary.
    """
    folder.mkdir(parents=True, exist_ok=True)
    team, trajectory = agent.team_map(), agent.trajectory_laser()
    layers = {robot_id: known.local.map for robot_id, known in sorted(agent.team.maps.items())}
    text = json.dumps(summary(agent, sent_bytes, unwritten), indent=1, allow_nan=False) + "\n"
    own = agent.local_map()
    writers: dict[str, Callable[[], None]] = {
        ROBOT_FILE: lambda: write_text(folder / ROBOT_FILE, text),
        MAP_FILE: lambda: write_map(folder / MAP_FILE, agent.own_map()),
        TEAM_MAP_FILE: lambda: write_map(folder / TEAM_MAP_FILE, in_frame(team.grid, agent.T_frame_team)),
        TRAJECTORY_FILE: lambda: write_tum(folder / TRAJECTORY_FILE, trajectory.stamps_ns, trajectory.T_map_base),
        KEYFRAMES_FILE: lambda: write_keyframes(folder / KEYFRAMES_FILE, own.keyframes, own.key_scans),
        TEAM_FOLDER: lambda: write_corrected(agent, folder),
        TEAM_IMAGE_FILE: lambda: write_image(folder / TEAM_IMAGE_FILE, draw_team(team, layers)),
    }
    tracked = agent.tracked_laser()
    if len(tracked.stamps_ns):
        writers[TRACKED_FILE] = lambda: write_tum(folder / TRACKED_FILE, tracked.stamps_ns, tracked.T_map_base)
    if team.bends:
        overlay, ties_m = overlaid(team, layers), agent.team.layout.ties_m(team.T_rigid)
        writers[TEAM_OVERLAY_FILE] = lambda: write_image(
            folder / TEAM_OVERLAY_FILE, draw_team(overlay, layers, ties_m=ties_m)
        )
    absent = sorted({TRACKED_FILE, TEAM_OVERLAY_FILE} - writers.keys())
    for name in absent:  # those of an earlier life would be taken for this one's
        writers[name] = partial((folder / name).unlink, missing_ok=True)
    for name, write in writers.items():
        with unwritten_is_logged(agent.robot_id, folder / name):
            write()


def write_corrected(agent: Agent, folder: Path) -> None:
    """Write the corrected trajectories of the robots whose maps are bent: the own laser's, and others' keyframes."""
    shutil.rmtree(folder / TEAM_FOLDER, ignore_errors=True)
    ways = agent.corrected_trajectories()
    if ways:
        (folder / TEAM_FOLDER).mkdir(parents=True)
    for robot_id, way in ways.items():
        write_tum(folder / team_file(robot_id), way.stamps_ns, way.T_map_base)


def summary(agent: Agent, sent_bytes: Mapping[str, int], unwritten: Mapping[str, int] | None = None) -> dict[str, Any]:
    """Return what the mission's metrics need of one robot, as plain JSON values."""
    team, saved = agent.team_map(), agent.team.saved
    return {
        "id": agent.robot_id,
        "mode": agent.mode,
        "frame": team.anchor,
        "known_area_m2": round(agent.own_map().known_area_m2(), 2),
        "team_area_m2": round(team.grid.known_area_m2(), 2),
        "scans": agent.scans,
        "scans_processed": agent.mapper.stats.processed,
        "masked_beams": agent.masked_beams,
        "loops_closed": agent.mapper.stats.loops_closed,
        "placed": {robot: _plain(T) for robot, T in sorted(team.T_team_map.items()) if robot not in saved},
        "T_team_base": _plain(agent.T_team_base),
        "chosen_frame": _frame_row(agent),
        "ties": [
            [tie.a, tie.b, tie.match.i, tie.match.j, tie.believed]
            for tie in agent.team.layout.ties
            if not saved & {tie.a, tie.b}
        ],
        "unplaced": {
            robot: why for robot, why in sorted({**team.unplaced, **agent.team.doubted}.items()) if robot not in saved
        },
        "pairs": [belief.row(a, b) for (a, b), belief in sorted(agent.team.beliefs.items()) if not saved & {a, b}],
        "saved_maps": [_saved_row(agent, at) for at in agent.whereabouts()],
        "sent_bytes": dict(sent_bytes),
        "unwritten": dict(unwritten or {}),
        "links": [{"peer": peer, **stats.row()} for peer, stats in sorted(agent.links.items())],
    }


def _saved_row(agent: Agent, at: Whereabouts) -> dict[str, Any]:
    """Return what is known of the robot's place in a saved map, and the alignment with it as a pair's row."""
    a, b = pair_of(agent.robot_id, at.map_id)
    belief = agent.team.beliefs.get((a, b))
    return {**at.fields(), "pair": None if belief is None else belief.row(a, b)}


def _frame_row(agent: Agent) -> dict[str, Any] | None:
    """Return where the own map and the robot are in the frame of choice; None where that is the own map's."""
    frame, T_frame_base = agent.frame, agent.T_frame_base
    if not frame.saved_map:
        return None
    if frame.T_frame_map is None or T_frame_base is None:
        return {"map": frame.saved_map, "T_frame_map": None, "T_frame_base": None}
    return {"map": frame.saved_map, "T_frame_map": _plain(frame.T_frame_map), "T_frame_base": _plain(T_frame_base)}


def _plain(T: Transform) -> list[float]:
    return [float(value) for value in T]
