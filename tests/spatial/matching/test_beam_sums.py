"""What beams say about a pose, one beam at a time, against numeric derivatives."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.spatial import se2
from mrslam.spatial.hits.store import TileStore
from mrslam.spatial.matching.beam_sums import CONFLICT_COST, POINT_WEIGHT, UNKNOWN_COST, Sums, Weighting, sum_beams

F64 = NDArray[np.float64]

RES = 0.05
HIT = np.array([1.525, 0.725])
"""Where the map's only surface is: the middle of a cell."""
WEIGHTING = Weighting(4, 0.1**2, 1.0 / 0.03**2, False, 0.0, 0.0)
POSE = np.array([0.2, -0.1, 0.3])


def point(place: F64, normal_rad: float | None) -> F64:
    """Return one point ``(1, 5)``; without a direction it has no normal."""
    if normal_rad is None:
        return np.array([[*place, 1.0, 0.0, 0.0]])
    return np.array([[*place, math.cos(normal_rad), math.sin(normal_rad), 1.0]])


def surface(normal_rad: float | None) -> TileStore:
    """Return a map of one hit."""
    store = TileStore(1, RES)
    store.cover(np.array([-3.0, -3.0]), np.array([5.0, 5.0]))
    store.add_points(0, np.zeros(3), point(HIT, normal_rad))
    return store


def sums(store: TileStore, off: F64, normal_rad: float | None, weighting: Weighting = WEIGHTING) -> Sums:
    """Return the sums of a beam that ends ``off`` the surface, with a normal in the map's frame, seen from POSE."""
    seen = se2.apply(se2.inverse(POSE), HIT + off)
    beam = point(seen, None if normal_rad is None else normal_rad - POSE[2])
    return sum_beams(store.tiles(0), beam, *POSE, weighting)


def equations(found: Sums) -> tuple[F64, F64]:
    H = np.array([[found.xx, found.xy, found.xt], [0.0, found.yy, found.yt], [0.0, 0.0, found.tt]])
    return H + np.triu(H, 1).T, np.array([found.bx, found.by, found.bt])


def end_by_pose(off: F64) -> F64:
    """Return the derivative ``(2, 3)`` of the beam's end by the pose, by differences."""
    seen, step = se2.apply(se2.inverse(POSE), HIT + off), 1e-6 * np.eye(3)
    return np.stack([(se2.apply(POSE + d, seen) - se2.apply(POSE - d, seen)) / 2e-6 for d in step], axis=1)


def believed(r2: float) -> float:
    """Geman and McClure's weight."""
    return (WEIGHTING.scale2 / (WEIGHTING.scale2 + r2)) ** 2 * WEIGHTING.weight


OFF = np.array([0.04, -0.02])


@pytest.mark.parametrize(("of_map", "of_beam", "mean"), [(0.5, 0.7, 0.6), (0.5, None, 0.5), (None, 0.7, 0.7)])
def test_a_beam_holds_the_pose_across_the_wall_whose_normal_is_the_mean_of_both(of_map, of_beam, mean) -> None:
    found = sums(surface(of_map), OFF, of_beam)
    m = np.array([math.cos(mean), math.sin(mean)])
    J, r = m @ end_by_pose(OFF), float(m @ -OFF)
    H, b = equations(found)
    scale = np.abs(H).max()
    np.testing.assert_allclose(H, believed(r * r) * np.outer(J, J), atol=0.03 * scale)
    np.testing.assert_allclose(b, believed(r * r) * J * r, atol=0.04 * np.abs(b).max())
    assert found.score == pytest.approx(-0.5 * r * r * WEIGHTING.weight, rel=0.1) and found.inliers == 1.0


def test_without_any_normal_it_holds_the_pose_in_both_directions_less_surely() -> None:
    found = sums(surface(None), OFF, None)
    J, w = end_by_pose(OFF), POINT_WEIGHT * believed(float(OFF @ OFF))
    H, b = equations(found)
    np.testing.assert_allclose(H, w * J.T @ J, atol=0.02 * np.abs(H).max())
    np.testing.assert_allclose(b, w * J.T @ -OFF, atol=0.03 * np.abs(b).max())
    assert found.score == pytest.approx(-0.5 * OFF @ OFF * WEIGHTING.weight, rel=0.1)


def test_a_surface_farther_than_three_cells_is_not_the_one_that_was_hit() -> None:
    store = surface(0.0)
    near, far = (sums(store, np.array([0.0, cells * RES]), 0.0) for cells in (2.9, 3.3))
    assert near.xx > 0.0 and far.xx == 0.0
    assert far.score == -UNKNOWN_COST and far.conflicts == 0.0


def test_a_beam_that_ends_on_known_floor_contradicts_and_costs_more_than_in_the_unknown() -> None:
    store = surface(0.0)
    store.draw(0, np.zeros((1, 2)), np.zeros((1, 3)), [point(np.array([1.0, 0.0]), math.pi)], 0.1)
    on_floor, in_unknown = (
        sum_beams(store.tiles(0), point(np.array(place), 0.0), 0.0, 0.0, 0.0, WEIGHTING)
        for place in ((0.5, 0.0), (0.5, -2.0))
    )
    assert (on_floor.conflicts, on_floor.score) == (1.0, -CONFLICT_COST)
    assert (in_unknown.conflicts, in_unknown.score) == (0.0, -UNKNOWN_COST)
    assert on_floor.xx == in_unknown.xx == on_floor.inliers == 0.0


def test_no_beam_costs_more_than_a_contradiction() -> None:
    found = sums(surface(0.0), np.array([0.14, 0.0]), 0.0)
    assert found.xx > 0.0 and found.score == -CONFLICT_COST and found.inliers == 0.0


def test_along_a_wall_a_beam_costs_nothing_within_a_cell_and_a_little_beyond() -> None:
    store = surface(0.0)
    scores = [sums(store, np.array([0.0, cells * RES]), 0.0).score for cells in (0.9, 2.0)]
    assert scores[0] == pytest.approx(0.0, abs=1e-3)
    assert scores[1] == pytest.approx(-0.5 * 0.1 * (3.0 * RES**2) * WEIGHTING.weight, rel=0.1)


@pytest.mark.parametrize(("slant", "is_wall_of_it"), [(0.2, True), (0.4, False)])
def test_in_a_corridor_slanted_normals_of_its_walls_hold_nothing_along_it(slant: float, is_wall_of_it: bool) -> None:
    corridor = WEIGHTING._replace(corridor=True, along_x=1.0, along_y=0.0)
    normal = math.pi / 2 - math.asin(slant)
    found = sums(surface(normal), OFF, normal, corridor)
    assert (found.xx < 1e-9 * found.yy) is is_wall_of_it and found.yy > 0.0
    assert sums(surface(normal), OFF, normal).xx > 0.01 * found.yy
