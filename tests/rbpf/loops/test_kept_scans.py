"""Which scans are kept to compare places with, and how those of one way are put together."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.rbpf.loops.kept_scans import KEPT_MOST, KEPT_WITHIN_M, KEPT_WITHIN_RAD, KeptScans
from mrslam.spatial import se2
from mrslam.spatial.hits.views import NO_ENDS, Beams


def wall(T_map_base: np.ndarray) -> Beams:
    """Return how a wall along y = 2 m that faces -y looks from a pose."""
    points = np.stack([np.linspace(-2.0, 2.0, 9), np.full(9, 2.0)], axis=1)
    seen = se2.apply(se2.inverse(T_map_base), points)
    normals = se2.apply(np.array([0.0, 0.0, -T_map_base[2]]), np.tile([0.0, -1.0], (9, 1)))
    return Beams(np.zeros(2), np.ascontiguousarray(np.column_stack([seen, normals, np.ones(9)])), NO_ENDS)


def kept(poses: np.ndarray, carried: tuple[int, ...] = ()) -> KeptScans:
    scans = KeptScans()
    for k, pose in enumerate(poses):
        scans.add(wall(pose), 0.5, is_apart=k in carried)
        scans.forget(poses[: k + 1])
    return scans


def test_of_many_scans_of_one_place_the_newest_are_kept() -> None:
    here = np.zeros((KEPT_MOST + 3, 3))
    assert list(kept(here).points) == list(range(3, KEPT_MOST + 3))


@pytest.mark.parametrize("away", [(KEPT_WITHIN_M + 0.01, 0.0, 0.0), (0.0, 0.0, KEPT_WITHIN_RAD + 0.01)])
def test_scans_of_other_places_and_other_headings_are_kept_however_often_one_comes_by(away: tuple[float, ...]) -> None:
    there = np.tile(away, (3, 1))
    scans = kept(np.concatenate([there, np.zeros((KEPT_MOST + 2, 3))]))
    assert list(scans.points) == [0, 1, 2, *range(5, KEPT_MOST + 5)]


def test_scans_of_a_way_that_are_put_together_lie_on_the_walls_that_they_saw() -> None:
    poses = np.array([[0.0, 0.0, 0.0], [0.6, 0.3, 1.0], [1.0, 0.5, -2.0]])
    scans = kept(poses)
    together = scans.joined(poses, range(3), 1)
    assert together.shape[0] > 20
    in_map = se2.apply(poses[1], together[:, :2])
    assert in_map[:, 1] == pytest.approx(2.0, abs=1e-4)
    normals = se2.apply(np.array([0.0, 0.0, poses[1, 2]]), together[:, 2:4])
    assert normals == pytest.approx(np.tile([0.0, -1.0], (len(normals), 1)), abs=1e-4)


def test_keyframes_before_and_after_the_robot_was_carried_are_of_different_ways() -> None:
    scans = kept(np.arange(30.0).reshape(10, 3), carried=(4, 7))
    assert [scans.connected(0, 10, key) for key in (0, 3, 4, 6, 7, 9)] == [
        range(0, 4), range(0, 4), range(4, 7), range(4, 7), range(7, 10), range(7, 10)
    ]  # fmt: skip
    assert scans.connected(5, 9, 6) == range(5, 7) and scans.connected(5, 9, 8) == range(7, 9)
    assert scans.newest_start == 7 and scans.way_m.tolist() == [0.5 * k for k in range(1, 11)]
