"""A scan as the mapper uses it: points to draw into maps, a sample of them to match, beams that only clear."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.spatial import Scan, se2
from mrslam.spatial.matching.scan_points import POINT_COLUMNS, scan_points, spaced
from mrslam.spatial.se2 import Transform

SPACING_M = 0.02
"""Least distance across the beams between two points that are matched, metres: nearer ones say the same."""

SLACK_RAD = 1e-3
"""Rounding may put the first beam's bearing this far before its own direction, radians."""


class Sight:
    """Turns one scan after the other into points; what it returns is overwritten by the next."""

    def __init__(self, config: MapperConfig) -> None:
        self.usable_range_m = config.usable_range_m
        self.clear_range_m = min(config.clear_range_m, config.usable_range_m)
        self._points_most = config.beams_match
        self._geometry: tuple[object, ...] = ()

    def points(self, scan: Scan) -> NDArray[np.float64]:
        """Return the usable returns ``(N, 5)``, as ``mrslam.spatial.matching.scan_points`` writes them."""
        geometry = (scan.ranges_m.size, scan.angle_min_rad, scan.angle_increment_rad)
        if geometry != self._geometry:
            self._geometry = geometry
            angles = scan.angles_rad
            self._cos, self._sin = np.cos(angles), np.sin(angles)
            self._points = np.zeros((angles.size, POINT_COLUMNS))
            self._sample = np.zeros((angles.size, POINT_COLUMNS))
        count = scan_points(scan.ranges_m, self._cos, self._sin, scan.T_base_laser, self.usable_range_m, self._points)
        return self._points[:count]

    def straighten(self, points: NDArray[np.float64], scan: Scan, velocity: Transform) -> None:
        """Undo the robot's motion during the sweep (deskewing): put each point where the first beam would have seen it.

        ``velocity (3,)`` in the base frame, m/s and rad/s. Left as they are, the walls to one side lie a little farther
        on than those to the other, and the way through them bends.
        """
        if scan.angle_increment_rad == 0.0 or not velocity.any():
            return
        x, y, nx, ny = points[:, :4].T
        bearing = np.arctan2(y - scan.T_base_laser[1], x - scan.T_base_laser[0]) - scan.T_base_laser[2]
        turned = np.mod((bearing - scan.angle_min_rad) * np.sign(scan.angle_increment_rad) + SLACK_RAD, 2.0 * np.pi)
        after_s = (turned - SLACK_RAD) / abs(scan.angle_increment_rad) * scan.beam_interval_s
        c, s = np.cos(velocity[2] * after_s), np.sin(velocity[2] * after_s)
        points[:, 0], points[:, 1] = c * x - s * y + velocity[0] * after_s, s * x + c * y + velocity[1] * after_s
        points[:, 2], points[:, 3] = c * nx - s * ny, s * nx + c * ny

    def sample(self, points: NDArray[np.float64], T_base_laser: Transform) -> NDArray[np.float64]:
        """Return those of a scan's ``points (N, 5)`` that it is matched by, ``(n, 5)``, spaced across the beams."""
        if len(self._sample) < len(points):  # of several scans
            self._sample = np.zeros_like(points)
        return self._sample[: spaced(points, T_base_laser, SPACING_M, self._points_most, self._sample)]

    def clearing_ends(self, scan: Scan) -> NDArray[np.float64]:
        """Return ``(M, 2)`` where beams without a return end, in the base frame, if they are to clear the map.

        Nothing is known of what lies beyond the laser's range.
        """
        if self.clear_range_m <= 0.0:
            return np.empty((0, 2))
        none = np.isinf(scan.ranges_m)
        ends = min(self.clear_range_m, scan.range_max_m) * np.stack([self._cos[none], self._sin[none]], axis=-1)
        return se2.apply(scan.T_base_laser, ends)
