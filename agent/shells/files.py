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
TEAM_OVERLAY_FILE = "team_overlay.png"
"""The same without any bending, with the places that tie the robots together; where maps are bent."""
TRAJECTORY_FILE = "trajectory.tum"
"""Poses of the robot's laser in its own map."""
TRACKED_FILE = "tracked.tum"
"""Poses of the robot's laser in the saved map's frame, while it tracked them there (``agent.localise``)."""
KEYFRAMES_FILE = "keyframes.npz"
"""The keyframes of the robot's own map, and what was seen at each."""
TEAM_FOLDER = "team"
"""Trajectories of the robots whose maps are bent to fit, a file each (:func:`team_file`), in the own map's frame."""


def team_file(robot_id: str) -> str:
    """Return the name of a robot's corrected trajectory, from the folder of the robot that corrected it."""
    return f"{TEAM_FOLDER}/{robot_id}.tum"
