"""The sections of a mission file, their keys and defaults; ``mrslam config`` prints what stands below each.

What the packages and the simulator's parts want to know they define themselves.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from mrslam.agent import check_saved_id
from mrslam.agent.config import check_start
from mrslam.comms.wire.frames import check_name
from mrslam.sim_driver.missions.run_files import OF_RUN
from mrslam.spatial.errors import SEEDS, require, require_bounds
from mrslam.spatial.grid import RESOLUTIONS_M

LONGEST_S = 1e7
"""Longest mission, seconds: 116 days."""
FARTHEST_M = 1e6
"""Largest coordinate in a world, metres."""
MISSION_BOUNDS = {
    "seed": SEEDS, "duration_s": (0.1, LONGEST_S), "linger_s": (0.0, LONGEST_S), "speed": (0.01, 1e3),
}  # fmt: skip
"""Least and largest value of the numbers in ``[mission]``."""

OWN_SECTIONS = ("rbpf", "alignment", "mutual_detection", "merge", "agent")
"""Sections of settings of which a robot may have its own; those of the network, ``[comms]``, are the team's."""


@dataclass(frozen=True, kw_only=True)
class MissionConfig:
    """The mission as a whole."""

    name: str = ""
    """What reports call it; the file's name unless given."""
    seed: int = 0
    """Everything random follows from it, >= 0."""
    duration_s: float | None = None
    """Mission time after which all stop, seconds; without it, when all robots have finished."""
    linger_s: float = 60.0
    """Mission time that robots stay after the last has finished, so that they can still meet, seconds, >= 0."""
    speed: float = 1.0
    """Mission seconds in a second of wall time, for real processes, > 0."""
    shell: str = "process"
    """"process": one operating-system process a robot, over Zenoh; "virtual": in one, or a few, in virtual time."""
    record: bool = True
    """Whether what simulated robots sense is kept (about 15 kB a second and robot), for replays and the report."""
    restart: bool = False
    """Whether a robot whose process dies is started again, from its checkpoint; real processes only."""

    def __post_init__(self) -> None:
        require_bounds("mission", self, MISSION_BOUNDS)
        known = ("process", "virtual", "agents")  # the last: agents ran on their own, and were gathered
        require(self.shell in known, "mission.shell", "'process' or 'virtual'", self.shell)


@dataclass(frozen=True, kw_only=True)
class RobotConfig:
    """One robot: recorded (it has a ``log``) or simulated (the mission has a ``world``)."""

    id: str
    """Its name, unique in the team: 1 to 64 letters, digits, _, - and ., not . first."""
    mode: str = "distributed"
    """"distributed", "mapper" (maps and sends, does not merge) or "central" (merges, does not map)."""
    log: str | None = None
    """Recorded log: a path, or a name in the data folder."""
    first: float = 0.0
    """Where in the log this robot begins, as a share of its scans, 0..1."""
    last: float = 1.0
    """Where it ends."""
    laser: str = "lidar-360"
    """Laser of a simulated robot, by name."""
    start: list[float] | None = None
    """Start of a simulated robot in the world [x_m, y_m, theta_rad]; random unless given."""
    start_known: bool = False
    """Whether the team knows ``start``, also of a recorded robot (in any one frame): the prior of its alignments."""
    driver: str = "explore"
    """What drives a simulated robot."""
    waypoints: list[list[float]] = field(default_factory=list)
    """World points [x_m, y_m] for the driver "waypoints"."""
    patrol: bool = False
    """Whether the driver "waypoints" begins again at the first when it has reached the last."""
    trajectory: str | None = None
    """TUM file of poses in the world for the driver "trajectory"; the robot starts at the first unless told."""
    rbpf: dict[str, Any] = field(default_factory=dict)
    """Its own settings over the mission's ``[rbpf]``: ``rbpf.particles = 60``, ``rbpf.resolution_m = 0.1``."""
    alignment: dict[str, Any] = field(default_factory=dict)
    """Its own settings over ``[alignment]``."""
    mutual_detection: dict[str, Any] = field(default_factory=dict)
    """Its own settings over ``[mutual_detection]``."""
    merge: dict[str, Any] = field(default_factory=dict)
    """Its own settings over ``[merge]``."""
    agent: dict[str, Any] = field(default_factory=dict)
    """Its own settings over ``[agent]``, but for ``tick_s``: all robots tick together."""

    def __post_init__(self) -> None:
        check_name(self.id, "robots.id")
        require(self.id not in OF_RUN, "robots.id", "no file of the run, in whose folder the robot's is", self.id)
        require(
            self.mode in ("distributed", "mapper", "central"),
            f"robots.{self.id}.mode",
            "distributed, mapper or central",
            self.mode,
        )
        require(
            0.0 <= self.first < self.last <= 1.0,
            f"robots.{self.id}.first, last",
            "0 <= first < last <= 1",
            [self.first, self.last],
        )
        require(
            self.start is None or (len(self.start) == 3 and all(abs(value) <= FARTHEST_M for value in self.start)),
            f"robots.{self.id}.start",
            f"[x_m, y_m, theta_rad], none beyond {FARTHEST_M:g}",
            self.start,
        )
        require(
            self.start is not None or not self.start_known,
            f"robots.{self.id}.start_known",
            "false where no start is given",
            self.start_known,
        )
        for point in self.waypoints:
            ok = len(point) == 2 and all(abs(value) <= FARTHEST_M for value in point)
            require(ok, f"robots.{self.id}.waypoints", f"[x_m, y_m] each, none beyond {FARTHEST_M:g}", point)
        tick_s = self.agent.get("tick_s")
        require(tick_s is None, f"robots.{self.id}.agent.tick_s", "that of the mission, for all robots", tick_s)

    @property
    def own_settings(self) -> dict[str, dict[str, Any]]:
        """Settings of this robot alone, by section."""
        own = {name: getattr(self, name) for name in OWN_SECTIONS}
        return {name: table for name, table in own.items() if table}


@dataclass(frozen=True, kw_only=True)
class SavedMapConfig:
    """A map saved before, in which robots that merge find their places."""

    path: str
    """A saved map in one file (``.mrslam``), a robot's folder, a run's, that of ``mrslam map``, or a map file of any
    system (YAML and image)."""
    id: str | None = None
    """Its name, with an @ ("office@monday"); by its file and folder unless given. Of a run's folder only by default."""
    near: list[float] | None = None
    """Where robots begin in it, [x_m, y_m] or [x_m, y_m, theta_rad], if that is known: it is looked at first."""

    robots: list[str] | None = None
    """Ids of the robots that are given it; all that map and merge unless given. They hand it on to teammates they meet
    (``comms.share_saved_maps``)."""

    def __post_init__(self) -> None:
        if self.id is not None:
            check_saved_id(self.id, "maps.id")
        if self.near is not None:
            check_start("maps.near", self.near)


@dataclass(frozen=True, kw_only=True)
class LinksConfig:
    """How robots hear each other."""

    keys: str | None = None
    """Folder of the team's keys (``mrslam keys``): links are mutual TLS; process shell only."""
    trace: str | None = None
    """CSV file ``t_s,a,b,quality``: link qualities over time; a quality holds until the pair's next line."""


@dataclass(frozen=True, kw_only=True)
class TruthConfig:
    """What the outcome is judged by; robots never see it."""

    relations: str | None = None
    """Relations file of the recorded log."""


@dataclass(frozen=True, kw_only=True)
class WorldConfig:
    """Where simulated robots are."""

    name: str
    """Built-in world ("office", "arena1", "office:SEED", ...), map YAML or bitmap."""
    scale_m: float | None = None
    """Metres a pixel of a bitmap."""
    walkers: int = 0
    """People who walk about, 0..1000: lasers see them as they see robots."""

    def __post_init__(self) -> None:
        require_bounds("world", self, {"scale_m": RESOLUTIONS_M, "walkers": (0, 1000)})


@dataclass(frozen=True, kw_only=True)
class SweepConfig:
    """What ``mrslam sweep`` varies where its command line names nothing; a single run does not look at it."""

    vary: list[str] = field(default_factory=list)
    """Settings and their values, each "section.key=value,value,..."."""
    seeds: int = 5
    """Runs of every setting, each with its own seed, >= 1."""

    def __post_init__(self) -> None:
        require_bounds("sweep", self, {"seeds": (1, 100_000)})
