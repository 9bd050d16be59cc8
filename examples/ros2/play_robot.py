"""Play a recorded log as a robot with ROS 2 would: LaserScan on scan, Odometry on odom, tf odom -> base_link.

    python examples/ros2/play_robot.py slam/intel.clf.gz --last 0.2 --speed 5 --ros-args -r __ns:=/r1 -r /tf:=tf

Stamps are those of now. The laser is mounted 0.1 m before the base, by tf_static; its odometry is moved accordingly.
"""

from __future__ import annotations

import argparse
import array
import math
import sys
import time

import numpy as np
import rclpy
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

from mrslam.sim_driver.feeds import Reading, open_feed
from mrslam.sim_driver.missions.locate import locate
from mrslam.spatial import se2

T_BASE_LASER = np.array([0.1, 0.0, 0.0])


class Robot:
    def __init__(self, prefix: str) -> None:
        self.node = rclpy.create_node("robot")
        self.prefix = prefix
        self.scans = self.node.create_publisher(LaserScan, "scan", qos_profile_sensor_data)
        self.odometry = self.node.create_publisher(Odometry, "odom", 10)
        self.tf = self.node.create_publisher(TFMessage, "/tf", 100)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.tf_static = self.node.create_publisher(TFMessage, "/tf_static", latched)
        self.tf_static.publish(TFMessage(transforms=[self.transform("base_link", "laser", 0, T_BASE_LASER)]))

    def transform(self, parent: str, child: str, stamp_ns: int, T: np.ndarray) -> TransformStamped:
        message = TransformStamped(child_frame_id=self.prefix + child)
        message.header.frame_id = self.prefix + parent
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 10**9)
        message.transform.translation.x, message.transform.translation.y = float(T[0]), float(T[1])
        message.transform.rotation.z, message.transform.rotation.w = math.sin(T[2] / 2), math.cos(T[2] / 2)
        return message

    def play(self, reading: Reading, stamp_ns: int) -> None:
        scan = reading.scan
        if reading.T_odom_base is not None:  # a log's odometry is its laser's
            T = se2.compose(reading.T_odom_base, se2.inverse(T_BASE_LASER))
            moved = self.transform("odom", "base_link", stamp_ns, T)
            self.tf.publish(TFMessage(transforms=[moved]))
            wheels = Odometry(header=moved.header, child_frame_id=moved.child_frame_id)
            wheels.pose.pose.position.x, wheels.pose.pose.position.y = float(T[0]), float(T[1])
            wheels.pose.pose.orientation = moved.transform.rotation
            self.odometry.publish(wheels)
        message = LaserScan(
            angle_min=scan.angle_min_rad,
            angle_max=scan.angle_min_rad + scan.angle_increment_rad * (scan.ranges_m.size - 1),
            angle_increment=scan.angle_increment_rad,
            range_min=scan.range_min_m,
            range_max=scan.range_max_m,
            ranges=array.array("f", scan.ranges_m.tobytes()),
        )
        message.header.frame_id = self.prefix + "laser"
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 10**9)
        self.scans.publish(message)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log")
    parser.add_argument("--first", type=float, default=0.0, help="share of the log at which to begin")
    parser.add_argument("--last", type=float, default=1.0, help="share of the log at which to end")
    parser.add_argument("--speed", type=float, default=1.0, help="seconds of the log in a second")
    parser.add_argument("--prefix", default="", help="put before all frames")
    parser.add_argument(
        "--subscribers", type=int, default=1, help="begin when the scans have this number of subscribers"
    )
    parser.add_argument(
        "--stamps", help="write stamps here as they are given: a line a scan, log's ns and message's ns"
    )
    options, ros = parser.parse_known_args()
    readings = open_feed(locate(options.log)).readings
    readings = readings[round(options.first * len(readings)) : round(options.last * len(readings))]
    rclpy.init(args=[sys.argv[0], *ros])
    robot = Robot(options.prefix)
    while rclpy.ok() and robot.scans.get_subscription_count() < options.subscribers:
        time.sleep(0.05)
    given = []
    begin_ns, begin_s = readings[0].scan.stamp_ns, time.monotonic()
    for reading in readings:
        if not rclpy.ok():
            break
        due_s = (reading.scan.stamp_ns - begin_ns) / 1e9 / options.speed
        time.sleep(max(begin_s + due_s - time.monotonic(), 0.0))
        given.append((reading.scan.stamp_ns, time.time_ns()))
        robot.play(reading, given[-1][1])
    if options.stamps:
        with open(options.stamps, "w") as file:  # noqa: PTH123
            file.writelines(f"{log_ns} {stamp_ns}\n" for log_ns, stamp_ns in given)
    time.sleep(1.0)
    print(f"{len(given)} scans were played")


main()
