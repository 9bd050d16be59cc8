"""How far the pose can be believed."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbpf.matching import CONFLICTS, INLIERS
from rbpf.motion import BLIND_M, WAY, Keyframe

MEMORY = 0.2
"""Share of a new keyframe in the health."""
BAD_FIT, FIT_RANGE = 0.3, 0.5
"""Share of beams that fit the map at which health is nil, and how much more makes it full."""
SEEN_LEAST = 0.2
"""Where less than this share of beams falls on what the map knows, the local map is asked."""


def health_after(health: float, result: NDArray[np.float64], key: Keyframe) -> float:
    """Return the health ``0..1`` after a keyframe.

    It follows how well the best particle's map foretells the scans (``result``: the matcher's row), and how much way
    was covered unseen.
    """
    seen = result[INLIERS] + result[CONFLICTS]
    fits = result[INLIERS] / seen if seen > SEEN_LEAST else key.inliers
    fit = float(np.clip((fits - BAD_FIT) / FIT_RANGE, 0.0, 1.0))
    lost = math.hypot(*key.arrival[BLIND_M]) / max(float(key.arrival[WAY]), 1e-9)
    return health + MEMORY * (fit * (1.0 - min(2.0 * lost, 1.0)) - health)
