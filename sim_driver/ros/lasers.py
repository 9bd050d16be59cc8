"""Several lasers as one: their newest scans as one sweep round the robot's centre.

Keyframes are single scans: of lasers that sent by turns a map would show what one of them happened to see there.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import Scan, se2
from mrslam.spatial.se2 import Transform

FRESH_NS = 500_000_000
"""Scans of other lasers older than this are not used, and a first laser that is silent for longer is not waited for,
nanoseconds: two periods of a 5 Hz laser, the slowest that is usual."""
FINER = 2.0
"""Beams of the sweep per beam of the finest laser: a point's direction is rounded to a quarter of that laser's step."""
MOST_BEAMS = 7200
"""Most beams of the sweep: one every 0.05 degrees."""


class JoinedLasers:
    """Keeps the newest scan of every laser; the first laser sets the pace."""

    def __init__(self, first: str) -> None:
        """``first`` : topic of the laser whose stamps the sweeps have."""
        self._first = first
        self._newest: dict[str, tuple[Scan, Transform | None]] = {}

    def add(self, topic: str, scan: Scan, T_odom_base: Transform | None) -> Scan | None:
        """Take a scan with the odometry ``(3,)`` of its moment; return a sweep of all lasers where one is due.

        It has the stamp of this scan; the others' are moved by odometry to where the robot is now.
        """
        self._newest[topic] = scan, T_odom_base
        leader = self._newest.get(self._first)
        if topic != self._first and leader is not None and abs(scan.stamp_ns - leader[0].stamp_ns) <= FRESH_NS:
            return None
        fresh = [one for one in self._newest.values() if abs(one[0].stamp_ns - scan.stamp_ns) <= FRESH_NS]
        return sweep(scan, [(one, _moved(T_odom_base, T_then)) for one, T_then in fresh])


def _moved(T_odom_now: Transform | None, T_odom_then: Transform | None) -> Transform:
    """Return ``T_now_then (3,)``; no motion where odometry does not say."""
    return se2.IDENTITY if T_odom_now is None or T_odom_then is None else se2.between(T_odom_now, T_odom_then)


def sweep(newest: Scan, scans: list[tuple[Scan, Transform]]) -> Scan:
    """Return scans, each with ``T_now_base (3,)`` of its moment, as one from the base's centre.

    The nearest return of a direction wins. Directions that no laser looks into are dropped beams.
    """
    step_rad = min(abs(scan.angle_increment_rad) for scan, _ in scans) / FINER
    beams = min(math.ceil(2.0 * math.pi / max(step_rad, 1e-6)), MOST_BEAMS)
    step_rad = 2.0 * math.pi / beams
    ranges_m = np.full(beams, np.nan, dtype=np.float32)
    reach_m = max(scan.range_max_m + float(np.hypot(*scan.T_base_laser[:2])) for scan, _ in scans)
    for scan, T_now_base in scans:
        nothing_rad = (T_now_base[2] + scan.T_base_laser[2]) + scan.angles_rad[np.isinf(scan.ranges_m)]
        free = _bins(nothing_rad, step_rad, beams)
        ranges_m[free[np.isnan(ranges_m[free])]] = np.inf
    for scan, T_now_base in scans:
        points = se2.apply(T_now_base, scan.points_base())
        at = _bins(np.arctan2(points[:, 1], points[:, 0]), step_rad, beams)
        np.fmin.at(ranges_m, at, np.hypot(points[:, 0], points[:, 1]).astype(np.float32))
    return Scan(
        stamp_ns=newest.stamp_ns,
        ranges_m=ranges_m,
        angle_min_rad=-math.pi + step_rad / 2.0,
        angle_increment_rad=step_rad,
        range_max_m=reach_m,
    )


def _bins(angles_rad: NDArray[np.float64], step_rad: float, beams: int) -> NDArray[np.int64]:
    """Return the beams nearest to directions ``(N,)``."""
    return np.floor((angles_rad + math.pi) / step_rad).astype(np.int64) % beams
