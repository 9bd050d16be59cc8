"""Names of the files of a run, of its robots, and of agents: the one place where they are spelt."""

from __future__ import annotations

from mrslam.agent.shells.files import EVENTS_FILE as EVENTS_FILE
from mrslam.agent.shells.files import KEYFRAMES_FILE as KEYFRAMES_FILE
from mrslam.agent.shells.files import MAP_FILE as MAP_FILE
from mrslam.agent.shells.files import ROBOT_FILE as ROBOT_FILE
from mrslam.agent.shells.files import TEAM_FOLDER as TEAM_FOLDER
from mrslam.agent.shells.files import TEAM_IMAGE_FILE as TEAM_IMAGE_FILE
from mrslam.agent.shells.files import TEAM_MAP_FILE as TEAM_MAP_FILE
from mrslam.agent.shells.files import TEAM_OVERLAY_FILE as TEAM_OVERLAY_FILE
from mrslam.agent.shells.files import TRACKED_FILE as TRACKED_FILE
from mrslam.agent.shells.files import TRAJECTORY_FILE as TRAJECTORY_FILE
from mrslam.agent.shells.files import team_file as team_file

CONFIG_FILE = "config.json"
"""The resolved mission; written first, so that a run that was broken off has it, too."""
RUN_FORMAT = 2
"""Which settings ``config.json`` has: one more when a name goes or changes.

Files of format 1 do not say so."""
METRICS_FILE = "metrics.json"
"""What came out of the run; written last."""
LINKS_FILE = "links.csv"
"""True link qualities of a simulated mission, in the format of a trace."""
REPORT_FILE = "report.html"
"""The run as a page."""
RERUN_FILE = "run.rrd"
"""The run as a recording for the viewer."""
BAG_FILE = "run.mcap"
"""The run as a ROS2 recording."""
CHECKPOINT = "checkpoint"
"""A robot's state, from which it goes on after it died."""
SCANS_FILE = "scans.npz"
"""What a simulated robot sensed."""
TRUTH_FILE = "truth.tum"
"""True poses of a simulated robot in the world frame."""
USAGE_FILE = "usage.json"
"""CPU time and memory of a robot's process."""
VIEW_FILE = "view.rrd"
"""What a robot showed, as a recording for the viewer."""
AGENT_FILE = "agent.json"
"""Robot, team, input and settings of an agent that runs on its own."""
TWIN = "twin"
"""Folder in a robot's of a second process with its id, where a mission has that fault."""

MAP_IMAGE, TEAM_MAP_IMAGE = "map.pgm", "team_map.pgm"
"""Images of ``map.yaml`` and ``team_map.yaml``."""
OF_RUN = (METRICS_FILE, REPORT_FILE, RERUN_FILE, BAG_FILE, LINKS_FILE, CONFIG_FILE)
"""What a run, or a command on it, writes beside the robots' folders unless another place is named."""
OF_ROBOT = (
    EVENTS_FILE, CHECKPOINT, ROBOT_FILE, MAP_FILE, MAP_IMAGE, TEAM_MAP_FILE, TEAM_MAP_IMAGE, TEAM_IMAGE_FILE,
    TEAM_OVERLAY_FILE, TRAJECTORY_FILE, TRACKED_FILE, KEYFRAMES_FILE, TRUTH_FILE, SCANS_FILE, USAGE_FILE, VIEW_FILE,
)  # fmt: skip
"""What a robot of a run writes into its folder."""
OF_AGENT = (
    MAP_FILE,
    MAP_IMAGE,
    TEAM_MAP_FILE,
    TEAM_MAP_IMAGE,
    TEAM_IMAGE_FILE,
    TEAM_OVERLAY_FILE,
    TRAJECTORY_FILE,
    TRACKED_FILE,
    KEYFRAMES_FILE,
    USAGE_FILE,
)
"""What of an agent's folder is part of a run as it is."""
OF_DRIVE = (CONFIG_FILE, METRICS_FILE, LINKS_FILE, SCANS_FILE, TRUTH_FILE, EVENTS_FILE)
"""What of a run is needed to play it again."""
