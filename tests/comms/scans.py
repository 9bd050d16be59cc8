"""Made-up scans of keyframes."""

from __future__ import annotations

import numpy as np

from mrslam.spatial import KeyScans
from mrslam.spatial.key_scans import BEARINGS, POINTS_MOST, quantised_origins


def room_scans(keyframes: int, seed: int = 0, origin: tuple[float, float] = (0.1, 0.0)) -> KeyScans:
    """A rectangular room with noise, seen in front from places in it: what real scans look like."""
    rng = np.random.default_rng(seed)
    angles = np.radians(np.linspace(-90.0, 90.0, 55))
    scans = []
    for _ in range(keyframes):
        theta, x, y = rng.uniform(-np.pi, np.pi), rng.uniform(1.0, 9.0), rng.uniform(1.0, 5.0)
        c, s = np.cos(angles + theta), np.sin(angles + theta)
        reach = np.minimum(np.where(c > 0, 10.0 - x, -x) / c, np.where(s > 0, 6.0 - y, -y) / s)
        reach += rng.normal(0.0, 0.01, reach.size)
        scans.append(np.array(origin) + reach[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1))
    return KeyScans.of_points(scans, np.tile(origin, (keyframes, 1)))


def noise_scans(keyframes: int, seed: int = 0, most: int = POINTS_MOST) -> KeyScans:
    """Anything that is valid, at its extremes too: no points, one bearing for all, nearest and farthest."""
    rng = np.random.default_rng(seed)
    counts = rng.choice([0, 1, most, int(rng.integers(most + 1))], keyframes)
    polar = []
    for count in counts:
        bearings = rng.choice([0, BEARINGS - 1, int(rng.integers(BEARINGS))], count)
        spread = rng.integers(0, BEARINGS, count) if rng.random() < 0.7 else bearings
        ranges = np.where(rng.random(count) < 0.1, 65535, rng.integers(1, int(rng.choice([2, 500, 65536])), count))
        polar.append(np.stack([np.sort(spread), ranges], axis=-1))
    origins = rng.uniform(-30.0, 30.0, (keyframes, 2)) * (rng.random((keyframes, 1)) < 0.5)
    return KeyScans(
        np.concatenate([[0], np.cumsum(counts)]).astype(np.int32),
        np.concatenate([np.empty((0, 2)), *polar]).astype(np.uint16),
        quantised_origins(origins),
    )
