"""Where a robot is in maps that were saved before: of each, its pose there, or in words why that is not known yet."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from mrslam.agent.effects import Event
from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.team import Team
from mrslam.comms import SAVED_NAME
from mrslam.merge.graph.edges import pair_of
from mrslam.spatial import InputError, se2
from mrslam.spatial.se2 import Transform

State = Literal["localised", "ambiguous", "not here", "not yet"]
DOUBTS = "the robot doubts where it is in its own map"
"""Why a robot is not localised that knows where its map lies in the saved one, and not where it is in its map."""
NOT_HERE_SEARCHES = 3
"""Searches on end that found next to no wall in common before a robot says that it is elsewhere: one or two are
chance."""
NOT_HERE_M2 = 50.0
"""Least known area of the own map for that, square metres: a room or two. Measured on intel: robots that begin in the
saved map know where they are with 38 to 77 m2."""


def check_saved_id(map_id: str, what: str) -> str:
    """Return a saved map's name, or raise ``InputError`` where it could be a robot's, or would break file names."""
    if not re.fullmatch(SAVED_NAME, map_id):
        raise InputError(
            f"{what} must be two names of letters, digits, '_', '-', '.' joined by '@' (office@monday), got {map_id!r}"
        )
    return map_id


def pose_in(team: Team, map_id: str, T_team_base: Transform) -> Transform | None:
    """Return ``T_map_base (3,)``, a pose of the team frame in a saved map's own frame; None where it is not placed.

    A map that is bent to fit is followed back at its keyframe nearest to the pose.
    """
    T_team_map, bend = team.layout.T_team_map.get(map_id), team.layout.bends.get(map_id)
    if T_team_map is None:
        return None
    if bend is None:
        return se2.between(T_team_map, T_team_base)
    k = int(np.argmin(np.hypot(*(bend.T_team_key[:, :2] - T_team_base[:2]).T)))
    return se2.compose(bend.T_map_key[k], se2.between(bend.T_team_key[k], T_team_base))


@dataclass(frozen=True, eq=False)
class Whereabouts:
    """What is known of a robot's place in one saved map."""

    map_id: str
    state: State
    reason: str
    """Why it is not localised; empty where it is."""
    T_map_base: Transform | None = None
    """``(3,)``: its pose in the saved map's frame, metres and radians."""
    confidence: float | None = None
    """Of the alignment of the two maps, 0..1; None where the robot is placed through others' maps."""

    def fields(self) -> dict[str, Any]:
        """Return it as plain JSON values."""
        pose = None if self.T_map_base is None else [round(float(value), 4) for value in self.T_map_base]
        sure = None if self.confidence is None else round(self.confidence, 4)
        return {"map": self.map_id, "state": self.state, "reason": self.reason, "T_map_base": pose, "confidence": sure}


def whereabouts(team: Team, map_id: str, T_team_base: Transform | None) -> Whereabouts:
    """Return what a robot at ``T_team_base (3,)``, None where it doubts that, knows of its place in a saved map."""
    belief = team.beliefs.get(pair_of(team.robot_id, map_id))
    T_map_base = None if T_team_base is None else pose_in(team, map_id, T_team_base)
    if T_map_base is not None:
        found = None if belief is None else belief.alignment
        return Whereabouts(map_id, "localised", "", T_map_base, None if found is None else float(found.confidence))
    if T_team_base is None and map_id in team.layout.T_team_map:
        return Whereabouts(map_id, "not yet", DOUBTS)
    reason = _no_map_yet(team) if belief is None else belief.reason
    if belief is not None and is_elsewhere(belief):
        seen_m2, times = min(belief.search.area_m2), belief.search.barren
        where = f"of {seen_m2:.0f} m2 seen {times} searches on end found no place in it that fits"
        return Whereabouts(map_id, "not here", f"{where} ({reason})")
    return Whereabouts(map_id, "ambiguous" if reason.startswith("ambiguous") else "not yet", reason)


def _no_map_yet(team: Team) -> str:
    """Return why nothing is believed of the own map."""
    if team.robot_id in team.schedule.starts.begun_anew:
        return f"{team.robot_id} started a new map"
    return "there is no map of the robot's own yet"


def is_elsewhere(belief: PairBelief) -> bool:
    """Return whether enough was seen of a place, and nothing of the saved map fits it.

    The robot may be in a part of the building that was not saved, and come to one that was: it goes on looking.
    """
    search = belief.search
    return (
        belief.alignment is None
        and not belief.reason.startswith("ambiguous")
        and search.barren >= NOT_HERE_SEARCHES
        and min(search.area_m2) >= NOT_HERE_M2
    )


class SavedMaps:
    """Reports when a robot finds its place in a saved map, and when it has lost it again."""

    def __init__(self) -> None:
        self._localised: set[str] = set()
        self._elsewhere: set[str] = set()

    def look(self, team: Team, T_team_base: Transform | None, now_ns: int) -> list[Event]:
        """Return an event for each saved map in which the robot has been localised, or lost, since the last call.

        ``T_team_base`` : None where the robot doubts its pose in its own map.
        """
        events = []
        for map_id in sorted(team.saved):
            is_known = T_team_base is not None and map_id in team.layout.T_team_map
            if is_known == (map_id in self._localised):
                events += self._look_elsewhere(team, map_id, T_team_base, now_ns)
                continue
            at = whereabouts(team, map_id, T_team_base)
            if at.T_map_base is None:
                self._localised.discard(map_id)
                events.append(Event(now_ns, "not_localised", {"map": map_id, "reason": at.reason}))
            else:
                self._localised.add(map_id)
                said = at.fields()
                x, y, theta = said["T_map_base"]
                fields = {"map": map_id, "x_m": x, "y_m": y, "theta_rad": theta, "confidence": said["confidence"]}
                events.append(Event(now_ns, "localised", fields))
        return events

    def _look_elsewhere(self, team: Team, map_id: str, T_team_base: Transform | None, now_ns: int) -> list[Event]:
        """Return the event that the robot is not in a saved map, the first time that it can be told."""
        belief = team.beliefs.get(pair_of(team.robot_id, map_id))
        if belief is None or not is_elsewhere(belief):
            self._elsewhere.discard(map_id)
            return []
        if map_id in self._elsewhere:
            return []
        self._elsewhere.add(map_id)
        reason = whereabouts(team, map_id, T_team_base).reason
        return [Event(now_ns, "not_here", {"map": map_id, "reason": reason})]
