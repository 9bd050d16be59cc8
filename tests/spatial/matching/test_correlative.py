"""Search over a lattice of poses."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from mrslam.spatial import se2
from mrslam.spatial.hits.views import Tiles
from mrslam.spatial.matching.correlative import FAR_COST, Lattice, search
from mrslam.spatial.matching.nearest import nearest
from mrslam.spatial.runtime.crew import Crew
from tests.rbpf.rooms import drawn, seen_room

RESOLUTION_M = 0.05


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


def score_of_every_pose(
    tiles: Tiles, points: np.ndarray, centre: np.ndarray, lattice: Lattice
) -> dict[tuple[int, int, int], float]:
    """Score by turn, and shift along x and y, in steps of the lattice."""
    turns = round(lattice.half_turn_rad / lattice.turn_step_rad)
    shifts = round(lattice.half_shift_m / lattice.shift_step_m)
    used = points[:: max(1, len(points) // lattice.points_most)]
    scores = {}
    every = range(-shifts, shifts + 1)
    for a, i, j in itertools.product(range(-turns, turns + 1), every, every):
        turned = np.array([0.0, 0.0, centre[2] + a * lattice.turn_step_rad])
        at = np.array([*(centre[:2] + lattice.shift_step_m * np.array([i, j])), turned[2]])
        places = se2.apply(at, used[:, :2]) / RESOLUTION_M
        normals = se2.apply(turned, used[:, 2:4])
        surfaces = [
            nearest(tiles, *place, *normal, q, 1) for place, normal, q in zip(places, normals, used[:, 4], strict=True)
        ]
        score = sum(1.0 / (1.0 + surface.distance2) for surface in surfaces if surface.word)
        far = abs(a) / (turns + 1.0) + (abs(i) + abs(j)) / (shifts + 1.0)
        scores[a, i, j] = score - FAR_COST * len(used) * far
    return scores


@pytest.mark.parametrize("heading", [0.0, 2.0])
@pytest.mark.parametrize("corner", [(-2, 2, -2), (2, -2, 1), (1, 0, 2), (0, 0, 0)])
def test_the_best_is_that_of_a_slow_twin_out_to_the_lattices_corners(
    corner: tuple[int, int, int], heading: float
) -> None:
    _, points = seen_room()
    points = points[: len(points) // 7 * 7 + 1]  # the last one counts: every 7th is used
    store = drawn(points, np.array([0.0, 0.0, heading]))
    elsewhere = points.copy()  # the first of them fit near the middle, where the search begins
    elsewhere[: int(0.45 * len(points)), :2] += 0.15
    lattice = Lattice(0.1001, 0.05, 0.2, 0.1, len(points) // 7)
    centre = np.array([0.01, -0.02, heading + 0.01]) - (0.1 * corner[1], 0.1 * corner[2], 0.05 * corner[0])
    for seen in (points, elsewhere):
        scores = score_of_every_pose(store.tiles(0), seen, centre, lattice)
        a, i, j = max(scores, key=lambda at: scores[at])
        assert (a, i, j) == corner  # which is where the scan was taken
        found = search(store.tiles(0), seen, centre, lattice)
        assert found.score == pytest.approx(scores[a, i, j])
        assert found.pose == pytest.approx(centre + np.array([0.1 * i, 0.1 * j, 0.05 * a]))


def test_where_nothing_is_seen_the_scan_stays_where_it_is_expected() -> None:
    store, points = seen_room()
    centre = np.array([200.0, 100.0, 0.5])
    found = search(store.tiles(0), points, centre, Lattice(0.1, 0.05, 0.2, 0.1, 60))
    assert np.array_equal(found.pose, centre) and found.score == 0.0
