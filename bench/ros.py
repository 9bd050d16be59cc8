"""What the ROS 2 node costs beside the bare agent: scans lost, latency, CPU. Needs ROS 2 (.ci/ros-env).

    python bench/ros.py --rate 10 --seconds 600 --beams 683
    python bench/ros.py --rate 40 --seconds 120 --beams 1081

A simulated robot drives circles in an arena. Its scans, with odometry and tf at each, go to ``mrslam ros`` in a process
of its own, and the same scans at the same pace to a bare agent (a ProcessShell with a SensorBody) in another, one after
the other. One JSON line: ``sent``, ``located`` (poses that came back), ``lost`` (replaced by newer scans); ``ms`` from
the moment a scan is sent to the moment its pose is there, of node and bare agent, and ``added_ms``, the difference;
``mapping_ms``: the part of the node's in which the scan waited and was mapped; ``cpu`` of each, in cores. ``--bare``
and ``--node`` run one of them alone.
"""

from __future__ import annotations

import argparse
import array
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from mrslam.agent import Agent, ProcessShell, Runner, SensorBody, Settings, WallClock
from mrslam.comms import Incoming, Send
from mrslam.comms.transport.inbox import Inbox
from mrslam.sim_driver.kernels import load_kernels
from mrslam.sim_driver.robots import LASERS, SimulatedRobot
from mrslam.sim_driver.worlds import load_world
from mrslam.spatial import Scan, se2
from mrslam.spatial.se2 import Transform

WARM_S = 3.0
"""Not counted: the first seconds, in which both load what they need."""

Played = tuple[Scan, Transform]


def circles(beams: int, rate_hz: float, seconds: float) -> list[Played]:
    """Return scans of 270 degrees with odometry, of a robot that drives circles."""
    step_rad = 1.5 * np.pi / (beams - 1)
    laser = replace(
        LASERS["lidar-360"], beams=beams, angle_min_rad=-0.75 * np.pi, angle_increment_rad=step_rad, rate_hz=rate_hz
    )
    robot = SimulatedRobot(load_world("arena2"), se2.transform(7.2, 4.2, 0.0), laser, np.random.default_rng(1))
    out = []
    for k in range(round(rate_hz * seconds)):
        robot.step((0.3, 0.45), dt_s=1.0 / rate_hz)
        out.append((robot.scan(round(k / rate_hz * 1e9)), robot.T_odom_base.copy()))
    return out


def paced(scans: list[Played], rate_hz: float, send: Callable[[Scan, Transform], None]) -> None:
    """Send scans at their pace."""
    begin_s = time.monotonic()
    for k, (scan, T_odom_base) in enumerate(scans):
        time.sleep(max(begin_s + k / rate_hz - time.monotonic(), 0.0))
        send(scan, T_odom_base)


def row(sent: dict[int, float], back: dict[int, float], lost: int, cpu_s: float, wall_s: float) -> dict[str, Any]:
    """Return the figures; ``sent`` and ``back`` are by stamp, seconds."""
    begin_s = min(sent.values()) + WARM_S
    ms = [1e3 * (back[stamp] - at_s) for stamp, at_s in sent.items() if stamp in back and at_s >= begin_s]
    p50, p99, most = np.percentile(ms, (50, 99, 100))
    return {
        "sent": len(sent),
        "located": len(set(sent) & set(back)),
        "lost": lost,
        "ms": {"p50": round(float(p50), 1), "p99": round(float(p99), 1), "max": round(float(most), 1)},
        "cpu": round(cpu_s / wall_s, 3),
    }


class Alone:
    """A network without anybody."""

    def __init__(self) -> None:
        self.inbox = Inbox()

    def send(self, message: Send) -> None:
        """Nobody hears it."""

    def poll(self, timeout_s: float) -> list[Incoming]:
        """Wait for a scan."""
        return [one for one in self.inbox.take(timeout_s) if isinstance(one, Incoming)]

    def close(self) -> None:
        """Nothing to close."""


class Clocked:
    """Notes when each scan was mapped."""

    def __init__(self) -> None:
        self.back: dict[int, float] = {}

    def on_scan(self, agent: Agent, sensed: Any, now_ns: int) -> None:
        """Note it."""
        self.back[sensed.scan.stamp_ns] = time.monotonic()

    def on_event(self, agent: Agent, event: Any) -> None:
        """Events are of no interest."""

    def close(self, agent: Agent, now_ns: int) -> None:
        """Nothing to close."""


def bare(options: argparse.Namespace, answer: Any) -> None:
    """Feed a bare agent; the scans are made first, and the thread that sends them costs next to nothing."""
    load_kernels()
    scans = circles(options.beams, options.rate, options.seconds)
    transport, clocked, sent = Alone(), Clocked(), {}
    body = SensorBody(WallClock(), patience_s=0.5, on_ready=transport.inbox.wake)
    with tempfile.TemporaryDirectory() as folder:
        agent = Agent("r1", Settings(), boot_id=1)
        runner = Runner(agent, body, transport, Path(folder), watchers=[clocked])  # type: ignore[arg-type]
        over = threading.Event()

        def feed() -> None:
            def send(scan: Scan, T_odom_base: Transform) -> None:
                sent[scan.stamp_ns] = time.monotonic()
                body.on_scan(scan, T_odom_base)

            paced(scans, options.rate, send)
            time.sleep(1.0)
            over.set()

        begin_s, begin_cpu_s = time.monotonic(), time.process_time()
        threading.Thread(target=feed).start()
        ProcessShell(runner, WallClock()).run(over.is_set)
        cpu_s, wall_s = time.process_time() - begin_cpu_s, time.monotonic() - begin_s
        answer.send(row(sent, clocked.back, body.scans_lost, cpu_s, wall_s))


def node(options: argparse.Namespace, folder: Path) -> dict[str, Any]:
    """Feed a node in a process of its own."""
    environment = os.environ | {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": str(options.domain)}
    os.environ.update(environment)
    import rclpy
    from diagnostic_msgs.msg import DiagnosticArray
    from geometry_msgs.msg import PoseWithCovarianceStamped

    scans = circles(options.beams, options.rate, options.seconds)
    command = [sys.executable, "-m", "mrslam", "ros", "r1", "--listen", "tcp/127.0.0.1:0", "--out", str(folder / "r1")]
    log = (folder / "node.txt").open("w")
    process = subprocess.Popen([*command, "--ros-args", "-r", "__ns:=/r1"], env=environment, stdout=log, stderr=log)
    rclpy.init()
    robot = Driver(rclpy.create_node("driver"))
    sent, back, lost = {}, {}, [0]

    def on_pose(message: Any) -> None:
        back[message.header.stamp.sec * 10**9 + message.header.stamp.nanosec] = time.monotonic()

    def on_diagnostics(message: Any) -> None:
        lost[0] = int(next(one.value for one in message.status[0].values if one.key == "scans lost"))

    robot.node.create_subscription(PoseWithCovarianceStamped, "/r1/pose", on_pose, 1000)
    robot.node.create_subscription(DiagnosticArray, "/r1/diagnostics", on_diagnostics, 10)
    threading.Thread(target=rclpy.spin, args=(robot.node,), daemon=True).start()
    while robot.scans.get_subscription_count() == 0:
        if process.poll() is not None:
            raise SystemExit((folder / "node.txt").read_text())
        time.sleep(0.1)
    time.sleep(2.0)
    usage = psutil.Process(process.pid)
    begin_s, before = time.monotonic(), usage.cpu_times()

    def send(scan: Scan, T_odom_base: Transform) -> None:
        message = robot.message(scan, time.time_ns())
        sent[message.header.stamp.sec * 10**9 + message.header.stamp.nanosec] = time.monotonic()
        robot.move(T_odom_base)
        robot.scans.publish(message)

    paced(scans, options.rate, send)
    time.sleep(1.5)
    after, wall_s = usage.cpu_times(), time.monotonic() - begin_s
    process.send_signal(signal.SIGINT)
    process.wait(60.0)
    rclpy.shutdown()
    found = row(sent, back, lost[0], after.user + after.system - before.user - before.system, wall_s)
    return found | {"mapping_ms": json.loads((folder / "r1" / "usage.json").read_text())["scan_age_ms"]}


class Driver:
    """Publishes scans, odometry and tf."""

    def __init__(self, node: Any) -> None:
        from nav_msgs.msg import Odometry
        from rclpy.qos import qos_profile_sensor_data
        from sensor_msgs.msg import LaserScan
        from tf2_msgs.msg import TFMessage

        self.node = node
        self.scans = node.create_publisher(LaserScan, "/r1/scan", qos_profile_sensor_data)
        self.odometry = node.create_publisher(Odometry, "/r1/odom", 10)
        self.tf = node.create_publisher(TFMessage, "/tf", 100)

    def message(self, scan: Scan, stamp_ns: int) -> Any:
        """Return a scan as a message."""
        from sensor_msgs.msg import LaserScan

        message = LaserScan(
            angle_min=scan.angle_min_rad, angle_increment=scan.angle_increment_rad, range_max=scan.range_max_m,
            range_min=scan.range_min_m, ranges=array.array("f", scan.ranges_m.tobytes()),
        )  # fmt: skip
        message.header.frame_id = "base_link"
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 10**9)
        return message

    def move(self, T_odom_base: Transform) -> None:
        """Publish odometry and tf."""
        from geometry_msgs.msg import TransformStamped
        from nav_msgs.msg import Odometry
        from tf2_msgs.msg import TFMessage

        moved = TransformStamped(child_frame_id="base_link")
        moved.header.frame_id = "odom"
        moved.header.stamp.sec, moved.header.stamp.nanosec = divmod(time.time_ns(), 10**9)
        moved.transform.translation.x, moved.transform.translation.y = float(T_odom_base[0]), float(T_odom_base[1])
        moved.transform.rotation.z, moved.transform.rotation.w = np.sin(T_odom_base[2] / 2), np.cos(T_odom_base[2] / 2)
        self.tf.publish(TFMessage(transforms=[moved]))
        wheels = Odometry(header=moved.header, child_frame_id="base_link")
        wheels.pose.pose.position.x, wheels.pose.pose.position.y = float(T_odom_base[0]), float(T_odom_base[1])
        wheels.pose.pose.orientation = moved.transform.rotation
        self.odometry.publish(wheels)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rate", type=float, default=10.0, help="scans a second")
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--beams", type=int, default=683)
    parser.add_argument("--domain", type=int, default=108, help="ROS_DOMAIN_ID")
    parser.add_argument("--bare", action="store_true", help="the bare agent alone")
    parser.add_argument("--node", action="store_true", help="the node alone")
    options = parser.parse_args()
    found: dict[str, Any] = {"rate_hz": options.rate, "seconds": options.seconds, "beams": options.beams}
    if not options.node:
        here, there = multiprocessing.get_context("spawn").Pipe()
        process = multiprocessing.get_context("spawn").Process(target=bare, args=(options, there))
        process.start()
        found["bare"] = here.recv()
        process.join()
    if not options.bare:
        with tempfile.TemporaryDirectory() as folder:
            found["node"] = node(options, Path(folder))
    if "bare" in found and "node" in found:
        node_ms, bare_ms = found["node"]["ms"], found["bare"]["ms"]
        found["added_ms"] = {key: round(node_ms[key] - bare_ms[key], 1) for key in ("p50", "p99")}
    print(json.dumps(found))


if __name__ == "__main__":
    main()
