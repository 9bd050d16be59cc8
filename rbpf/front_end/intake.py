"""From what a robot's drivers deliver to what can be matched: usable scans as points, odometry as motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.front_end.front_end import FrontEnd
from mrslam.rbpf.front_end.scan_gate import ScanGate
from mrslam.rbpf.front_end.sight import Sight
from mrslam.spatial import Scan
from mrslam.spatial.hits.views import Beams
from mrslam.spatial.poses import between
from mrslam.spatial.se2 import Transform


@dataclass(frozen=True, kw_only=True, eq=False)
class Reading:
    """One scan and the motion to it; its arrays are overwritten by the next."""

    scan: Scan
    points: NDArray[np.float64]
    """``(N, 5)``, all usable returns, base frame."""
    sample: NDArray[np.float64]
    """``(n, 5)``, those to match; empty where the scan is of no use."""
    T_before_odom: Transform | None
    """``(3,)``, ``T_before_base`` by odometry since the newest scan that was used; None where there is no odometry."""
    elapsed_s: float
    """Seconds since that scan; 0 at the first."""
    reason: str | None
    """Why the scan is refused; None where it is used."""

    @property
    def dropped_beams(self) -> int:
        """Number of beams that are no usable return."""
        return self.scan.ranges_m.size - self.points.shape[0]


class Intake:
    """Turns scans and odometry into readings; bad data is refused with a reason, never raised."""

    def __init__(self, config: MapperConfig, front: FrontEnd) -> None:
        self._use_odometry = config.use_odometry
        self._front = front
        self._gate = ScanGate()
        self._sight = Sight(config)
        self._stamp_ns: int | None = None  # of the newest scan that was used
        self._T_odom_base: Transform | None = None  # at that scan

    def take(self, scan: Scan, T_odom_base: Transform | None) -> Reading:
        """Return a scan as points, with the motion that odometry ``(3,)``, if there is some, says led to it."""
        T_odom_base = self._valid(T_odom_base)
        T_before_odom = None
        if T_odom_base is not None and self._T_odom_base is not None:
            T_before_odom = between(self._T_odom_base, T_odom_base)
        points = self._sight.points(scan)
        reason = self._gate.refuse(scan, points, T_odom_base, lambda: self._is_known(scan, points, T_before_odom))
        elapsed_s, sample = 0.0, points[:0]
        if reason is None:
            elapsed_s = 0.0 if self._stamp_ns is None else (scan.stamp_ns - self._stamp_ns) / 1e9
            self._stamp_ns, self._T_odom_base = scan.stamp_ns, T_odom_base
            if scan.beam_interval_s > 0.0:
                self._sight.straighten(points, scan, self._front.predictor.speed(T_before_odom, elapsed_s))
            sample = self._sight.sample(points, scan.T_base_laser)
        return Reading(
            scan=scan, points=points, sample=sample, T_before_odom=T_before_odom, elapsed_s=elapsed_s, reason=reason
        )

    def beams(self, reading: Reading) -> Beams:
        """Return a copy of the newest reading's scan as it is drawn into maps."""
        origin = reading.scan.T_base_laser[:2].copy()
        return Beams(origin, reading.points.copy(), self._sight.clearing_ends(reading.scan))

    def _is_known(self, scan: Scan, points: NDArray[np.float64], T_before_odom: Transform | None) -> bool:
        """Return whether a scan fits what was seen before."""
        return self._front.knows(self._sight.sample(points, scan.T_base_laser), T_before_odom)

    def _valid(self, T_odom_base: Transform | None) -> Transform | None:
        """Return a pose by odometry, if it makes sense and is wanted."""
        if T_odom_base is None or not self._use_odometry:
            return None
        now = np.array(T_odom_base, dtype=np.float64)
        return now if now.shape == (3,) and np.isfinite(now).all() else None

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed intake needs."""
        return {"gate": self._gate.state(), "stamp_ns": self._stamp_ns, "T_odom_base": self._T_odom_base}

    def restore(self, state: dict[str, Any]) -> None:
        """Become the intake that was saved."""
        self._gate.restore(state["gate"])
        self._stamp_ns, self._T_odom_base = state["stamp_ns"], state["T_odom_base"]
