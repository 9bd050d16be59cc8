"""Where a robot's own way came back to."""

import numpy as np

from mrslam.merge.joint.trail import NEAR_M, OLD_WAY_M, SEEN_AGAIN_EVERY_M, Trail
from mrslam.spatial import KeyScans


def slow_twin(trail: Trail) -> list[tuple[int, int]]:
    found, last_m = [], -np.inf
    for j in range(len(trail)):
        old = int(np.searchsorted(trail.way_m, trail.way_m[j] - OLD_WAY_M))
        if old == 0 or trail.way_m[j] - last_m < SEEN_AGAIN_EVERY_M:
            continue
        away = np.hypot(*(trail.T_map_key[:old, :2] - trail.T_map_key[j, :2]).T)
        if away.min() < NEAR_M:
            found.append((int(np.argmin(away)), j))
            last_m = trail.way_m[j]
    return found


def test_places_seen_again_are_those_of_the_slow_twin() -> None:
    rng = np.random.default_rng(3)
    for count in (0, 1, 40, 400):
        steps = rng.normal(0.0, 0.4, (count, 2)) + 0.3 * np.sin(np.arange(count) / 15.0)[:, None]
        trail = Trail(np.column_stack([steps.cumsum(axis=0), np.zeros(count)]), KeyScans.empty())
        again = [pair for pair in zip(trail.edges.first, trail.edges.second, strict=True) if pair[1] != pair[0] + 1]
        assert again == slow_twin(trail)
    assert len(again) > 20
