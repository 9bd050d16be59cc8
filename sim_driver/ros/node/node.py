"""The node: parameters, subscriptions, timers, and the thread that runs their callbacks."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import rclpy
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

from mrslam.sim_driver.ros.complaints import Complaints
from mrslam.sim_driver.ros.inlet import Inlet
from mrslam.sim_driver.ros.jumps import JumpSessions
from mrslam.sim_driver.ros.node import qos
from mrslam.sim_driver.ros.node.outlets import Outlets
from mrslam.sim_driver.ros.node.services import Services
from mrslam.sim_driver.ros.outlook import RosBody
from mrslam.sim_driver.ros.parameters import check_known, parameters, resolve
from mrslam.sim_driver.ros.sessions import Sessions

NAME = "mrslam"
"""The node's name, unless it is remapped."""
MAPS_S, TEAM_S, STATUS_S = 0.25, 0.5, 1.0
"""Time between two looks for maps to publish, between two publications of the team, and of diagnostics, seconds."""
END_S = 5.0
"""Longest wait for the callbacks' thread at the end, seconds."""


class RosNode:
    """One robot's node; :meth:`connect` makes it hear and speak."""

    def __init__(self, arguments: Sequence[str], overrides: Mapping[str, Any]) -> None:
        """Start ROS with arguments as ``--ros-args ...``; ``overrides`` are parameters that count above those there.

        Raises ``InputError`` where a parameter makes no sense.
        """
        rclpy.init(args=["mrslam", *arguments], signal_handler_options=SignalHandlerOptions.NO)
        given = [Parameter(name, value=value) for name, value in overrides.items()]
        self.failure: BaseException | None = None
        """What ended the thread of the callbacks, if anything did."""
        try:
            self._node = rclpy.create_node(NAME, parameter_overrides=given)
            self.options, self.settings = resolve(self._declare(), self._node.get_namespace())
        except BaseException:
            rclpy.shutdown()
            raise
        self.complaints = Complaints(self.warn)
        self._executor = SingleThreadedExecutor()
        self._thread: threading.Thread | None = None
        self._log = _RosLog(self._node.get_logger())
        logging.getLogger("mrslam").addHandler(self._log)

    def _declare(self) -> dict[str, Any]:
        """Declare every parameter and return their values."""
        check_known(getattr(self._node, "_parameter_overrides", {}))
        values = {}
        for one in parameters():
            descriptor = ParameterDescriptor(description=one.text, read_only=True, dynamic_typing=True)
            values[one.name] = self._node.declare_parameter(one.name, one.default, descriptor).value
        return values

    def say(self, words: str) -> None:
        """Log a line for people."""
        self._node.get_logger().info(words)

    def warn(self, words: str) -> None:
        """Log a warning."""
        self._node.get_logger().warning(words)

    def now_ns(self) -> int:
        """Return the node's time, which is the simulation's with ``use_sim_time``; nanoseconds."""
        return int(self._node.get_clock().now().nanoseconds)

    def connect(self, body: RosBody, sessions: Sessions, folder: Path) -> None:
        """Subscribe, publish and offer services for the agent behind ``body``, on a thread of its own."""
        node, options = self._node, self.options
        outlets = Outlets(node, options, body, self.complaints)
        Services(node, body, outlets, sessions, folder)
        jumps = JumpSessions(body.ask, sessions.save, self.say, self.complaints)
        inlet = Inlet(options, body.take, self.complaints, time.monotonic(), jumps.on_jump)
        if options.mode != "central":
            self._subscribe(inlet)
        node.create_timer(MAPS_S, outlets.publish_maps, clock=_steady())
        node.create_timer(TEAM_S, outlets.publish_team, clock=_steady())

        def watch() -> None:
            now_s, came = time.monotonic(), inlet.arrivals
            if options.mode != "central":
                inlet.watch_silence(now_s)
            age_s = None if came.scan_s is None else now_s - came.scan_s
            outlets.publish_diagnostics(came.scans, came.odometry + came.transforms, age_s)

        node.create_timer(STATUS_S, watch, clock=_steady())

        def beat() -> None:
            inlet.pump(time.monotonic())
            outlets.publish_transforms()

        node.create_timer(options.transform_period_s, beat, clock=_steady())
        self._executor.add_node(node)
        self._thread = threading.Thread(target=self._spin, name="ros", daemon=True)
        self._thread.start()

    def _subscribe(self, inlet: Inlet) -> None:
        node, options = self._node, self.options

        def on_scan(topic: str, message: Any) -> None:
            inlet.take_scan(topic, message, self.now_ns(), time.monotonic())

        for topic in options.scan_topics:
            node.create_subscription(LaserScan, topic, partial(on_scan, topic), qos.SCAN)
        if options.odometry in ("auto", "topic"):
            node.create_subscription(
                Odometry,
                options.odom_topic,
                lambda message: inlet.take_odometry(message, self.now_ns(), time.monotonic()),
                qos.ODOMETRY,
            )
        for topic, is_static, profile in (("/tf", False, qos.TF), ("/tf_static", True, qos.TF_STATIC)):
            node.create_subscription(TFMessage, topic, _on_tf(inlet, is_static), profile)

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except ExternalShutdownException:
            pass
        except BaseException as error:  # noqa: BLE001 - the agent's thread ends the process in good order
            self.failure = error

    def close(self) -> None:
        """Stop the callbacks and leave ROS."""
        logging.getLogger("mrslam").removeHandler(self._log)
        self._executor.shutdown(END_S)
        if self._thread is not None:
            self._thread.join(END_S)
        self._node.destroy_node()
        rclpy.shutdown()


def _on_tf(inlet: Inlet, is_static: bool) -> Callable[[Any], None]:
    return lambda message: inlet.take_transforms(message, is_static, time.monotonic())


def _steady() -> Any:
    """Return the clock of the timers: a simulation that stands still must not stop warnings and maps."""
    return Clock(clock_type=ClockType.STEADY_TIME)


class _RosLog(logging.Handler):
    """Hands warnings of the library to the node's log."""

    def __init__(self, logger: Any) -> None:
        super().__init__(logging.WARNING)
        self._logger = logger

    def emit(self, record: logging.LogRecord) -> None:
        """Log one record."""
        self._logger.warning(record.getMessage())
