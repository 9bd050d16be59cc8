"""Write maps, paths and scans as a ROS2 recording (mcap) that the usual viewers show, without ROS.

Maps, paths and ``/tf_static`` are latched (transient local), so that a viewer that comes later gets them, too.
"""

from __future__ import annotations

import math
import shutil
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import InputError, OccupancyGrid, Scan
from mrslam.spatial.se2 import Transform

NS = 1_000_000_000
NO_COVARIANCE = np.zeros(36)
"""Of odometry: not known, as ROS has it."""


class BagWriter:
    """A ROS2 recording that is being written: one .mcap file. Use it as a context manager."""

    def __init__(self, path: Path) -> None:
        """Begin the file; raise ``InputError`` where it is there already, is no .mcap, or rosbags is missing."""
        if path.suffix != ".mcap":
            raise InputError(f"{path}: a ROS2 recording's name ends in .mcap")
        if path.exists():
            raise InputError(f"{path}: is there already; name another file")
        try:
            from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
            from rosbags.rosbag2 import StoragePlugin, Writer
            from rosbags.typesys import Stores, get_typestore
        except ImportError as error:
            raise InputError(f"{path}: writing ROS recordings needs rosbags: pip install 'mrslam[bags]'") from error
        self._path = path
        forever = QosTime(0, 0)
        self._latched = Qos(
            QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, forever, forever,
            QosLiveliness.AUTOMATIC, forever, False,
        )  # fmt: skip
        # rosbags writes a folder; the one recording in it is moved out at the end.
        self._folder = Path(tempfile.mkdtemp(dir=_made(path.parent), prefix=f".{path.stem}-"))
        self._store = get_typestore(Stores.ROS2_HUMBLE)
        self._connections: dict[str, Any] = {}
        self._writer = Writer(self._folder / "bag", version=9, storage_plugin=StoragePlugin.MCAP)

    def __enter__(self) -> BagWriter:
        """Open the file."""
        self._writer.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file; what was not written in full is removed."""
        try:
            self._writer.close()
            if kind is None:
                (recording,) = (self._folder / "bag").glob("*.mcap")
                recording.replace(self._path)
        finally:
            shutil.rmtree(self._folder, ignore_errors=True)

    def grid(self, topic: str, frame: str, stamp_ns: int, grid: OccupancyGrid) -> None:
        """Write a map as ``nav_msgs/OccupancyGrid``."""
        height, width = grid.shape
        stamp = self._stamp(stamp_ns)
        info = self._make(
            "nav_msgs/msg/MapMetaData",
            map_load_time=stamp,
            resolution=grid.resolution_m,
            width=width,
            height=height,
            origin=self._pose(np.array([*grid.origin_m, 0.0])),
        )
        header = self._header(frame, stamp_ns)
        cells = np.ascontiguousarray(grid.cells).ravel()
        message = self._make("nav_msgs/msg/OccupancyGrid", header=header, info=info, data=cells)
        self._write(topic, stamp_ns, message, is_latched=True)

    def path(self, topic: str, frame: str, stamps_ns: NDArray[np.int64], poses: NDArray[np.float64]) -> None:
        """Write ``(N, 3)`` poses with ``(N,)`` stamps as one ``nav_msgs/Path``, at the first stamp."""
        stamped = [
            self._make("geometry_msgs/msg/PoseStamped", header=self._header(frame, int(stamp)), pose=self._pose(pose))
            for stamp, pose in zip(stamps_ns, poses, strict=True)
        ]
        first_ns = int(stamps_ns[0]) if len(stamps_ns) else 0
        message = self._make("nav_msgs/msg/Path", header=self._header(frame, first_ns), poses=stamped)
        self._write(topic, first_ns, message, is_latched=True)

    def transform(self, parent: str, child: str, stamp_ns: int, T_parent_child: Transform, topic: str = "/tf") -> None:
        """Write where a frame lies in another as ``tf2_msgs/TFMessage``; for good on a topic named tf_static."""
        pose = self._pose(T_parent_child)
        translation = self._make("geometry_msgs/msg/Vector3", x=pose.position.x, y=pose.position.y, z=0.0)
        one = self._make(
            "geometry_msgs/msg/TransformStamped",
            header=self._header(parent, stamp_ns),
            child_frame_id=child,
            transform=self._make("geometry_msgs/msg/Transform", translation=translation, rotation=pose.orientation),
        )
        message = self._make("tf2_msgs/msg/TFMessage", transforms=[one])
        self._write(topic, stamp_ns, message, topic.endswith("tf_static"))

    def odometry(self, topic: str, parent: str, child: str, stamp_ns: int, T_parent_child: Transform) -> None:
        """Write what the wheels say as ``nav_msgs/Odometry``, without velocities."""
        pose = self._make(
            "geometry_msgs/msg/PoseWithCovariance", pose=self._pose(T_parent_child), covariance=NO_COVARIANCE
        )
        still = self._make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
        twist = self._make("geometry_msgs/msg/Twist", linear=still, angular=still)
        message = self._make(
            "nav_msgs/msg/Odometry",
            header=self._header(parent, stamp_ns),
            child_frame_id=child,
            pose=pose,
            twist=self._make("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=NO_COVARIANCE),
        )
        self._write(topic, stamp_ns, message)

    def scan(self, topic: str, frame: str, scan: Scan) -> None:
        """Write a scan as ``sensor_msgs/LaserScan``; inf and NaN keep their meanings (no return, no reading)."""
        message = self._make(
            "sensor_msgs/msg/LaserScan",
            header=self._header(frame, scan.stamp_ns),
            angle_min=scan.angle_min_rad,
            angle_max=scan.angle_min_rad + scan.angle_increment_rad * (scan.ranges_m.size - 1),
            angle_increment=scan.angle_increment_rad,
            time_increment=scan.beam_interval_s,
            scan_time=0.0,
            range_min=scan.range_min_m,
            range_max=scan.range_max_m,
            ranges=np.asarray(scan.ranges_m, dtype=np.float32),
            intensities=np.empty(0, dtype=np.float32),
        )
        self._write(topic, scan.stamp_ns, message)

    def _write(self, topic: str, stamp_ns: int, message: Any, is_latched: bool = False) -> None:
        kind = message.__msgtype__
        if topic not in self._connections:
            qos = (self._latched,) if is_latched else ()
            self._connections[topic] = self._writer.add_connection(
                topic, kind, typestore=self._store, offered_qos_profiles=qos
            )
        self._writer.write(self._connections[topic], stamp_ns, self._store.serialize_cdr(message, kind))

    def _make(self, kind: str, **fields: Any) -> Any:
        return self._store.types[kind](**fields)

    def _stamp(self, stamp_ns: int) -> Any:
        if not 0 <= stamp_ns // NS < 2**31:
            raise InputError(f"{self._path}: a time of {stamp_ns / NS:g} s does not fit into a ROS2 recording")
        return self._make("builtin_interfaces/msg/Time", sec=stamp_ns // NS, nanosec=stamp_ns % NS)

    def _header(self, frame: str, stamp_ns: int) -> Any:
        return self._make("std_msgs/msg/Header", stamp=self._stamp(stamp_ns), frame_id=frame)

    def _pose(self, T_parent_child: Transform) -> Any:
        x, y, theta = (float(value) for value in T_parent_child)
        half = theta / 2.0
        return self._make(
            "geometry_msgs/msg/Pose",
            position=self._make("geometry_msgs/msg/Point", x=x, y=y, z=0.0),
            orientation=self._make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=math.sin(half), w=math.cos(half)),
        )


def _made(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder
