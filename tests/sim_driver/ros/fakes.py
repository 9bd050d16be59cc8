"""Messages as ROS has them, without ROS."""

from __future__ import annotations

import array
import math
from types import SimpleNamespace
from typing import Any

NS = 1_000_000_000


def header(frame: str, stamp_s: float) -> Any:
    stamp_ns = round(stamp_s * NS)
    return SimpleNamespace(frame_id=frame, stamp=SimpleNamespace(sec=stamp_ns // NS, nanosec=stamp_ns % NS))


def turn(yaw: float, roll: float = 0.0) -> Any:
    cy, sy, cr, sr = math.cos(yaw / 2), math.sin(yaw / 2), math.cos(roll / 2), math.sin(roll / 2)
    return SimpleNamespace(x=cy * sr, y=sy * sr, z=sy * cr, w=cy * cr)


def scan(stamp_s: float, ranges: list[float] | None = None, frame: str = "laser", **changed: float) -> Any:
    fields = {"angle_min": -1.0, "angle_increment": 0.02, "range_min": 0.1, "range_max": 10.0}
    fields |= {"time_increment": 0.0, "scan_time": 0.1} | changed
    values = array.array("f", ranges if ranges is not None else [2.0] * 100)
    return SimpleNamespace(header=header(frame, stamp_s), ranges=values, **fields)


def transform(parent: str, child: str, stamp_s: float, x: float, y: float, yaw: float, roll: float = 0.0) -> Any:
    moved = SimpleNamespace(translation=SimpleNamespace(x=x, y=y, z=0.0), rotation=turn(yaw, roll))
    return SimpleNamespace(header=header(parent, stamp_s), child_frame_id=child, transform=moved)


def tf(*transforms: Any) -> Any:
    return SimpleNamespace(transforms=list(transforms))


def odometry(stamp_s: float, x: float, y: float = 0.0, yaw: float = 0.0, child: str = "base_link") -> Any:
    pose = SimpleNamespace(position=SimpleNamespace(x=x, y=y, z=0.0), orientation=turn(yaw))
    return SimpleNamespace(header=header("odom", stamp_s), child_frame_id=child, pose=SimpleNamespace(pose=pose))
