"""ROS recordings: ROS1 bags, ROS2 db3 and mcap, as files or folders; LaserScan with Odometry or TF.

Scans come in the order they were recorded, with odometry interpolated to their stamps; the laser's mounting is TF's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sized
from pathlib import Path
from typing import TypeVar

import numpy as np

from mrslam.sim_driver.feeds.bag_contents import BagContents, read_contents
from mrslam.sim_driver.feeds.base import Format, Reading
from mrslam.sim_driver.feeds.tf_tree import Motion, TransformTree
from mrslam.spatial import InputError
from mrslam.spatial.se2 import Transform

MAX_GAP_S = 1.0
"""Scans farther from any odometry than this get none."""
_Messages = TypeVar("_Messages", bound=Sized)


class RosbagFeed:
    """A ROS recording in memory, in the order of recording."""

    def __init__(
        self, path: Path, salvage: bool = False, scan_topic: str | None = None, odometry_topic: str | None = None
    ) -> None:
        """Read the whole recording; topics default to the busiest of their type.

        ``salvage`` : use what is whole of a ROS1 bag that was cut off, and note it.

        Raises ``InputError`` where the file is broken or holds no usable scan.
        """
        self.notes: list[str] = []
        contents = read_contents(path, self.notes, salvage)
        if not contents.scans:
            kinds = ", ".join(sorted(contents.topics)) or "none"
            why = "".join(f"; {note}" for note in self.notes)
            raise InputError(f"{path}: holds no sensor_msgs/LaserScan message; its topics are {kinds}{why}")
        topic, scans = self._choose(path, "scan", contents.scans, scan_topic)
        frame = scans[0].frame
        motion, base = self._odometry(path, contents, frame, odometry_topic)
        T_base_laser, upside_down = self._mounting(contents.tree, base, frame)
        self.readings: list[Reading] = []
        dropped = 0
        for message in scans:
            try:
                scan = message.scan(T_base_laser, upside_down)
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
        self, path: Path, what: str, by_topic: Mapping[str, _Messages], wanted: str | None
    ) -> tuple[str, _Messages]:
        if wanted is not None and wanted not in by_topic:
            raise InputError(f"{path}: no {what} topic {wanted!r}; there are {', '.join(sorted(by_topic))}")
        topic = wanted or max(sorted(by_topic), key=lambda name: len(by_topic[name]))
        if len(by_topic) > 1:
            others = ", ".join(sorted(set(by_topic) - {topic}))
            self.notes.append(f"{what} topic {topic} is used, {others} are not")
        return topic, by_topic[topic]

    def _odometry(
        self, path: Path, contents: BagContents, laser_frame: str, wanted: str | None
    ) -> tuple[Motion | None, str | None]:
        """Return the motion of the base, and the base's frame, by Odometry messages or else by TF."""
        tree = contents.tree
        told = {topic: motion for topic, motion in contents.odometry.items() if len(motion)}
        if told:
            topic, motion = self._choose(path, "odometry", told, wanted)
            return motion, contents.children[topic] or tree.base_above(laser_frame)
        base = tree.base_above(laser_frame)
        above = tree.parent(base) if base is not None else None
        if base is None or above is None or not tree.moves(base):
            self.notes.append("no odometry: neither Odometry messages nor a moving frame above the laser in TF")
            return None, base
        self.notes.append(f"odometry is taken from TF, {above} to {base}")
        return tree.motion(base), base

    def _mounting(self, tree: TransformTree, base: str | None, laser_frame: str) -> tuple[Transform, bool]:
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


ROSBAG = Format("rosbag", (".bag", ".db3", ".mcap"), RosbagFeed, folder_file="metadata.yaml")
