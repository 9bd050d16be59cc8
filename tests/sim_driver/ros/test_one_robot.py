"""One real node, fed by hand: bad input, services, simulated time, wrong calls."""

from __future__ import annotations

import array
import math
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: .ci/ros-env FOLDER makes an environment with it")

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from nav_msgs.srv import LoadMap
from rcl_interfaces.srv import DescribeParameters, GetParameters
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

from tests.sim_driver.ros.processes import LATCHED, PLAIN, Listener, Processes, domain, wait_for
from tests.sim_driver.ros.test_outlook import room

PERIOD_S = 0.05


class Robot:
    """A robot by hand: it drives to and fro in a room, and publishes what it is told to."""

    def __init__(self, listener: Listener, name: str, begin_s: float | None = None) -> None:
        self.node = listener.node
        self.begin_s, self.k = time.time() if begin_s is None else begin_s, 0
        self.scans = self.node.create_publisher(LaserScan, f"/{name}/scan", PLAIN)
        self.odometry = self.node.create_publisher(Odometry, f"/{name}/odom", PLAIN)
        self.tf = self.node.create_publisher(TFMessage, f"/{name}/tf", PLAIN)
        self.tf_static = self.node.create_publisher(TFMessage, f"/{name}/tf_static", LATCHED)
        mount = TransformStamped(child_frame_id="laser")
        mount.header.frame_id = "base_link"
        self.tf_static.publish(TFMessage(transforms=[mount]))

    def drive(
        self, scans: int, change: Callable[[LaserScan], None] = lambda scan: None, *, laser: bool = True,
        wheels: bool = True, back_s: float = 0.0,
    ) -> None:  # fmt: skip
        """Publish a number of scans with their odometry; ``back_s`` : time jumps back by this before."""
        self.begin_s -= back_s
        for _ in range(scans):
            x_m = 1.5 * math.sin(0.02 * self.k)
            stamp_ns = round((self.begin_s + PERIOD_S * self.k) * 1e9)
            self.k += 1
            if wheels:
                moved = TransformStamped(child_frame_id="base_link")
                moved.header.frame_id = "odom"
                moved.header.stamp.sec, moved.header.stamp.nanosec = divmod(stamp_ns, 10**9)
                moved.transform.translation.x = x_m + 10.0
                self.tf.publish(TFMessage(transforms=[moved]))
                odometry = Odometry(header=moved.header, child_frame_id="base_link")
                odometry.pose.pose.position.x = x_m + 10.0
                self.odometry.publish(odometry)
            if laser:
                seen = room(stamp_ns, x_m)
                noise = np.random.default_rng(self.k).normal(0.0, 0.01, seen.ranges_m.size).astype(np.float32)
                scan = LaserScan(
                    angle_min=seen.angle_min_rad, angle_increment=seen.angle_increment_rad, range_max=20.0,
                    ranges=array.array("f", (seen.ranges_m + noise).tobytes()),
                )  # fmt: skip
                scan.header.frame_id = "laser"
                scan.header.stamp.sec, scan.header.stamp.nanosec = divmod(stamp_ns, 10**9)
                change(scan)
                self.scans.publish(scan)
            time.sleep(PERIOD_S)

    def wait_for_node(self, laser: bool = True) -> None:
        wait_for(lambda: (self.scans if laser else self.odometry).get_subscription_count() > 0, "the node to listen")


def scans_located(listener: Listener, name: str) -> int:
    return len(listener.heard[f"/{name}/pose"])


def stamp_s(message: PoseWithCovarianceStamped) -> float:
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec


def counted(listener: Listener, name: str, key: str) -> int:
    message = listener.newest(f"/{name}/diagnostics")
    values = {one.key: one.value for one in message.status[0].values} if message else {}
    return int(values.get(key, 0))


def break_ranges(scan: LaserScan) -> None:
    scan.ranges = array.array("f", [float("nan")] * len(scan.ranges))


def halve_beams(scan: LaserScan) -> None:
    scan.ranges = scan.ranges[: len(scan.ranges) // 2]


def misname(scan: LaserScan) -> None:
    scan.header.frame_id = "lazer"


def break_geometry(scan: LaserScan) -> None:
    scan.angle_increment = float("nan")


def test_bad_input_is_said_once_and_nothing_is_lost(tmp_path: Path) -> None:
    with domain(tmp_path, 102) as (processes, listener):
        listener.listen(PoseWithCovarianceStamped, "/r1/pose")
        listener.listen(DiagnosticArray, "/r1/diagnostics")
        node = processes.robot("r1", "--team", "ros-bad")
        robot = Robot(listener, "r1")
        robot.wait_for_node()
        begin_s = robot.begin_s
        robot.drive(30)
        wait_for(lambda: scans_located(listener, "r1") > 0, "the first pose")
        unheard = round((stamp_s(listener.heard["/r1/pose"][0]) - begin_s) / PERIOD_S)  # before the node found them
        for change in (break_ranges, halve_beams, misname, break_geometry):
            robot.drive(5, change)
            robot.drive(5)
        robot.drive(20, back_s=30.0)
        robot.drive(20, back_s=30.0)
        sent, refused = robot.k - unheard, 5
        wait_for(lambda: scans_located(listener, "r1") >= sent - refused, f"all of {sent} scans", 30.0)
        warnings = [line for line in processes.warnings("r1") if "cannot use what its laser" not in line]
        for words in (
            "without any finite range",
            "scans of 300 and of 150 beams",
            "how 'lazer' is mounted on 'base_link'",
            "angle_increment_rad must be finite",
            "stamps run backward by",
        ):
            assert sum(words in line for line in warnings) == 1, (words, warnings)
        wait_for(lambda: counted(listener, "r1", "trouble: clock") == 2, "the diagnostics to count", 10.0)
        assert counted(listener, "r1", "scans lost") == 0
        wait_for(lambda: list((tmp_path / "r1" / "sessions").glob("*.session")), "the session before the jump", 10.0)
        newest = listener.newest("/r1/pose").pose.pose.position
        assert abs(newest.x - 1.5 * math.sin(0.02 * (robot.k - 1))) < 0.2 and abs(newest.y) < 0.2
        processes.stop(node, "r1")


def test_one_of_scans_and_odometry_without_the_other_is_said_once(tmp_path: Path) -> None:
    with domain(tmp_path, 103) as (processes, listener):
        for name in ("r1", "r2"):
            processes.robot(name, "--team", f"ros-{name}")
            listener.listen(PoseWithCovarianceStamped, f"/{name}/pose")
            listener.listen(TFMessage, f"/{name}/tf")
        blind, wheelless = Robot(listener, "r1"), Robot(listener, "r2")
        blind.wait_for_node(laser=False)
        wheelless.wait_for_node()

        def said(name: str, words: str) -> int:
            blind.drive(1, laser=False)
            wheelless.drive(1, wheels=False)
            return sum(words in line for line in processes.warnings(name))

        wait_for(lambda: said("r1", "odometry comes, but no scan on scan"), "the warning", 30.0)
        wait_for(lambda: said("r2", "scans come, but no odometry"), "the warning", 30.0)
        for _ in range(40):
            assert said("r1", "but no scan on scan") == said("r2", "but no odometry") == 1
        assert scans_located(listener, "r2") > 40 and scans_located(listener, "r1") == 0
        frames = {one.child_frame_id for message in listener.heard["/r2/tf"] for one in message.transforms}
        assert frames == {"team_map"}


def test_services_and_parameters(tmp_path: Path) -> None:
    with domain(tmp_path, 104) as (processes, listener):
        listener.listen(PoseWithCovarianceStamped, "/r1/pose")
        listener.listen(OccupancyGrid, "/r1/map", LATCHED)
        node = processes.robot("r1", "--team", "ros-services", "--set", "rbpf.particles=11")
        robot = Robot(listener, "r1")
        robot.wait_for_node()
        names = ["rbpf.particles", "comms.exchange_timeout_s", "map_frame"]
        values = listener.call(GetParameters, "/r1/mrslam/get_parameters", GetParameters.Request(names=names)).values
        assert values[0].integer_value == 11 and values[1].double_value == 30.0 and values[2].string_value == "map"
        request = DescribeParameters.Request(names=names)
        told = listener.call(DescribeParameters, "/r1/mrslam/describe_parameters", request).descriptors
        assert all(one.description and one.read_only for one in told)

        robot.drive(60)
        saved = listener.call(Trigger, "/r1/save_session", Trigger.Request())
        assert saved.success, saved.message
        reset = listener.call(Trigger, "/r1/reset", Trigger.Request())
        assert reset.success, reset.message
        wait_for(lambda: processes.said("r1").count("is up") == 2, "the new map to begin", 30.0)
        robot.drive(20)
        x_m = listener.newest("/r1/pose").pose.pose.position.x
        assert abs(x_m - 1.5 * math.sin(0.02 * (robot.k - 1))) > 0.3, "the map's frame is the old one"
        for url, result in (("/nowhere", 1), (str(tmp_path / "r1.txt"), 2)):
            refused = listener.call(LoadMap, "/r1/load_session", LoadMap.Request(map_url=url))
            assert refused.result == result
        loaded = listener.call(LoadMap, "/r1/load_session", LoadMap.Request(map_url=saved.message))
        assert loaded.result == 0
        wait_for(lambda: processes.said("r1").count("is up") == 3, "the session to be loaded", 30.0)
        robot.drive(40)
        x_m = listener.newest("/r1/pose").pose.pose.position.x
        assert abs(x_m - 1.5 * math.sin(0.02 * (robot.k - 1))) < 0.2, "the map's frame is not the session's"
        assert len(list((tmp_path / "r1" / "sessions").glob("*.session"))) == 3  # saved, and before reset and load
        processes.stop(node, "r1")
        assert (tmp_path / "r1" / "map.pgm").exists()


def test_simulated_time_and_a_prefix(tmp_path: Path) -> None:
    with domain(tmp_path, 105) as (processes, listener):
        listener.listen(TFMessage, "/r1/tf")
        processes.robot(
            "r1", "--team", "ros-sim",
            ros=[
                "-p", "use_sim_time:=true", "-p", "frame_prefix:=r1/", "-p", "base_frame:=body", "-p", "odometry:=none"
            ],
        )  # fmt: skip
        clock = listener.node.create_publisher(Clock, "/clock", PLAIN)
        robot = Robot(listener, "r1", begin_s=1000.0)
        robot.wait_for_node()

        def at_time(scan: LaserScan) -> None:
            scan.header.frame_id = "r1/laser"
            clock.publish(Clock(clock=scan.header.stamp))

        def stamps() -> list[float]:
            robot.drive(1, at_time, wheels=False)
            found = [one for message in listener.heard["/r1/tf"] for one in message.transforms]
            times = [one.header.stamp for one in found if one.child_frame_id == "r1/body"]
            return [time.sec + time.nanosec / 1e9 for time in times]

        wait_for(lambda: len(stamps()) > 20, "transforms", 30.0)
        ahead_s = [newest_s - (1000.0 + PERIOD_S * (robot.k - 1)) for newest_s in (max(stamps()) for _ in range(20))]
        assert 0.0 < np.median(ahead_s) <= 0.2 + 2 * PERIOD_S, ahead_s  # ahead, and by the simulation's clock
        frames = {(one.header.frame_id, one.child_frame_id) for m in listener.heard["/r1/tf"] for one in m.transforms}
        assert frames >= {("r1/map", "r1/body"), ("r1/map", "r1/team_map")}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ["--ros-args", "-p", "rbpf.particels:=3"],
            "unknown parameter 'rbpf.particels'; did you mean 'rbpf.particles'?",
        ),
        (["r1", "--ros-args", "-p", "odometry:=wheels"], "odometry must be one of auto, tf, topic, none"),
        (["--ros-args", "-p", "team:=depot"], "the robot needs a name"),
    ],
)
def test_a_wrong_call_ends_with_one_line(tmp_path: Path, arguments: list[str], words: str) -> None:
    environment = Processes(tmp_path, 106).environment
    command = [sys.executable, "-m", "mrslam", "ros", *arguments]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=tmp_path, timeout=120)
    assert ended.returncode == 1 and words in ended.stderr, ended.stderr
    assert "Traceback" not in ended.stderr
