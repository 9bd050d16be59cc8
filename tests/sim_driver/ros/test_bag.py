"""A recording of a robot, played to its node by the examples, with the recording's time as simulated time."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: .ci/ros-env FOLDER makes an environment with it")

from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid

from mrslam.sim_driver.feeds import open_feed
from mrslam.spatial import se2
from tests.sim_driver.ros.processes import LATCHED, ROOT, SENSOR, TF_HERE, domain, wait_for
from tests.sim_driver.ros.test_two_robots import Reference

EXAMPLES = ROOT / "examples" / "ros2"
LAST, RATE = 0.04, 5.0


def test_a_recording_is_mapped_in_its_own_time(data_dir: Path, tmp_path: Path) -> None:
    log, recording = data_dir / "slam" / "intel.clf.gz", tmp_path / "robot.mcap"
    if not log.exists():
        pytest.skip(f"no {log}")
    with domain(tmp_path, 108) as (processes, listener):
        command = [sys.executable, str(EXAMPLES / "record_robot.py"), str(log), str(recording), "--last", str(LAST)]
        made = subprocess.run(command, env=processes.environment, capture_output=True, text=True, timeout=120)
        assert made.returncode == 0, made.stderr
        readings = open_feed(log).readings
        readings = readings[: round(LAST * len(readings))]
        listener.listen(PoseWithCovarianceStamped, "/r1/pose", SENSOR)
        listener.listen(OccupancyGrid, "/r1/map", LATCHED)
        node = processes.robot("r1", "--team", "ros-bag", ros=["-p", "use_sim_time:=true"])
        player = processes.start(
            "player", str(EXAMPLES / "play_bag.py"), str(recording), "--rate", str(RATE), "--ros-args", *TF_HERE
        )
        assert player.wait(300.0) == 0, processes.said("player")
        assert f"{3 * len(readings) + 1} messages were played" in processes.said("player")
        wait_for(lambda: listener.newest("/r1/map") is not None, "the map", 30.0)
        assert not [line for line in processes.warnings("r1") if "keys" not in line]

        message = listener.newest("/r1/pose")
        stamp_ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        k = [one.scan.stamp_ns for one in readings].index(stamp_ns)  # the recording's own time
        truth = Reference(data_dir)
        expected = se2.between(truth.at(readings[0].scan.stamp_ns), truth.at(stamp_ns))
        place = message.pose.pose.position
        assert k > 0.95 * len(readings)
        assert np.hypot(place.x - expected[0], place.y - expected[1]) < 0.15
        processes.stop(node, "r1")
