"""Search over a lattice of poses."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.spatial.matching.correlative import Lattice, search
from mrslam.spatial.runtime.crew import Crew
from tests.rbpf.rooms import seen_room


def test_search_finds_what_descent_cannot() -> None:
    store, points = seen_room()
    found = search(store.tiles(0), points, np.array([0.3, -0.2, 0.3]), Lattice(0.4, 0.02, 0.4, 0.1, 90))
    assert found.score > 0.5 * 90
    assert np.hypot(found.pose[0], found.pose[1]) < 0.15 and abs(found.pose[2]) < 0.04


@pytest.mark.parametrize("share", [1.0, 0.5, 0.0])
def test_a_search_shared_by_two_threads_finds_the_same_pose(share: float) -> None:
    store, points = seen_room()
    points = points[: int(share * len(points))]  # of no points at all every pose is worth the same
    for k in range(8):
        centre = np.array([0.1 * k - 0.3, 0.2 - 0.1 * k, 0.1 * k])
        lattice = Lattice(0.05 * k, 0.02, 0.3, 0.1, 60)
        alone = search(store.tiles(0), points, centre, lattice)
        shared = search(store.tiles(0), points, centre, lattice, Crew(2))
        assert alone.score == shared.score and np.array_equal(alone.pose, shared.pose)
