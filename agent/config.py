"""Settings of one robot: those of every package it wires, and some of its own."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from mrslam.alignment import ALIGNERS, AlignmentConfig
from mrslam.comms import CommsConfig, is_saved
from mrslam.merge import MergeConfig
from mrslam.mutual_detection import MutualDetectionConfig
from mrslam.rbpf import MapperConfig
from mrslam.spatial.errors import require, require_bounds

LONGEST_S = 1e9
"""Longest interval, seconds: 30 years, which means never."""
UNSAVED_MOST_S = 2000.0
"""Age of a state up to which a resumed map keeps its epoch, seconds: longer than a full disk or a reboot lasts as a
rule. States are saved at least as often."""
REVISIONS_LOST = 100_000
"""Revisions a resumed map skips: more than it can have had since it was saved, so that none names two contents. A look
at the map counts one, where a scan has changed it; lasers that robots carry scan at 5 to 40 Hz, and 50 Hz take 2000 s.
"""
BOUNDS = {
    "publish_interval_s": (0.01, LONGEST_S), "settled_s": (0.01, LONGEST_S),
    "align_interval_s": (0.01, LONGEST_S), "align_growth": (0.001, 1e6),
    "realign_growth": (0.001, 1e6), "realign_interval_s": (0.01, LONGEST_S),
    "checkpoint_interval_s": (0.01, UNSAVED_MOST_S), "min_health": (0.0, 1.0), "give_up_s": (0.1, LONGEST_S),
    "tick_s": (0.001, 10.0), "start_sigma_m": (0.001, 1e3), "start_sigma_rad": (0.001, math.pi),
}  # fmt: skip
"""Least and largest value of every number."""
FARTHEST_M = 1e6
"""Largest coordinate of a start, metres."""


def check_start(name: str, start: Sequence[float]) -> None:
    """Raise ``InputError`` where a start is no place with or without a heading."""
    ok = len(start) in (2, 3) and all(abs(value) <= FARTHEST_M for value in start)
    require(ok, name, f"[x_m, y_m, theta_rad] or [x_m, y_m], none beyond {FARTHEST_M:g}", list(start))


@dataclass(frozen=True, kw_only=True)
class AgentConfig:
    """What is decided between the packages."""

    publish_interval_s: float = 2.0
    """How often the own map is made ready for teammates, seconds, > 0; of more than 250 keyframes less often, in
    proportion. Shorter: fresher maps, more CPU."""
    settled_s: float = 180.0
    """Once a robot has placed all maps for this time, seconds, > 0, and all others its own, it tells only what theirs
    do not show; until then, and with 1e9 always, all of it. Shorter: fewer bytes, less to find a wrong merge by."""
    align_method: str = "auto"
    """How maps are aligned: "auto", or one method by its name ("orb", "surf", "hough", "random-walk", ...)."""
    align_interval_s: float = 10.0
    """Earliest next alignment of a pair that was tried already, seconds, > 0; a robot's place in a saved map is looked
    for without waiting once its map has grown."""
    align_growth: float = 0.10
    """Expert: a pair not merged is tried again when the known area of either map has grown by this share, > 0; where
    more than five maps are not found in the own one, by as many times more, or after 90 s."""
    realign_growth: float = 0.25
    """Expert: a merged pair is aligned again, to follow its maps, when the area of either grew by this share, > 0;
    where scans tie the two, when it has doubled."""
    realign_interval_s: float = 30.0
    """Expert: ... and after this time where either was corrected, unless scans tie the two; seconds, > 0."""
    checkpoint_interval_s: float = 5.0
    """How old a robot's state on disk may get where it is kept (process shell), seconds, > 0, at most 2000."""
    min_health: float = 0.4
    """Expert: below this health of its mapper a robot does not publish its map until it has recovered, 0..1."""
    give_up_s: float = 30.0
    """A robot that was carried, or resumed elsewhere, and has not found its place for this time starts a new map;
    one whose scans merely contradict its map, after ten times as long; seconds, > 0."""
    frame: str = ""
    """Frame in which the robot tells its pose and its team map: that of the saved map of this name ("office@monday"),
    once it is localised there; empty: its own map's."""
    localise: bool = False
    """Whether a robot that knows its place in a saved map tracks its pose there and maps no more, until it is lost: the
    saved map of ``frame``, or else the first one it was given, whose frame is then the one it tells its pose in."""
    tick_s: float = 0.1
    """Expert: time between two rounds of beacons, rendezvous and exchanges, seconds, > 0."""

    starts: Mapping[str, list[float]] = field(default_factory=dict)
    """Where robots' maps begin in any one frame, [x_m, y_m, theta_rad] by id, or [x_m, y_m] where the heading is not
    known, where that is known beforehand: maps of two of them are looked for there, unless neither heading is known.
    What is found must fit as well as without."""
    start_sigma_m: float = 0.5
    """Standard deviation of the starts' places, metres, > 0."""
    start_sigma_rad: float = 0.1
    """Standard deviation of the starts' headings, radians, > 0."""

    def __post_init__(self) -> None:
        for robot_id, start in self.starts.items():
            check_start(f"agent.starts.{robot_id}", start)
        is_frame = not self.frame or is_saved(self.frame)
        require(is_frame, "agent.frame", "the name of a saved map (office@monday), or empty", self.frame)
        require(self.align_method in ALIGNERS, "agent.align_method", f"one of {', '.join(ALIGNERS)}", self.align_method)
        require_bounds("agent", self, BOUNDS)


@dataclass(frozen=True, kw_only=True)
class Settings:
    """All settings of one robot, one section a package."""

    rbpf: MapperConfig = field(default_factory=MapperConfig)
    alignment: AlignmentConfig = field(default_factory=AlignmentConfig)
    mutual_detection: MutualDetectionConfig = field(default_factory=MutualDetectionConfig)
    merge: MergeConfig = field(default_factory=MergeConfig)
    comms: CommsConfig = field(default_factory=CommsConfig)
    agent: AgentConfig = field(default_factory=AgentConfig)
