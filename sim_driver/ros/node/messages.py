"""ROS messages from plain values."""

from __future__ import annotations

import array
import math
from collections.abc import Mapping, Sequence

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Pose, PoseStamped, PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import OccupancyGrid as GridMessage
from numpy.typing import NDArray
from visualization_msgs.msg import Marker

from mrslam.spatial import OccupancyGrid
from mrslam.spatial.se2 import Transform

NS = 1_000_000_000
PLANE = (0, 1, 5)
"""Rows of x, y and yaw in a ROS covariance ``(6, 6)``."""


def time_of(stamp_ns: int) -> Time:
    """Return a stamp."""
    return Time(sec=stamp_ns // NS, nanosec=stamp_ns % NS)


def grid_of(grid: OccupancyGrid, frame: str, stamp_ns: int) -> GridMessage:
    """Return a map; its cells are copied as bytes, for a list of numbers would take a thousand times as long."""
    message = GridMessage()
    message.header.frame_id = frame
    message.header.stamp = message.info.map_load_time = time_of(stamp_ns)
    message.info.resolution = float(grid.resolution_m)
    message.info.height, message.info.width = grid.shape
    message.info.origin.position.x, message.info.origin.position.y = grid.origin_m
    cells = array.array("b")
    if grid.cells.size:
        cells.frombytes(grid.cells.data.cast("B"))
    message.data = cells
    return message


def transform_of(parent: str, child: str, stamp: Time, T_parent_child: Transform) -> TransformStamped:
    """Return a transform in the plane."""
    message = TransformStamped()
    message.header.frame_id, message.child_frame_id = parent, child
    message.header.stamp = stamp
    x_m, y_m, theta_rad = (float(value) for value in T_parent_child)
    message.transform.translation.x, message.transform.translation.y = x_m, y_m
    message.transform.rotation.z, message.transform.rotation.w = math.sin(theta_rad / 2.0), math.cos(theta_rad / 2.0)
    return message


def pose_of(T: Transform) -> Pose:
    """Return a pose in the plane."""
    pose = Pose()
    pose.position.x, pose.position.y = float(T[0]), float(T[1])
    pose.orientation.z, pose.orientation.w = math.sin(T[2] / 2.0), math.cos(T[2] / 2.0)
    return pose


def stamped_pose(frame: str, stamp_ns: int, T: Transform) -> PoseStamped:
    """Return a pose with frame and stamp."""
    message = PoseStamped(pose=pose_of(T))
    message.header.frame_id, message.header.stamp = frame, time_of(stamp_ns)
    return message


def pose_with_covariance(
    frame: str, stamp_ns: int, T: Transform, covariance: NDArray[np.float64]
) -> PoseWithCovarianceStamped:
    """Return a pose with its covariance ``(3, 3)``, m^2 and rad^2."""
    message = PoseWithCovarianceStamped()
    message.header.frame_id, message.header.stamp = frame, time_of(stamp_ns)
    message.pose.pose = pose_of(T)
    full = np.zeros((6, 6))
    full[np.ix_(PLANE, PLANE)] = covariance
    message.pose.covariance = full.ravel()
    return message


def marker(
    frame: str, stamp_ns: int, namespace: str, number: int, kind: int, colour: Sequence[float], size_m: float
) -> Marker:
    """Return a marker without content; ``colour`` : red, green, blue, alpha, 0..1."""
    message = Marker(ns=namespace, id=number, type=kind, action=Marker.ADD)
    message.header.frame_id, message.header.stamp = frame, time_of(stamp_ns)
    message.pose.orientation.w = 1.0
    message.scale.x = message.scale.y = message.scale.z = size_m
    message.color.r, message.color.g, message.color.b, message.color.a = (float(value) for value in colour)
    return message


def point(T: Transform) -> Point:
    """Return the position of a pose."""
    return Point(x=float(T[0]), y=float(T[1]), z=0.0)


def status_of(name: str, hardware: str, level: int, words: str, values: Mapping[str, object]) -> DiagnosticStatus:
    """Return one row of the diagnostics; ``level`` : 0 ok, 1 warning, 2 error."""
    pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
    return DiagnosticStatus(name=name, hardware_id=hardware, level=bytes([level]), message=words, values=pairs)
