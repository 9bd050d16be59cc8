"""How far the pose can be believed."""

from __future__ import annotations

import math

import numpy as np

from mrslam.rbpf.front_end.motion import BLIND_M, WAY, Agreement, Keyframe

MEMORY = 0.2
"""Share of a new keyframe in the health."""
BAD_FIT, FIT_RANGE = 0.3, 0.5
"""Share of beams that fit the map at which health is nil, and how much more makes it full."""
SEEN_LEAST = 0.2
"""Where less than this share of beams falls on what the map knows, the local map is asked."""
DOUBTFUL = 0.45
"""Health of a robot that may be elsewhere though all it sees fits: below the half that is doubt, and not lost yet."""
ADRIFT_MOST = 0.5
"""Where motion of late was guessed by more than this share, the robot may be elsewhere."""
UNSEEN_M, UNSEEN_SHARE = 1.0, 0.05
"""Way covered unseen, metres and share of all, beyond which it may be."""


class Health:
    """Follows how well the best particle's map foretells the scans, and how much way was covered unseen."""

    def __init__(self) -> None:
        self._fit = 1.0
        self._unseen_m, self._way_m = 0.0, 0.0  # since the last place that was seen again

    @property
    def value(self) -> float:
        """0..1."""
        adrift = self._unseen_m > max(UNSEEN_M, UNSEEN_SHARE * self._way_m)
        return min(self._fit, DOUBTFUL) if adrift else self._fit

    def follow(self, agreement: Agreement, key: Keyframe) -> None:
        """Take a keyframe into account, and how far the best particle's map agrees with it."""
        seen = agreement.inliers + agreement.conflicts
        fits = agreement.inliers / seen if seen > SEEN_LEAST else key.inliers
        fit = float(np.clip((fits - BAD_FIT) / FIT_RANGE, 0.0, 1.0))
        way_m, unseen_m = float(key.arrival[WAY]), math.hypot(*key.arrival[BLIND_M])
        self._fit += MEMORY * (fit * (1.0 - min(2.0 * unseen_m / max(way_m, 1e-9), 1.0)) - self._fit)
        self._unseen_m += unseen_m
        self._way_m += way_m

    def anchor(self) -> None:
        """Forget what was not seen: the robot is back at a place it knows."""
        self._unseen_m = self._way_m = 0.0

    def state(self) -> list[float]:
        """Return everything that a resumed health needs."""
        return [self._fit, self._unseen_m, self._way_m]

    def restore(self, state: list[float]) -> None:
        """Go on from what :meth:`state` returned."""
        self._fit, self._unseen_m, self._way_m = state
