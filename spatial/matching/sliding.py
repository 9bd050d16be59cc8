"""How sure a match is along a corridor, and whether the scans fit better farther along it.

Gauss-Newton finds the nearest minimum. Along a corridor it is drawn there by a few beams, on door posts and recesses,
or by none at all, while the long walls fit wherever the scans are put. So they are slid along it, over all that may
have drifted, and every place is weighed by what it explains.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial.hits.views import Tiles
from mrslam.spatial.matching.gauss_newton import CORRIDOR, Match, match
from mrslam.spatial.se2 import Transform

STEP_M = 0.1
"""Distance of the places tried, metres: Gauss-Newton converges from half of it."""
ITERATIONS = 8
"""Most steps of Gauss-Newton from the best of them."""
EVIDENCE_BEAMS = 10.0
"""Number of independent beams that scans weigh as, as in the filter's weights (``rbpf.evidence_beams``)."""


class Drift(NamedTuple):
    """Where a match is expected, and how far off that may be."""

    expected: Transform
    """``(3,)``, pose in the map's frame."""
    sigma_m: float
    """Standard deviation of its position, metres."""
    information: NDArray[np.float64]
    """``(3, 3)``, inverse covariance of the pose."""
    half_m: float
    """Nothing is farther off, metres."""


def slid(
    tiles: Tiles, points: NDArray[np.float64], found: Match, drift: Drift, scale_m: float
) -> tuple[Match, NDArray[np.float64]]:
    """Return a match of ``points (N, 5)`` as it fits best along its corridor, and what it says about that, ``(3, 3)``.

    Places along it are weighed by ``exp(EVIDENCE_BEAMS * score)``; the most likely one by these weights and by what may
    have drifted is taken. What the weights alone say of it is the inverse of their variance: 0 where the best is the
    last one tried, and little where many fit. What Gauss-Newton found along the corridor is left out. Outside of
    corridors a match is returned unchanged, with zeros. ``scale_m`` : of the distances between beams' ends and walls.
    """
    values, axes = np.linalg.eigh(found.information[:2, :2])
    if not values[0] < CORRIDOR * values[1]:
        return found, np.zeros((3, 3))
    along = np.array([axes[0, 0], axes[1, 0], 0.0])
    last = round(drift.half_m / STEP_M)
    places_m = STEP_M * np.arange(-last, last + 1)
    poses = found.pose + np.outer(places_m, along)
    tried = [match(tiles, points, at, at, drift.information, scale_m, 0) for at in poses]
    log_weights = EVIDENCE_BEAMS * np.array([place.score for place in tried])
    expected_m = float((drift.expected - found.pose) @ along)
    best = int(np.argmax(log_weights - 0.5 * ((places_m - expected_m) / drift.sigma_m) ** 2))
    if best != last:
        start = tried[best].pose
        found = match(tiles, points, start, start, drift.information, scale_m, ITERATIONS)
    across = np.eye(3) - np.outer(along, along)
    found = found._replace(information=across @ found.information @ across)
    return found, _sharpness(log_weights, places_m - places_m[best]) * np.outer(along, along)


def _sharpness(log_weights: NDArray[np.float64], off_m: NDArray[np.float64]) -> float:
    """Return the inverse of the mean of ``off_m (n,)`` squared, by the weights; 0 where an end weighs most, 1/m^2."""
    if int(np.argmax(log_weights)) in (0, log_weights.size - 1):
        return 0.0
    weights = np.exp(log_weights - log_weights.max())
    return 1.0 / (float(weights @ off_m**2 / weights.sum()) + STEP_M**2 / 12.0)
