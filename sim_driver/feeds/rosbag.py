"""ROS recordings: ROS1 bags, ROS2 db3 and mcap, as files or folders; LaserScan with Odometry or TF.

Scans come in the order they were recorded, with odometry interpolated to their stamps; the laser's mounting is TF's.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim_driver.feeds.base import Reading
from sim_driver.feeds.tf_tree import Motion, TransformTree
from spatial import InputError, Scan
from spatial.scan import SLOWEST_SWEEP_S
from spatial.se2 import Transform

SCAN, ODOMETRY = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry"
TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
MAX_GAP_S = 1.0
"""Scans farther from any odometry than this get none."""
BROKEN_AFTER = 100
"""Messages that cannot be decoded before the whole file counts as broken."""


@dataclass
class _Contents:
    """What was read, by topic."""

    scans: dict[str, list[tuple[int, Any]]] = field(default_factory=lambda: defaultdict(list))
    odometry: dict[str, list[tuple[int, Any]]] = field(default_factory=lambda: defaultdict(list))
    tree: TransformTree = field(default_factory=TransformTree)
    topics: Counter[str] = field(default_factory=Counter)


class RosbagFeed:
    """A ROS recording in memory, in the order of recording."""

    def __init__(self, path: Path, scan_topic: str | None = None, odometry_topic: str | None = None) -> None:
        """Read the whole recording; topics default to the busiest of their type.

        Raises ``InputError`` where the file is broken or holds no usable scan.
        """
        self.notes: list[str] = []
        contents = _read(path, self.notes)
        if not contents.scans:
            kinds = ", ".join(sorted(contents.topics)) or "none"
            raise InputError(f"{path}: holds no sensor_msgs/LaserScan message; its topics are {kinds}")
        topic, scans = self._choose(path, "scan", contents.scans, scan_topic)
        frame = _frame(scans[0][1].header.frame_id)
        motion, base = self._odometry(path, contents, frame, odometry_topic)
        T_base_laser, upside_down = self._mounting(contents.tree, base, frame)
        self.readings: list[Reading] = []
        dropped = 0
        for recorded_ns, message in scans:
            try:
                scan = _scan(message, recorded_ns, T_base_laser, upside_down)
            except InputError as error:
                dropped += 1
                if dropped == 1:
                    self.notes.append(f"scans that make no sense are dropped, the first: {error}")
                continue
            self.readings.append(Reading(scan, None if motion is None else motion.at(scan.stamp_ns, MAX_GAP_S)))
        if not self.readings:
            raise InputError(f"{path}: none of the {len(scans)} scans on {topic} makes sense; {self.notes[-1]}")
        self._note_gaps(dropped)

    def _choose(
        self, path: Path, what: str, by_topic: dict[str, list[tuple[int, Any]]], wanted: str | None
    ) -> tuple[str, list[tuple[int, Any]]]:
        if wanted is not None and wanted not in by_topic:
            raise InputError(f"{path}: no {what} topic {wanted!r}; there are {', '.join(sorted(by_topic))}")
        topic = wanted or max(sorted(by_topic), key=lambda name: len(by_topic[name]))
        if len(by_topic) > 1:
            others = ", ".join(sorted(set(by_topic) - {topic}))
            self.notes.append(f"{what} topic {topic} is used, {others} are not")
        return topic, by_topic[topic]

    def _odometry(
        self, path: Path, contents: _Contents, laser_frame: str, wanted: str | None
    ) -> tuple[Motion | None, str | None]:
        """Return the motion of the base, and the base's frame, by Odometry messages or else by TF."""
        tree = contents.tree
        if contents.odometry:
            _, messages = self._choose(path, "odometry", contents.odometry, wanted)
            motion = Motion()
            for recorded_ns, message in messages:
                pose = message.pose.pose
                motion.add(_stamp(message.header, recorded_ns), pose.position, pose.orientation)
            return motion, _frame(messages[0][1].child_frame_id) or tree.base_above(laser_frame)
        base = tree.base_above(laser_frame)
        above = tree.parent(base) if base is not None else None
        if base is None or above is None or not tree.moves(base):
            self.notes.append("no odometry: neither Odometry messages nor a moving frame above the laser in TF")
            return None, base
        self.notes.append(f"odometry is taken from TF, {above} to {base}")
        return tree.motion(base), base

    def _mounting(self, tree: TransformTree, base: str | None, laser_frame: str) -> tuple[Transform, bool]:
        if base == laser_frame:
            return np.zeros(3), False
        mounted = None if base is None else tree.between(base, laser_frame)
        if mounted is None:
            self.notes.append(
                f"no TF from the base to {laser_frame!r}: the laser is taken to sit on the robot's centre"
            )
            return np.zeros(3), False
        if mounted[1]:
            self.notes.append("the laser is mounted upside down; its beams are mirrored")
        return mounted

    def _note_gaps(self, dropped: int) -> None:
        if dropped > 1:
            self.notes.append(f"{dropped} scans were dropped")
        without = sum(reading.T_odom_base is None for reading in self.readings)
        if 0 < without < len(self.readings):
            self.notes.append(f"{without} scans have no odometry within {MAX_GAP_S:g} s")
        steps = np.diff(np.array([reading.scan.stamp_ns for reading in self.readings]))
        if (steps < 0).any():
            self.notes.append(f"{int((steps < 0).sum())} stamps run backward; the order of recording is kept")
        if (steps == 0).any():
            self.notes.append(f"{int((steps == 0).sum())} stamps repeat the one before")


def _read(path: Path, notes: list[str]) -> _Contents:
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise InputError(f"{path}: reading ROS recordings needs rosbags: pip install 'mrslam[bags]'") from error
    contents, broken = _Contents(), 0
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            contents.topics.update(f"{c.topic} ({c.msgtype})" for c in reader.connections)
            wanted = [c for c in reader.connections if c.msgtype in (SCAN, ODOMETRY, *TRANSFORMS)]
            for connection, recorded_ns, raw in reader.messages(wanted) if wanted else ():
                try:
                    message: Any = reader.deserialize(raw, connection.msgtype)
                except Exception as error:  # a decoder fed with whatever the file holds
                    broken += 1
                    if broken > BROKEN_AFTER:
                        raise InputError(f"{path}: more than {BROKEN_AFTER} messages cannot be decoded") from error
                    continue
                _sort_in(contents, connection.msgtype, connection.topic, recorded_ns, message)
    except InputError:
        raise
    except Exception as error:  # third-party readers raise anything on broken files
        reason = (str(error).splitlines() or [""])[0] or type(error).__name__
        raise InputError(f"{path}: not a readable ROS recording, or cut off ({reason})") from error
    if broken:
        notes.append(f"{broken} messages could not be decoded")
    return contents


def _sort_in(contents: _Contents, kind: str, topic: str, recorded_ns: int, message: Any) -> None:
    if kind == SCAN:
        contents.scans[topic].append((recorded_ns, message))
    elif kind == ODOMETRY:
        contents.odometry[topic].append((recorded_ns, message))
    else:
        for one in message.transforms:
            contents.tree.add(
                _frame(one.header.frame_id),
                _frame(one.child_frame_id),
                _stamp(one.header, recorded_ns),
                one.transform.translation,
                one.transform.rotation,
            )


def _frame(name: str) -> str:
    """Return a frame's name without the leading slash that ROS1 allowed."""
    return name.lstrip("/")


def _stamp(header: Any, recorded_ns: int) -> int:
    """Return the message's own stamp, or when it was recorded where it has none."""
    stamp = int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)
    return stamp if stamp > 0 else recorded_ns


def _scan(message: Any, recorded_ns: int, T_base_laser: Transform, upside_down: bool) -> Scan:
    ranges: NDArray[np.float32] = np.asarray(message.ranges, dtype=np.float32)
    sign = -1.0 if upside_down else 1.0
    return Scan(
        stamp_ns=_stamp(message.header, recorded_ns),
        ranges_m=ranges,
        angle_min_rad=sign * float(message.angle_min),
        angle_increment_rad=sign * float(message.angle_increment),
        range_max_m=float(message.range_max),
        range_min_m=float(message.range_min),
        T_base_laser=T_base_laser,
        beam_interval_s=_beam_interval_s(message, ranges.size),
    )


def _beam_interval_s(message: Any, beams: int) -> float:
    """Return what the driver says, unless that cannot be: a sweep takes no longer than from one scan to the next."""
    interval_s, scan_s = float(message.time_increment), float(message.scan_time)
    longest_s = min(1.01 * scan_s, SLOWEST_SWEEP_S) if scan_s > 0.0 else SLOWEST_SWEEP_S
    return interval_s if 0.0 < interval_s * beams <= longest_s else 0.0
