"""Distinct straight walls."""

from __future__ import annotations

import numpy as np

from mrslam.alignment.verification import structure


def test_distinct_walls_of_a_rectangle_and_of_a_corner():
    t = np.linspace(0.0, 4.0, 81)
    sides = [(np.stack([t, 0 * t], -1), (0, 1)), (np.stack([t, 0 * t + 3], -1), (0, -1))]
    sides += [(np.stack([0 * t, t], -1), (1, 0)), (np.stack([0 * t + 5, t], -1), (-1, 0))]
    points = np.concatenate([p for p, _ in sides])
    normals = np.concatenate([np.tile(np.array(n, dtype=float), (81, 1)) for _, n in sides])
    assert structure.distinct_walls(points, normals, 10, 0.3, 20).tolist() == [81] * 4
    corner = np.concatenate([points[:81], points[162:243]]), np.concatenate([normals[:81], normals[162:243]])
    assert len(structure.distinct_walls(*corner, 10, 0.3, 20)) == 2
    assert len(structure.distinct_walls(points[:0], normals[:0], 10, 0.3, 20)) == 0


def wall(y: float, count: int = 81) -> np.ndarray:
    """Return a wall along x."""
    return np.stack([np.linspace(0.0, 4.0, count), np.full(count, y)], axis=-1)


def facing(count: int, normal: tuple[float, float]) -> np.ndarray:
    return np.tile(np.array(normal), (count, 1))


def test_walls_that_face_one_way_are_as_many_as_they_are_apart():
    normals = facing(162, (0.0, 1.0))
    for gap_m, sizes in ((2.0, [81, 81]), (0.1, [162])):
        points = np.concatenate([wall(0.0), wall(gap_m)])
        assert structure.distinct_walls(points, normals, 10, 0.3, 20).tolist() == sizes


def test_specks_are_part_of_no_wall():
    points, normals = wall(0.0)[:, ::-1].copy(), facing(81, (0.0, 0.0))
    assert structure.distinct_walls(points, normals, 10, 0.3, 20).tolist() == []
    points, normals = np.concatenate([points, wall(0.0)]), np.concatenate([normals, facing(81, (0.0, 1.0))])
    assert structure.distinct_walls(points, normals, 10, 0.3, 20).tolist() == [81]
