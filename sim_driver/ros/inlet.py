"""From messages to scans: each LaserScan with its mounting and the odometry of its moment, for the agent's body.

A scan waits a little for the odometry around it, and the first ones of a laser for its mounting. Nothing here depends
on ROS: messages are anything with their fields. All of it runs on one thread, that of the callbacks.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrslam.sim_driver.feeds.bag_contents import LaserMessage
from mrslam.sim_driver.feeds.tf_tree import rotation_matrix
from mrslam.sim_driver.ros.complaints import Complaints
from mrslam.sim_driver.ros.frames import BACKWARD_NS, LiveFrames, RecentMotion
from mrslam.sim_driver.ros.lasers import JoinedLasers
from mrslam.sim_driver.ros.options import RosOptions
from mrslam.spatial import InputError, Scan
from mrslam.spatial.errors import first_line
from mrslam.spatial.se2 import IDENTITY, Transform

MOUNTING_WAIT_S = 2.0
"""The first scans of a laser wait this long for its mounting, seconds: time for the discovery of tf_static."""
ODOMETRY_WAIT_S = 0.1
"""A scan waits this long for odometry newer than itself, seconds: two periods at 20 Hz, the slowest that is usual."""
ODOMETRY_ALIVE_NS = 1_000_000_000
"""Odometry older than this by its stamp is not waited for, nanoseconds."""
ODOMETRY_AGE_NS = 200_000_000
"""Odometry farther from a scan than this is not used for it, nanoseconds: at 1 m/s an error of 0.2 m."""
HELD = 400
"""Most scans that wait for their mounting: 2 s of five lasers at 40 Hz."""
QUIET_S = 5.0
"""Scans without odometry, or odometry without scans, for this long are worth a warning, seconds."""
JUMP_PAUSE_S = 30.0
"""Stamps that run backward within this of the last time are no jump of their own, seconds: each costs a session's
file, and those of two drivers on one topic whose clocks differ run backward with every other scan."""


@dataclass(frozen=True, eq=False)
class Arrival:
    """A scan that waits."""

    topic: str
    laser: LaserMessage
    arrived_s: float


@dataclass
class Arrivals:
    """What came so far; of odometry and transforms only what can be used."""

    scans: int = 0
    odometry: int = 0
    transforms: int = 0
    scan_s: float | None = None
    """When the newest scan came, by the monotonic clock."""
    odometry_s: float | None = None
    """When the newest odometry came that fits the robot's frames."""


class Inlet:
    """Takes messages; calls ``on_scan(scan, T_odom_base)`` for each scan, in the order they came.

    Of several lasers it is called at the scans of the first, with one sweep of all (:class:`JoinedLasers`).
    """

    def __init__(
        self,
        options: RosOptions,
        on_scan: Callable[[Scan, Transform | None], None],
        complaints: Complaints,
        begin_s: float,
        on_jump: Callable[[float], None] = lambda seconds: None,
    ) -> None:
        """Begin at ``begin_s`` of the monotonic clock; ``on_jump(seconds)`` hears of stamps that ran backward."""
        self.arrivals = Arrivals()
        self._options, self._on_scan, self._complaints, self._on_jump = options, on_scan, complaints, on_jump
        self._odom_frame, self._base_frame = options.frame(options.odom_frame), options.frame(options.base_frame)
        self._frames, self._wheels = LiveFrames(self._base_frame), RecentMotion()
        self._joined = JoinedLasers(options.scan_topics[0]) if len(options.scan_topics) > 1 else None
        self._held: deque[Arrival] = deque()
        self._mounted: dict[str, tuple[Transform, bool]] = {}
        self._awaited_s: dict[str, float] = {}  # by frame: when its first scan came
        self._newest_ns: dict[str, int] = {}
        self._beams: dict[str, int] = {}
        self._source: str | None = None
        self._begin_s = begin_s
        self._jumped_s: float | None = None

    # -- messages ------------------------------------------------------------------------------------------------------

    def take_scan(self, topic: str, message: Any, now_ns: int, now_s: float) -> None:
        """Take a LaserScan; ``now_ns`` is its stamp if it has none, ``now_s`` the monotonic clock."""
        self.arrivals.scans += 1
        self.arrivals.scan_s = now_s
        try:
            laser = LaserMessage.of(message, now_ns)
        except (ValueError, TypeError, AttributeError, OverflowError) as error:
            self._complaints.once("bad scan", f"{topic}: a scan that cannot be read is dropped: {first_line(error)}")
            return
        self._watch_stamps(topic, laser.stamp_ns, now_s)
        self._watch_beams(topic, laser.ranges_m)
        self._held.append(Arrival(topic, laser, now_s))
        if len(self._held) > HELD:
            self._hand_on(self._held.popleft(), now_s, is_last_call=True)
        self.pump(now_s)

    def take_odometry(self, message: Any, now_ns: int, now_s: float) -> None:
        """Take an Odometry message."""
        child = message.child_frame_id.lstrip("/")
        if child and child != self._base_frame:
            words = f"{self._options.odom_topic}: odometry is of {child!r}, the robot's base is {self._base_frame!r}"
            self._complaints.once("odometry frame", f"{words}; it is used as that of the base (parameter base_frame)")
        place, turn = message.pose.pose.position, rotation_matrix(message.pose.pose.orientation)
        pose = np.array([place.x, place.y, np.arctan2(turn[1, 0], turn[0, 0])])
        stamp = message.header.stamp
        if not self._wheels.add((stamp.sec * 1_000_000_000 + stamp.nanosec) or now_ns, pose):
            words = "poses that are not finite, or farther than any robot goes, are dropped"
            self._complaints.once("bad odometry", f"{self._options.odom_topic}: {words}")
            return
        self.arrivals.odometry += 1
        self.arrivals.odometry_s = now_s
        self.pump(now_s)

    def take_transforms(self, message: Any, is_static: bool, now_s: float) -> None:
        """Take a TFMessage."""
        for transform in message.transforms:
            if not self._frames.add(transform, is_static):
                which = f"{transform.header.frame_id!r} -> {transform.child_frame_id!r}"
                words = "transforms that are not finite, farther than any robot goes or without two frames are dropped"
                self._complaints.once("bad tf", f"tf {which}: {words}")
            elif not is_static and transform.header.frame_id.lstrip("/") == self._odom_frame:
                self.arrivals.transforms += 1
                self.arrivals.odometry_s = now_s
        self.pump(now_s)

    # -- scans ---------------------------------------------------------------------------------------------------------

    def pump(self, now_s: float) -> None:
        """Hand on every scan that has what it needs, or has waited long enough; to be called now and then."""
        while self._held and self._hand_on(self._held[0], now_s):
            self._held.popleft()

    def _hand_on(self, arrival: Arrival, now_s: float, is_last_call: bool = False) -> bool:
        """Hand one scan on and return True, or return False where it is to wait."""
        first_s = self._awaited_s.setdefault(arrival.laser.frame, arrival.arrived_s)
        mounted = self._mounting(arrival.laser.frame, np.inf if is_last_call else now_s - first_s)
        if mounted is None:
            return False
        found = self._odometry(arrival.laser.stamp_ns, np.inf if is_last_call else now_s - arrival.arrived_s)
        if isinstance(found, str):
            return False
        try:
            scan: Scan | None = arrival.laser.scan(*mounted)
        except InputError as error:
            self._complaints.once("bad scan", f"{arrival.topic}: scans that make no sense are dropped: {error}")
            return True
        if self._joined is not None and scan is not None:
            scan = self._joined.add(arrival.topic, scan, found)
        if scan is not None:
            self._on_scan(scan, found)
        return True

    def _mounting(self, frame: str, waited_s: float) -> tuple[Transform, bool] | None:
        """Return how a laser is mounted, and whether upside down; None where tf may yet say."""
        if frame in self._mounted:
            return self._mounted[frame]
        mounted = self._frames.mounting(self._base_frame, frame)
        if mounted is None and waited_s < MOUNTING_WAIT_S:
            return None
        if mounted is None:
            self._complaints.once(
                f"mounting {frame}",
                f"tf does not say how {frame!r} is mounted on {self._base_frame!r} (parameter base_frame): the laser "
                "is taken to sit on the robot's centre, facing forward, until it does",
            )
            return IDENTITY, False
        self._mounted[frame] = mounted
        return mounted

    def _odometry(self, stamp_ns: int, waited_s: float) -> Transform | str | None:
        """Return ``T_odom_base (3,)`` at a stamp, None where there is none near, "wait" where it may yet come."""
        found = {}
        if self._options.odometry in ("auto", "tf"):
            found["tf"] = self._frames.pose(self._odom_frame, self._base_frame, stamp_ns)
        if self._options.odometry in ("auto", "topic"):
            found["topic"] = self._wheels.at(stamp_ns)
        known = [(source, one) for source, one in found.items() if one is not None]
        if not known:
            return None
        alive = [one for one in known if abs(one[1][1]) < ODOMETRY_ALIVE_NS]
        source, (pose, beyond_ns) = (alive or known)[0]
        if 0 < beyond_ns < ODOMETRY_ALIVE_NS and waited_s < ODOMETRY_WAIT_S:
            return "wait"
        if abs(beyond_ns) > ODOMETRY_AGE_NS:
            self._complaints.once(
                "odometry age",
                f"odometry ({source}) is {abs(beyond_ns) / 1e9:.1f} s away from a scan's stamp, and not used for it: "
                "look at the clocks and the rate of both",
            )
            return None
        was, self._source = self._source, source
        return pose if was in (None, source) else None  # a step from one source, or time, to another means nothing

    # -- what is odd ---------------------------------------------------------------------------------------------------

    def _watch_stamps(self, topic: str, stamp_ns: int, now_s: float) -> None:
        newest_ns = self._newest_ns.get(topic, stamp_ns)
        self._newest_ns[topic] = stamp_ns
        if stamp_ns < newest_ns - BACKWARD_NS:
            back_s = (newest_ns - stamp_ns) / 1e9
            self._complaints.once(
                "clock",
                f"{topic}: stamps run backward by {back_s:.1f} s (a bag that loops?); the robot continues without that "
                "step of odometry",
            )
            self.pump(np.inf)
            self._source = "before the jump"
            before_s, self._jumped_s = self._jumped_s, now_s
            if before_s is None or now_s - before_s >= JUMP_PAUSE_S:
                self._on_jump(back_s)

    def _watch_beams(self, topic: str, ranges_m: Any) -> None:
        before = self._beams.setdefault(topic, ranges_m.size)
        if ranges_m.size != before:
            self._beams[topic] = ranges_m.size
            self._complaints.once("beams", f"{topic}: scans of {before} and of {ranges_m.size} beams; both are used")
        if not np.isfinite(ranges_m).any():
            self._complaints.once("no range", f"{topic}: a scan without any finite range; such scans map nothing")

    def watch_silence(self, now_s: float) -> None:
        """Complain of scans without odometry, and the other way round; to be called every second or so."""
        scans_s, wheels_s = self.arrivals.scan_s, self.arrivals.odometry_s
        if now_s - self._begin_s < QUIET_S:
            return
        topics = ", ".join(self._options.scan_topics)
        if wheels_s is not None and scans_s is None:
            self._complaints.once("no scans", f"odometry comes, but no scan on {topics}: nothing can be mapped")
        elif scans_s is not None and now_s - scans_s > QUIET_S:
            self._complaints.once("no scans", f"no scan on {topics} for {QUIET_S:g} s: nothing can be mapped")
        if scans_s is not None and wheels_s is None and self._options.odometry != "none":
            self._complaints.once(
                "no odometry",
                f"scans come, but no odometry, neither tf {self._odom_frame} -> {self._base_frame} nor "
                f"{self._options.odom_topic}: it is mapped by scans alone, and without tf map -> {self._odom_frame}",
            )
