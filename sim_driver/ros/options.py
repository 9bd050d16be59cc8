"""What a node is told beside the settings: its robot, its network, its topics and its frames."""

from __future__ import annotations

from dataclasses import dataclass

from mrslam.spatial.errors import require

ODOMETRY = ("auto", "tf", "topic", "none")
"""Where odometry comes from; "auto": tf where it has the robot's base, else the topic."""
PERIODS_S = (0.005, 60.0)
"""Shortest and longest period of anything published, seconds."""


@dataclass(frozen=True, kw_only=True)
class RosOptions:
    """Parameters of the node that are no settings of mrslam; each is a ROS parameter of the same name."""

    robot: str = ""
    """The robot's name, unique in its team; empty: the last part of the node's namespace."""
    team: str = "team"
    """The team's name."""
    mode: str = "distributed"
    """distributed, mapper (merges nothing) or central (merges, has no laser)."""
    listen: tuple[str, ...] = ()
    """Addresses where teammates reach this robot, tcp/0.0.0.0:7447; separated by blanks, or a list."""
    connect: tuple[str, ...] = ()
    """Addresses of teammates or a router, tcp/10.0.0.2:7447; separated by blanks, or a list."""
    multicast: bool = False
    """Find teammates on the local network by multicast; always where neither listen nor connect is given."""
    keys: str = ""
    """The robot's folder of the team's keys (mrslam keys); empty: none."""
    config: str = ""
    """TOML file of settings, which parameters override; empty: none."""
    out: str = ""
    """The robot's folder for its checkpoint, events and maps; empty: out/ROBOT."""
    fresh: bool = False
    """Begin a new map; a checkpoint is kept as checkpoint.old."""
    maps: tuple[str, ...] = ()
    """Saved maps to find the own place in: .mrslam files, robots' folders, YAML; separated by blanks, or a list."""
    near: str = ""
    """Where the robot's map begins in the one saved map, "x,y" or "x,y,theta", metres and radians; empty: not known."""
    seed: int = 0
    """Of the particle filter, >= 0."""
    scan_topics: tuple[str, ...] = ("scan",)
    """LaserScan topics, one a laser, the first sets the pace; separated by blanks, or a list."""
    odom_topic: str = "odom"
    """Odometry topic."""
    odometry: str = "auto"
    """Where odometry comes from: auto (tf where it has the robot's base, else the topic), tf, topic or none."""
    map_frame: str = "map"
    """Frame of the robot's own map, or of the saved map that agent.frame names."""
    odom_frame: str = "odom"
    """Frame of the robot's odometry, the parent of its base in tf."""
    base_frame: str = "base_link"
    """The robot's base."""
    team_map_frame: str = "team_map"
    """Frame of the team map; it is the own map's as long as no map is bent to fit the others."""
    teammate_map_frame: str = "teammates/{id}/map"
    """Frame of a teammate's map, {id} is its name; empty: not published."""
    teammate_base_frame: str = "teammates/{id}/base_link"
    """Frame of a teammate's base, {id} is its name; empty: not published."""
    frame_prefix: str = ""
    """Put before all these frames, such as r1/, where several robots share one tf."""
    publish_tf: bool = True
    """Publish the transforms map -> odom, map -> team_map and those of teammates."""
    transform_timeout_s: float = 0.2
    """How far ahead of the scans transforms are stamped, seconds, >= 0."""
    transform_period_s: float = 0.05
    """Time between two publications of transforms, seconds."""
    map_period_s: float = 2.0
    """Least time between two publications of a map that changed, seconds."""
    map_repeat_s: float = 10.0
    """Time after which a map is published again though it has not changed, seconds."""

    def __post_init__(self) -> None:
        require(self.odometry in ODOMETRY, "odometry", f"one of {', '.join(ODOMETRY)}", self.odometry)
        require(len(self.scan_topics) > 0, "scan_topics", "one topic or more", self.scan_topics)
        require(self.seed >= 0, "seed", "0 or more", self.seed)
        require(0.0 <= self.transform_timeout_s <= 10.0, "transform_timeout_s", "0 to 10 s", self.transform_timeout_s)
        for name in ("transform_period_s", "map_period_s", "map_repeat_s"):
            value = getattr(self, name)
            require(PERIODS_S[0] <= value <= PERIODS_S[1], name, f"{PERIODS_S[0]:g} to {PERIODS_S[1]:g} s", value)
        for name in ("map_frame", "odom_frame", "base_frame", "team_map_frame"):
            require(getattr(self, name) != "", name, "the name of a frame", getattr(self, name))

    @property
    def multicasts(self) -> bool:
        """Whether teammates are found by multicast."""
        return self.multicast or not (self.listen or self.connect)

    def frame(self, name: str) -> str:
        """Return a frame's name with the prefix."""
        return self.frame_prefix + name

    def teammate_frames(self, robot_id: str) -> tuple[str, str]:
        """Return the frames of a teammate's map and base; empty where they are not published."""
        named = (self.teammate_map_frame, self.teammate_base_frame)
        map_frame, base_frame = (self.frame(one.replace("{id}", robot_id)) if one else "" for one in named)
        return map_frame, base_frame
