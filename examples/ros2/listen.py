"""Listen to one robot's topics for some seconds from its first message on, as any other node would; print what came.

Of tf all frames that came are printed, and of teammates their newest pose.

python examples/ros2/listen.py /r1 --seconds 5
"""

from __future__ import annotations

import argparse
import re
import time
from collections import Counter
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
TOPICS = {
    "map": (OccupancyGrid, LATCHED),
    "team_map": (OccupancyGrid, LATCHED),
    "pose": (PoseWithCovarianceStamped, 10),
    "tf": (TFMessage, 100),
    "team_graph": (MarkerArray, 10),
    "diagnostics": (DiagnosticArray, 10),
}


def words(message: Any) -> str:
    match message:
        case OccupancyGrid():
            known = np.count_nonzero(np.frombuffer(message.data, dtype=np.int8) >= 0) * message.info.resolution**2
            return f"{message.info.width} x {message.info.height} cells, {known:.0f} m2, {message.header.frame_id}"
        case PoseWithCovarianceStamped():
            place = message.pose.pose.position
            return f"at {place.x:.2f} {place.y:.2f} in {message.header.frame_id}"
        case PoseStamped():
            return f"at {message.pose.position.x:.2f} {message.pose.position.y:.2f} in {message.header.frame_id}"
        case MarkerArray():
            return "; ".join(one.text for one in message.markers if one.text)
        case _:
            return "; ".join(f"{one.name}: {one.message}" for one in message.status)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("namespace")
    parser.add_argument("--seconds", type=float, default=5.0)
    options = parser.parse_args()
    rclpy.init()
    node = rclpy.create_node("listener")
    counts: Counter[str] = Counter()
    newest: dict[str, Any] = {}
    frames: dict[str, None] = {}  # a set in the order in which they came

    def listen(topic: str, kind: type, qos: Any) -> None:
        def take(message: Any) -> None:
            counts[topic] += 1
            newest[topic] = message
            if isinstance(message, TFMessage):
                frames.update((f"{one.header.frame_id} -> {one.child_frame_id}", None) for one in message.transforms)

        node.create_subscription(kind, f"{options.namespace}/{topic}", take, qos)

    for topic, (kind, qos) in TOPICS.items():
        listen(topic, kind, qos)
    print(f"waiting for {options.namespace} ...", flush=True)
    end_s = None
    look_s = 0.0
    while rclpy.ok() and (end_s is None or time.monotonic() < end_s):
        rclpy.spin_once(node, timeout_sec=0.1)
        if time.monotonic() >= look_s:  # for teammates, whose topics begin when they are placed
            look_s = time.monotonic() + 1.0
            for name, _ in node.get_topic_names_and_types():
                topic = name.removeprefix(f"{options.namespace}/")
                if re.fullmatch(r"teammates/\w+/pose", topic) and topic not in counts:
                    counts[topic] = 0
                    listen(topic, PoseStamped, 10)
        if end_s is None and newest:
            end_s = time.monotonic() + options.seconds
    for topic in sorted(newest.keys() | TOPICS.keys()):
        told = ", ".join(frames) if topic == "tf" else words(newest[topic]) if topic in newest else ""
        print(f"{options.namespace}/{topic}: {counts[topic]} messages; {told}")
    rclpy.try_shutdown()


main()
