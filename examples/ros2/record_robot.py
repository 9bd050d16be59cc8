"""Write a recorded log's robot as the ROS 2 recording (mcap) that ``ros2 bag record`` would have made of it.

    python examples/ros2/record_robot.py slam/intel.clf.gz intel.mcap --last 0.2 --robot r1

The topics are /r1/scan, /r1/odom, /r1/tf and /r1/tf_static. It needs rosbags (pip install 'mrslam[bags]'), and no ROS.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from mrslam.sim_driver.feeds import open_feed
from mrslam.sim_driver.feeds.bag_writer import BagWriter
from mrslam.sim_driver.missions.locate import locate
from mrslam.spatial import se2

T_BASE_LASER = np.array([0.1, 0.0, 0.0])
"""The laser is mounted 0.1 m before the base; a log's odometry is its laser's."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log")
    parser.add_argument("recording", type=Path)
    parser.add_argument("--robot", default="r1", help="its namespace")
    parser.add_argument("--first", type=float, default=0.0, help="share of the log at which to begin")
    parser.add_argument("--last", type=float, default=1.0, help="share of the log at which to end")
    options = parser.parse_args()
    readings = open_feed(locate(options.log)).readings
    readings = readings[round(options.first * len(readings)) : round(options.last * len(readings))]
    of = f"/{options.robot}"
    with BagWriter(options.recording) as bag:
        bag.transform("base_link", "laser", readings[0].scan.stamp_ns, T_BASE_LASER, topic=f"{of}/tf_static")
        for reading in readings:
            if reading.T_odom_base is not None:
                T_odom_base = se2.compose(reading.T_odom_base, se2.inverse(T_BASE_LASER))
                bag.transform("odom", "base_link", reading.scan.stamp_ns, T_odom_base, topic=f"{of}/tf")
                bag.odometry(f"{of}/odom", "odom", "base_link", reading.scan.stamp_ns, T_odom_base)
            bag.scan(f"{of}/scan", "laser", reading.scan)
    print(f"{len(readings)} scans are in {options.recording}")


main()
