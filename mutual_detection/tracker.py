"""Where teammates are at the time of a scan, from what they said of themselves a moment ago."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mrslam.mutual_detection.config import MutualDetectionConfig
from mrslam.spatial.se2 import Transform

if TYPE_CHECKING:
    from filterpy.kalman import KalmanFilter

NS = 1_000_000_000
SPEED_SIGMA_M_S = 0.4
"""Spread of the speed that a newly heard teammate may have."""
PLACE = np.array([0, 2])
"""Indices of x and y in the state x, vx, y, vy."""


@dataclass
class _Track:
    filter: KalmanFilter
    stamp_ns: int


class TeammateTracker:
    """One constant-velocity Kalman filter a teammate, all in this robot's map frame (dissertation, section 3.6)."""

    def __init__(self, config: MutualDetectionConfig | None = None) -> None:
        """Start without teammates."""
        self._config = config or MutualDetectionConfig()
        self._tracks: dict[str, _Track] = {}

    def observe(self, robot_id: str, stamp_ns: int, xy_m: ArrayLike, covariance_m2: ArrayLike | None = None) -> None:
        """Take a reported place ``(2,)`` in my map frame; reports older than the last one, or not finite, are dropped.

        ``covariance_m2`` : ``(2, 2)`` of the place, as far as the transform between our maps is uncertain (see
        :func:`place_covariance`); adds to ``position_sigma_m``, which stands for the teammate's own error.
        """
        xy = np.array(xy_m, dtype=np.float64)
        noise = np.zeros((2, 2)) if covariance_m2 is None else np.array(covariance_m2, dtype=np.float64)
        if xy.shape != (2,) or noise.shape != (2, 2) or not (np.isfinite(xy).all() and np.isfinite(noise).all()):
            return
        noise = (noise + noise.T) / 2.0 + self._config.position_sigma_m**2 * np.eye(2)
        track = self._tracks.get(robot_id)
        if track is None or abs(stamp_ns - track.stamp_ns) > self._config.forget_after_s * NS:  # clocks are set, too
            self._tracks[robot_id] = _Track(_new_filter(xy, noise), stamp_ns)
            return
        if stamp_ns < track.stamp_ns:
            return
        dt_s = (stamp_ns - track.stamp_ns) / NS
        F, Q = _motion(dt_s, self._config.acceleration_m_s2)
        track.filter.predict(F=F, Q=Q)
        innovation = xy - track.filter.x[PLACE]
        spread = track.filter.P[np.ix_(PLACE, PLACE)] + noise
        if innovation @ np.linalg.solve(spread, innovation) > self._config.gate_sigmas**2:
            self._tracks[robot_id] = _Track(_new_filter(xy, noise), stamp_ns)
            return
        track.filter.update(xy, R=noise)
        track.stamp_ns = stamp_ns

    def forget(self, robot_id: str) -> None:
        """Drop a teammate: it left, or the transform to its map was revoked."""
        self._tracks.pop(robot_id, None)

    def predict(self, stamp_ns: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return centres ``(N, 2)`` in my map frame and radii ``(N,)``, metres, of teammates at a scan's time.

        In the order of their ids; those not heard of for ``forget_after_s`` are left out. Changes nothing.
        """
        centres, radii = [], []
        for robot_id in sorted(self._tracks):
            track = self._tracks[robot_id]
            age_ns = stamp_ns - track.stamp_ns
            if abs(age_ns) > self._config.forget_after_s * NS:
                continue
            place, sigma_m = _foresee(track.filter, age_ns / NS, self._config.acceleration_m_s2)
            radius = self._config.robot_radius_m + self._config.margin_m + self._config.sigmas * sigma_m
            centres.append(place)
            radii.append(min(radius, self._config.max_radius_m))
        return np.array(centres, dtype=np.float64).reshape(-1, 2), np.array(radii, dtype=np.float64)


def place_covariance(T_a_b: Transform, covariance: ArrayLike, xy_a_m: ArrayLike) -> NDArray[np.float64]:
    """Return the covariance ``(2, 2)``, m^2, of a place of map b at ``xy_a_m`` ``(2,)`` in map a.

    ``covariance`` : ``(3, 3)`` of ``T_a_b`` (m, m, rad). An error of the angle counts with its lever arm, the distance
    from the origin of b's frame.
    """
    lever_x, lever_y = np.asarray(xy_a_m, dtype=np.float64) - T_a_b[:2]
    J = np.array([[1.0, 0.0, -lever_y], [0.0, 1.0, lever_x]])
    return J @ np.asarray(covariance, dtype=np.float64) @ J.T


def _new_filter(xy: NDArray[np.float64], noise: NDArray[np.float64]) -> KalmanFilter:
    from filterpy.kalman import KalmanFilter  # half a second and 40 MB of scipy, which a robot alone need not spend

    kalman = KalmanFilter(dim_x=4, dim_z=2)
    kalman.x = np.array([xy[0], 0.0, xy[1], 0.0])
    kalman.P = np.diag([0.0, SPEED_SIGMA_M_S**2, 0.0, SPEED_SIGMA_M_S**2])
    kalman.P[np.ix_(PLACE, PLACE)] = noise
    kalman.H = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])
    return kalman


def _foresee(kalman: KalmanFilter, dt_s: float, acceleration_m_s2: float) -> tuple[tuple[float, float], float]:
    """Return place and largest standard deviation of it ``dt_s`` on: the filter's prediction of x and y alone.

    Plain numbers, for it runs at every scan.
    """
    x, vx, y, vy = kalman.x.tolist()
    P = kalman.P.tolist()
    noise = 0.25 * acceleration_m_s2**2 * dt_s**4
    xx = P[0][0] + 2.0 * dt_s * P[0][1] + dt_s**2 * P[1][1] + noise
    yy = P[2][2] + 2.0 * dt_s * P[2][3] + dt_s**2 * P[3][3] + noise
    xy = P[0][2] + dt_s * (P[0][3] + P[1][2]) + dt_s**2 * P[1][3]
    largest = 0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy)
    return (x + dt_s * vx, y + dt_s * vy), math.sqrt(max(largest, 0.0))


def _motion(dt_s: float, acceleration_m_s2: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the transition and its noise over ``dt_s`` (negative: looking back) under white acceleration."""
    dt, white = abs(dt_s), acceleration_m_s2**2
    xx, xv, vv = white * (dt**4 / 4), white * (dt**3 / 2), white * dt**2
    F = np.array([[1.0, dt_s, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, dt_s], [0.0, 0.0, 0.0, 1.0]])
    Q = np.array([[xx, xv, 0.0, 0.0], [xv, vv, 0.0, 0.0], [0.0, 0.0, xx, xv], [0.0, 0.0, xv, vv]])
    return F, Q
