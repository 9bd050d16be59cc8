"""Play a ROS 2 recording (a folder of ``ros2 bag record``, or an .mcap) to a robot's node, with its own time on /clock.

    python examples/ros2/play_bag.py robot.mcap --rate 2 --ros-args -r /scan:=/r1/scan -r /tf:=/r1/tf

As ``ros2 bag play --clock`` does, where there is no ros2 command: laser scans, odometry and tf are published byte by
byte as they were recorded. Nodes that hear them are started with ``use_sim_time``.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import time
from pathlib import Path

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from rosgraph_msgs.msg import Clock

KINDS = ("sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry", "tf2_msgs/msg/TFMessage")
LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
CLOCK_S = 0.01
"""Longest time between two messages of the clock, seconds."""


def qos_of(kind: str, topic: str) -> QoSProfile:
    if kind == KINDS[0]:
        return qos_profile_sensor_data
    return LATCHED if topic.endswith("tf_static") else QoSProfile(depth=100)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--rate", type=float, default=1.0, help="seconds of the recording in a second")
    parser.add_argument("--subscribers", type=int, default=1, help="begin when the scans have as many")
    options, ros = parser.parse_known_args()
    rclpy.init(args=[sys.argv[0], *ros])
    node = rclpy.create_node("play_bag")
    clock = node.create_publisher(Clock, "/clock", 10)

    def tell(stamp_ns: int) -> None:
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(stamp_ns, 10**9)
        clock.publish(message)

    with AnyReader([options.recording], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as bag:
        publishers, scans = {}, []
        for one in (one for one in bag.connections if one.msgtype in KINDS):
            package, _, name = one.msgtype.split("/")
            kind = getattr(importlib.import_module(f"{package}.msg"), name)
            publishers[one.id] = node.create_publisher(kind, one.topic, qos_of(one.msgtype, one.topic))
            if one.msgtype == KINDS[0]:
                scans.append(publishers[one.id])
        while rclpy.ok() and any(one.get_subscription_count() < options.subscribers for one in scans):
            tell(bag.start_time)
            time.sleep(0.05)
        begin_s, played = time.monotonic(), 0
        connections = [one for one in bag.connections if one.id in publishers]
        for one, stamp_ns, raw in bag.messages(connections=connections):
            if not rclpy.ok():
                break
            due_s = begin_s + (stamp_ns - bag.start_time) / 1e9 / options.rate
            while (left_s := due_s - time.monotonic()) > 0.0:
                tell(stamp_ns - round(left_s * options.rate * 1e9))
                time.sleep(min(left_s, CLOCK_S))
            tell(stamp_ns)
            publishers[one.id].publish(bytes(raw))
            played += 1
    time.sleep(1.0)
    print(f"{played} messages were played")


main()
