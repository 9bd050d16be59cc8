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
