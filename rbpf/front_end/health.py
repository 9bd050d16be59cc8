"""Health of a pose, 0..1: below 0.5 it is doubtful."""

from __future__ import annotations

import math

import numpy as np

from mrslam.rbpf.front_end.motion import BLIND_M, WAY, Agreement, Keyframe

MEMORY = 0.2
"""Share of a new keyframe in the health: doubt takes about five keyframes, 3 m."""
BAD_FIT, FIT_RANGE = 0.3, 0.5
"""Health is 0 where a share ``BAD_FIT`` of the beams on known cells fits, and 1 where ``FIT_RANGE`` more do."""
SEEN_LEAST = 0.2
"""Where a smaller share of beams falls on cells that the map knows, the fit to the rolling map is taken instead."""
DOUBTFUL = 0.45
"""Health of a robot that may be elsewhere though its scans fit: just below 0.5, where doubt begins."""
LOST = 0.2
"""Health of a robot that was carried off and does not know where to, or whose map contradicts its wheels after a pause,
or does not show where they led: its pose is wrong, not just doubtful, or nobody knows."""
ADRIFT_MOST = 0.5
"""Where ``FrontEnd.adrift`` is larger than this, the robot may be elsewhere."""
UNSEEN_M, UNSEEN_SHARE = 1.0, 0.05
"""The robot may be elsewhere, too, where the error of motion that was not seen adds up to more than this since the last
loop edge: metres, and share of the way."""


class Health:
    """Follows how well scans fit the best particle's map, and how far off way that was covered unseen may be."""

    def __init__(self) -> None:
        self._fit = 1.0
        self.usual_fit = 1.0
        """0..1: of the beams on known cells the share that fitted the best particle's map of late."""
        self._unseen_m, self._way_m = 0.0, 0.0  # since the last loop edge
        self.is_lost = False
        """Whether the robot was carried, or led by its wheels alone, and was not found in its map since."""

    @property
    def value(self) -> float:
        """0..1."""
        most = LOST if self.is_lost else DOUBTFUL if self.is_adrift else 1.0
        return min(self._fit, most)

    @property
    def is_adrift(self) -> bool:
        """Whether too much of the way since the last loop edge was not seen."""
        return self._unseen_m > max(UNSEEN_M, UNSEEN_SHARE * self._way_m)

    def follow(self, agreement: Agreement, key: Keyframe) -> None:
        """Take a keyframe, and how far the best particle's map agrees with it, into account."""
        self.is_lost |= key.is_apart
        seen = agreement.inliers + agreement.conflicts
        fits = agreement.inliers / seen if seen > SEEN_LEAST else key.inliers
        if seen > SEEN_LEAST:
            self.usual_fit += MEMORY * (fits - self.usual_fit)
        fit = float(np.clip((fits - BAD_FIT) / FIT_RANGE, 0.0, 1.0))
        way_m, unseen_m = float(key.arrival[WAY]), math.hypot(*key.arrival[BLIND_M])
        self._fit += MEMORY * (fit * (1.0 - min(2.0 * unseen_m / max(way_m, 1e-9), 1.0)) - self._fit)
        self._unseen_m += unseen_m
        self._way_m += way_m

    def anchor(self) -> None:
        """Forget way covered unseen: the robot is back at a place it knows."""
        self._unseen_m = self._way_m = 0.0
        self.is_lost = False

    def state(self) -> list[float]:
        """Return everything that a resumed health needs."""
        return [self._fit, self._unseen_m, self._way_m, float(self.is_lost), self.usual_fit]

    def restore(self, state: list[float]) -> None:
        """Continue from what :meth:`state` returned."""
        self._fit, self._unseen_m, self._way_m = state[:3]
        self.is_lost, self.usual_fit = bool(state[3]), state[4]
