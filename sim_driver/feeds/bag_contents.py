"""What a ROS recording holds that a mapper can use, picked from its messages while they are read.

A recording brings its own definitions of messages. Whatever is amiss with one is found here, where it is decoded.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.feeds.tf_tree import Motion, TransformTree
from mrslam.spatial import InputError, Scan
from mrslam.spatial.errors import first_line
from mrslam.spatial.scan import SLOWEST_SWEEP_S
from mrslam.spatial.se2 import Transform

SCAN, ODOMETRY = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry"
TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
BROKEN_AFTER = 100
"""Messages that cannot be decoded before the whole file counts as broken."""
LATEST_NS = 2**63 - 1
"""Stamps are 64 bits wide."""


@dataclass(frozen=True)
class LaserMessage:
    """A LaserScan as it was recorded: metres, radians, seconds."""

    frame: str
    stamp_ns: int
    ranges_m: NDArray[np.float32]
    angle_min_rad: float
    angle_increment_rad: float
    range_max_m: float
    range_min_m: float
    time_increment_s: float
    scan_time_s: float

    @classmethod
    def of(cls, message: Any, recorded_ns: int) -> LaserMessage:
        """Return what a message says; raise anything where it is none."""
        return cls(
            frame=_frame_name(message.header.frame_id),
            stamp_ns=_stamp_ns(message.header, recorded_ns),
            ranges_m=np.asarray(message.ranges, dtype=np.float32),
            angle_min_rad=float(message.angle_min),
            angle_increment_rad=float(message.angle_increment),
            range_max_m=float(message.range_max),
            range_min_m=float(message.range_min),
            time_increment_s=float(message.time_increment),
            scan_time_s=float(message.scan_time),
        )

    @property
    def beam_interval_s(self) -> float:
        """What the driver says, unless that cannot be: a sweep takes no longer than from one scan to the next."""
        longest_s = min(1.01 * self.scan_time_s, SLOWEST_SWEEP_S) if self.scan_time_s > 0.0 else SLOWEST_SWEEP_S
        return self.time_increment_s if 0.0 < self.time_increment_s * self.ranges_m.size <= longest_s else 0.0

    def scan(self, T_base_laser: Transform, upside_down: bool) -> Scan:
        """Return the scan of a laser mounted so; raises ``InputError`` where it makes no sense."""
        sign = -1.0 if upside_down else 1.0
        return Scan(
            stamp_ns=self.stamp_ns,
            ranges_m=self.ranges_m,
            angle_min_rad=sign * self.angle_min_rad,
            angle_increment_rad=sign * self.angle_increment_rad,
            range_max_m=self.range_max_m,
            range_min_m=self.range_min_m,
            T_base_laser=T_base_laser,
            beam_interval_s=self.beam_interval_s,
        )


@dataclass
class BagContents:
    """What was read, by topic."""

    scans: dict[str, list[LaserMessage]] = field(default_factory=lambda: defaultdict(list))
    odometry: dict[str, Motion] = field(default_factory=lambda: defaultdict(Motion))
    children: dict[str, str] = field(default_factory=dict)
    """The frame that moves, of each odometry topic."""
    tree: TransformTree = field(default_factory=TransformTree)
    topics: Counter[str] = field(default_factory=Counter)

    def add(self, kind: str, topic: str, recorded_ns: int, message: Any) -> None:
        """Sort one message in; raises anything where its definition is not ROS's."""
        if kind == SCAN:
            scan = LaserMessage.of(message, recorded_ns)
            self.scans[topic].append(scan)
        elif kind == ODOMETRY:
            self.children.setdefault(topic, _frame_name(message.child_frame_id))
            pose = message.pose.pose
            self.odometry[topic].add(_stamp_ns(message.header, recorded_ns), pose.position, pose.orientation)
        else:
            for one in message.transforms:
                names = _frame_name(one.header.frame_id), _frame_name(one.child_frame_id)
                stamp_ns = _stamp_ns(one.header, recorded_ns)
                self.tree.add(*names, stamp_ns, one.transform.translation, one.transform.rotation)


def read_contents(path: Path, notes: list[str], salvage: bool = False) -> BagContents:
    """Return what the recording holds; messages that are broken are counted in the notes.

    ``salvage`` : use what is whole of a ROS1 bag that was cut off. Raises ``InputError`` where it is no recording, was
    cut off, or more than a few messages are broken.
    """
    try:
        return _read(path, notes, is_cut=False)
    except InputError:
        if not salvage or path.suffix != ".bag":
            raise
    contents = _read(path, notes, is_cut=True)
    notes.append("the bag is cut off or damaged; what is whole of it is used")
    return contents


def _read(path: Path, notes: list[str], is_cut: bool) -> BagContents:
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise InputError(f"{path}: reading ROS recordings needs rosbags: pip install 'mrslam[bags]'") from error
    contents, broken = BagContents(), 0
    try:
        any_reader = AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE))
        if is_cut:
            from mrslam.sim_driver.feeds.cut_bag import CutBagReader

            any_reader.readers = [CutBagReader(path)]
        with any_reader as reader:
            contents.topics.update(f"{c.topic} ({c.msgtype})" for c in reader.connections)
            wanted = [c for c in reader.connections if c.msgtype in (SCAN, ODOMETRY, *TRANSFORMS)]
            for connection, recorded_ns, raw in reader.messages(wanted) if wanted else ():
                try:
                    message = reader.deserialize(raw, connection.msgtype)
                    contents.add(connection.msgtype, connection.topic, recorded_ns, message)
                except Exception as error:  # a decoder fed with whatever the file holds
                    broken += 1
                    if broken > BROKEN_AFTER:
                        raise InputError(f"{path}: more than {BROKEN_AFTER} messages cannot be decoded") from error
    except InputError:
        raise
    except Exception as error:  # third-party readers raise anything on broken files
        why = f"not a readable ROS recording, or cut off ({first_line(error)})"
        raise InputError(f"{path}: {why}" + ("" if is_cut else f"; {_remedy(path)}")) from error
    if broken:
        notes.append(f"{broken} messages could not be decoded")
    return contents


def _remedy(path: Path) -> str:
    """Return what mends a recording that was cut off."""
    if path.suffix == ".bag":
        return f"of a bag that was cut off --salvage uses what is there, and rosbag reindex {path.name} mends it"
    if path.suffix == ".mcap" or any(path.glob("*.mcap")):
        return "mcap recover FILE -o WHOLE.mcap mends a file that was cut off"
    folder = path if path.is_dir() else path.parent.resolve()
    return f"ros2 bag reindex {folder.name} mends a recording whose end is missing"


def _frame_name(name: str) -> str:
    """Return a frame's name without the leading slash that ROS1 allowed."""
    return name.lstrip("/")


def _stamp_ns(header: Any, recorded_ns: int) -> int:
    """Return the message's own stamp, or when it was recorded where it has none."""
    stamp_ns = int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)
    stamp_ns = stamp_ns if stamp_ns > 0 else recorded_ns
    if stamp_ns > LATEST_NS:
        raise ValueError(f"stamp {stamp_ns} ns out of range")
    return stamp_ns
