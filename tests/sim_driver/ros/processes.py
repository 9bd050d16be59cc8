"""Real nodes in processes of their own, and a plain node that listens to them; needs ``rclpy``."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

rclpy = pytest.importorskip("rclpy", reason="needs ROS 2: .ci/ros-env FOLDER makes an environment with it")

from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data  # noqa: E402

ROOT = Path(__file__).parents[3]
PLAYER = ROOT / "examples" / "ros2" / "play_robot.py"
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PLAIN = QoSProfile(depth=500)
SENSOR = qos_profile_sensor_data
TF_HERE = ["-r", "/tf:=tf", "-r", "/tf_static:=tf_static"]
"""A namespace's own tf, as Nav2 has it for several robots."""
DEADLINE_S = 120.0


def address() -> str:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{one.getsockname()[1]}"


def wait_for(ready: Callable[[], object], what: str, seconds: float = DEADLINE_S) -> None:
    end_s = time.monotonic() + seconds
    while not ready():
        assert time.monotonic() < end_s, f"waited {seconds:g} s for {what}"
        time.sleep(0.02)


class Processes:
    """Starts nodes and players; what they say goes to files."""

    def __init__(self, folder: Path, domain: int) -> None:
        self.folder = folder
        self.environment = os.environ | {
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "ROS_DOMAIN_ID": str(domain),
            "ROS_LOG_DIR": str(folder / "log"),
            "PYTHONPATH": str(ROOT),
        }
        self.running: list[subprocess.Popen[bytes]] = []

    def start(self, name: str, *command: str) -> subprocess.Popen[bytes]:
        with (self.folder / f"{name}.txt").open("ab") as said:
            process = subprocess.Popen(
                [sys.executable, *command], env=self.environment, stdout=said, stderr=said, cwd=self.folder
            )
        self.running.append(process)
        return process

    def robot(self, name: str, *arguments: str, ros: list[str] | None = None) -> subprocess.Popen[bytes]:
        """Start ``mrslam ros`` in a namespace of the robot's name."""
        network = [] if "--connect" in arguments or "--listen" in arguments else ["--listen", address()]
        given = ["--out", str(self.folder / name), *network, *arguments]
        before = self.said(name).count("is up")
        process = self.start(
            name, "-m", "mrslam", "ros", name, *given, "--ros-args", "-r", f"__ns:=/{name}", *TF_HERE, *(ros or [])
        )
        wait_for(
            lambda: self.said(name).count("is up") > before or process.poll() is not None, f"{name}'s start", 300.0
        )
        assert process.poll() is None, self.said(name)
        return process

    def player(self, name: str, log: Path, first: float, last: float, speed: float) -> subprocess.Popen[bytes]:
        """Start a player of a log as the robot of this name."""
        cut = ["--first", str(first), "--last", str(last), "--speed", str(speed), "--subscribers", "2"]
        stamps = ["--stamps", str(self.folder / f"{name}-{first}.stamps")]
        return self.start(
            f"player-{name}", str(PLAYER), str(log), *cut, *stamps, "--ros-args", "-r", f"__ns:=/{name}", *TF_HERE
        )

    def said(self, name: str) -> str:
        path = self.folder / f"{name}.txt"
        return path.read_text() if path.exists() else ""

    def warnings(self, name: str) -> list[str]:
        return [line for line in self.said(name).splitlines() if "[WARN]" in line and "is open" not in line]

    def stop(self, process: subprocess.Popen[bytes], name: str) -> None:
        process.send_signal(signal.SIGINT)
        assert process.wait(60.0) == 0, self.said(name)

    def close(self) -> None:
        for process in self.running:
            process.kill()
            process.wait()


class Listener:
    """A plain node in this process: keeps all messages of the topics it listens to, with the time they came."""

    def __init__(self, domain: int) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node: Node = rclpy.create_node("listener", context=self.context)
        self.heard: dict[str, list[Any]] = defaultdict(list)
        self.came_s: dict[str, list[float]] = defaultdict(list)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def listen(self, kind: type, topic: str, qos: Any = PLAIN, also: Callable[[Any], None] | None = None) -> None:
        def take(message: Any) -> None:
            self.came_s[topic].append(time.monotonic())
            self.heard[topic].append(message)
            if also is not None:
                also(message)

        self.node.create_subscription(kind, topic, take, qos)
        self._executor.wake()

    def newest(self, topic: str) -> Any:
        return self.heard[topic][-1] if self.heard[topic] else None

    def call(self, kind: type, name: str, request: Any, seconds: float = 30.0) -> Any:
        client = self.node.create_client(kind, name)
        assert client.wait_for_service(seconds), name
        answer = client.call_async(request)
        wait_for(answer.done, f"the answer of {name}", seconds)
        return answer.result()

    def close(self) -> None:
        self._executor.shutdown(5.0)
        self._thread.join(5.0)
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@contextmanager
def domain(folder: Path, number: int) -> Iterator[tuple[Processes, Listener]]:
    """Yield processes and a listener in a ROS domain of their own."""
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    processes, listener = Processes(folder, number), Listener(number)
    try:
        yield processes, listener
    finally:
        processes.close()
        listener.close()
