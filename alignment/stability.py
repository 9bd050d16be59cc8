"""The stability check: which transform of a pair is believed, as new estimates come in (Martins 2013, section 3.7)."""

from __future__ import annotations

from dataclasses import dataclass, field

from mrslam.alignment.result import Alignment
from mrslam.spatial.errors import require
from mrslam.spatial.se2 import Transform, wrap_one


@dataclass
class StabilityCheck:
    """Believes a transform once two estimates in a row agree; replaces it only on better evidence.

    ``max_dx_m``, ``max_dy_m`` (m) and ``max_dtheta_rad`` (rad) say how far two estimates of one transform may differ.
    """

    max_dx_m: float = 0.5
    max_dy_m: float = 0.5
    max_dtheta_rad: float = 0.1
    believed: Alignment | None = field(default=None, init=False)
    """The transform to use; None while none is valid."""
    previous: Alignment | None = field(default=None, init=False)
    """The last estimate that came in."""

    def __post_init__(self) -> None:
        for name in ("max_dx_m", "max_dy_m", "max_dtheta_rad"):
            require(getattr(self, name) > 0, f"stability.{name}", "> 0", getattr(self, name))

    def agrees(self, one: Alignment, other: Alignment) -> bool:
        """Return whether the two are estimates of one transform."""
        return self.is_near(one.T_a_b, other.T_a_b)

    def is_near(self, T_1: Transform, T_2: Transform) -> bool:
        """Return whether two transforms ``(3,)`` differ by less than the limits."""
        (x_1, y_1, theta_1), (x_2, y_2, theta_2) = T_1.tolist(), T_2.tolist()  # asked for all pairs at every tick
        is_here = abs(x_1 - x_2) < self.max_dx_m and abs(y_1 - y_2) < self.max_dy_m
        return is_here and abs(wrap_one(theta_1 - theta_2)) < self.max_dtheta_rad

    def update(self, estimate: Alignment) -> Alignment | None:
        """Take in one more estimate; return the believed transform, or None.

        An estimate is valid when it agrees with the one before it. A valid one replaces the believed transform only
        where its confidence is at least as high: never a better by a worse.
        """
        valid = self.previous is not None and self.agrees(estimate, self.previous)
        self.previous = estimate
        if valid and (self.believed is None or estimate.confidence >= self.believed.confidence):
            self.believed = estimate
        return self.believed

    def contradicted(self) -> None:
        """Forget the believed transform and what led to it: later evidence (a loop, a third robot) shows it wrong."""
        self.believed = None
        self.previous = None


SAME_PLACE = StabilityCheck()
"""Two transforms that differ by less are one place: two estimates of where a map lies may, and what robots see of one
of them they see of the other."""
CORRECTED = StabilityCheck(max_dx_m=2.0, max_dy_m=2.0, max_dtheta_rad=0.4)
"""Two transforms that differ by less are one place, corrected; by more, two places. Four times the limits within which
two estimates confirm each other: bent maps move by that much when they are corrected."""
