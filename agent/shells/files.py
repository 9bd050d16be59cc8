"""Names of the files that a robot leaves in its folder."""

from __future__ import annotations

EVENTS_FILE = "events.jsonl"
"""Events as JSON lines, each written at once."""
ROBOT_FILE = "robot.json"
"""Summary of what the robot knew at its end."""
MAP_FILE = "map.yaml"
"""The robot's own map; its image is beside it."""
TEAM_MAP_FILE = "team_map.yaml"
"""The team's map in the frame of the robot's own; its image is beside it."""
TEAM_IMAGE_FILE = "team_map.png"
"""The team's map in colours, a robot each."""
TRAJECTORY_FILE = "trajectory.tum"
"""Poses of the robot's laser in its own map."""
