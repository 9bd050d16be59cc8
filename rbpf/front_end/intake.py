"""From what a robot's drivers deliver to what can be matched: usable scans as points, odometry as motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.front_end.front_end import FrontEnd
from mrslam.rbpf.front_end.gathering import Gathering
from mrslam.rbpf.front_end.leaps import Steps
from mrslam.rbpf.front_end.odometry import has_been_set_back
from mrslam.rbpf.front_end.scan_gate import PART_LEAST, POINTS_LEAST, ScanGate, too_few
from mrslam.rbpf.front_end.sight import Sight
from mrslam.spatial import Scan
from mrslam.spatial.hits.views import Beams
from mrslam.spatial.poses import between
from mrslam.spatial.se2 import Transform


@dataclass(frozen=True, kw_only=True, eq=False)
class Reading:
    """One scan and the motion to it; its arrays are overwritten by the next."""

    scan: Scan
    returns: int
    """Number of its beams that are usable returns."""
    points: NDArray[np.float64]
    """``(N, 5)``, all usable returns, base frame; of several scans where they are matched together."""
    sample: NDArray[np.float64]
    """``(n, 5)``, those to match; empty where the scan is of no use."""
    odom_motion: Transform | None
    """``(3,)``, ``T_before_base`` by odometry since the newest scan that was used; None where there is no odometry.
    Leaps of odometry at scans that were refused are left out."""
    elapsed_s: float
    """Seconds since that scan; 0 at the first."""
    reason: str | None
    """Why the scan is refused; None where it is used."""
    waits: bool = False
    """Whether the scan shows too little alone, and is matched together with the next ones."""
    shown: Transform | None = None
    """``(3,)``, motion to where the robot's whole map surely shows the scan after a pause; None where it does not."""
    is_contradicted: bool = False
    """Whether it shows something else there, and nothing like the scan near by, at the second scan after a pause."""
    is_unconfirmed: bool = False
    """Whether nothing but the wheels says how it came here: the map contradicts them, or does not show it."""
    is_set_back: bool = False
    """Whether odometry began again at its origin, far from where it was: its driver was restarted."""
    is_carried: bool = False
    """Whether nobody knows how the robot came here."""

    @property
    def dropped_beams(self) -> int:
        """Number of beams that are no usable return."""
        return self.scan.ranges_m.size - self.returns


class Intake:
    """Turns scans and odometry into readings; bad data is refused with a reason, never raised."""

    def __init__(self, config: MapperConfig, front: FrontEnd) -> None:
        self._use_odometry = config.use_odometry
        self._front = front
        self._gate = ScanGate()
        self._sight = Sight(config)
        self._gathering = Gathering()
        self._stamp_ns: int | None = None  # of the newest scan that was used
        self._T_odom_base: Transform | None = None  # at that scan; moved by what odometry has leapt since
        self._steps = Steps()
        self._was_refused = False
        self._before: tuple[int | None, Transform | None] = (None, None)  # both, of the scan used before it
        self._has_put_back = False  # since the last scan that was matched

    def take(self, scan: Scan, T_odom_base: Transform | None) -> Reading:
        """Return a scan as points, with the motion that odometry ``(3,)``, if there is some, says led to it."""
        T_odom_base = self._valid(T_odom_base)
        self._steps.take(scan.stamp_ns, T_odom_base)
        if self._was_refused:
            self._leave_out_leap()
        odom_motion, is_set_back = None, False
        if T_odom_base is not None and self._T_odom_base is not None:
            odom_motion = between(self._T_odom_base, T_odom_base)
            is_set_back = has_been_set_back(self._T_odom_base, T_odom_base)
        points = self._sight.points(scan)
        returns = points.shape[0]
        self._gathering.count(returns)
        least = PART_LEAST if self._gathers(T_odom_base) else POINTS_LEAST
        reason = self._gate.refuse(
            scan, points, T_odom_base, least, lambda: self._is_known(scan, points, odom_motion)
        )  # fmt: skip
        elapsed_s = 0.0 if self._stamp_ns is None else (scan.stamp_ns - self._stamp_ns) / 1e9
        sample, waits = points[:0], False
        if reason is None and T_odom_base is not None and self._gathers(T_odom_base):
            self._gathering.add(T_odom_base, points)
            waits = self._stamp_ns is not None and not self._gathering.is_enough
            if not waits:
                reason = too_few(self._gathering.returns, POINTS_LEAST)
            if reason is None and not waits:
                points = self._gathering.take(scan.T_base_laser[:2], self._front.predictor.odometry.corrected)
        else:
            self._gathering.drop()
        if reason is None and not waits:
            self._before = (self._stamp_ns, self._T_odom_base)
            self._stamp_ns, self._T_odom_base = scan.stamp_ns, T_odom_base
            if scan.beam_interval_s > 0.0:
                self._sight.straighten(points, scan, self._front.predictor.speed(odom_motion, elapsed_s))
            sample = self._sight.sample(points, scan.T_base_laser)
        if reason is not None and not self._was_refused:
            self._leave_out_leap()
        self._was_refused = reason is not None
        return Reading(
            scan=scan, returns=returns, points=points, sample=sample, odom_motion=odom_motion, elapsed_s=elapsed_s,
            reason=reason, waits=waits, is_set_back=is_set_back,
        )  # fmt: skip

    def _leave_out_leap(self) -> None:
        """Leave out what odometry has leapt at the newest scan: one of the last two is refused, so no match tells."""
        if self._T_odom_base is not None:
            self._T_odom_base = self._steps.without_leap(self._T_odom_base)

    def put_back(self) -> bool:
        """Leave the newest scan out, once: the motion to the next is told from the one used before.

        Return whether it was; of two in a row the second is used.
        """
        if self._has_put_back:
            return False
        self._stamp_ns, self._T_odom_base = self._before
        self._has_put_back = True
        return True

    def _gathers(self, T_odom_base: Transform | None) -> bool:
        """Return whether scans are matched several at a time: they are sparse, and odometry says how they follow."""
        return self._gathering.is_sparse and T_odom_base is not None

    @property
    def is_sparse(self) -> bool:
        """Whether scans show too little each, and are matched several at a time."""
        return self._gathering.is_sparse

    @property
    def T_odom_base(self) -> Transform | None:
        """``(3,)``, odometry at the newest scan that was used; None where there was none."""
        return self._T_odom_base

    def matched(self, reading: Reading, T_local_base: Transform) -> None:
        """Remember where a reading was matched, ``(3,)`` in the rolling map: sparse ones make one keyframe."""
        self._has_put_back = False
        if self._gathering.is_sparse:
            self._gathering.remember(T_local_base, reading.points)

    def beams(self, reading: Reading) -> Beams:
        """Return a copy of the newest reading's scan as it is drawn into maps."""
        origin = reading.scan.T_base_laser[:2].copy()
        points = reading.points.copy()
        if self._gathering.is_sparse:
            points = self._gathering.of_key(self._front.T_local_base, origin)
        return Beams(origin, points, self._sight.clearing_ends(reading.scan))

    def _is_known(self, scan: Scan, points: NDArray[np.float64], odom_motion: Transform | None) -> bool:
        """Return whether a scan fits what was seen before."""
        return self._front.knows(self._sight.sample(points, scan.T_base_laser), odom_motion)

    def _valid(self, T_odom_base: Transform | None) -> Transform | None:
        """Return a pose by odometry, if it makes sense and is wanted."""
        if T_odom_base is None or not self._use_odometry:
            return None
        now = np.array(T_odom_base, dtype=np.float64)
        return now if now.shape == (3,) and np.isfinite(now).all() else None

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed intake needs."""
        return {
            "gate": self._gate.state(),
            "gathering": self._gathering.state(),
            "stamp_ns": self._stamp_ns,
            "T_odom_base": self._T_odom_base,
            "has_put_back": self._has_put_back,
            "steps": self._steps.state(),
            "was_refused": self._was_refused,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Become the intake that was saved."""
        self._gate.restore(state["gate"])
        self._gathering.restore(state["gathering"])
        self._stamp_ns, self._T_odom_base = state["stamp_ns"], state["T_odom_base"]
        self._has_put_back = state["has_put_back"]
        self._steps.restore(state["steps"])
        self._was_refused = state["was_refused"]
