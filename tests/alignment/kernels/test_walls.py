"""Wall points, normals and labels against slow twins."""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse.csgraph import connected_components

from mrslam.alignment.kernels import walls as wall_kernels
from mrslam.alignment.prepared import prepare
from mrslam.spatial import OccupancyGrid


def test_normals_point_to_the_free_side():
    state = np.zeros((40, 40), dtype=np.uint8)
    state[10:30, 10:30] = wall_kernels.FREE
    state[10:30, 10] = wall_kernels.OCCUPIED
    state[30, 10:30] = wall_kernels.OCCUPIED
    cells, normals = wall_kernels.wall_points(state)
    left = (cells[:, 1] == 10) & (cells[:, 0] > 13) & (cells[:, 0] < 25)
    np.testing.assert_allclose(normals[left], np.tile([1.0, 0.0], (left.sum(), 1)), atol=1e-6)
    top = (cells[:, 0] == 30) & (cells[:, 1] > 15) & (cells[:, 1] < 25)
    np.testing.assert_allclose(normals[top], np.tile([0.0, -1.0], (top.sum(), 1)), atol=1e-6)


def test_thin_wall_seen_from_both_sides_has_two_normals():
    state = np.zeros((40, 40), dtype=np.uint8)
    state[5:35, 5:35] = wall_kernels.FREE
    state[5:35, 20] = wall_kernels.OCCUPIED
    cells, normals = wall_kernels.wall_points(state)
    at = normals[(cells[:, 0] == 20) & (cells[:, 1] == 20)]
    assert sorted(np.round(at[:, 0]).tolist()) == [-1.0, 1.0]


def test_specks_are_told_from_walls_and_from_dotted_walls():
    cells = np.zeros((80, 80), dtype=np.int8)
    cells[10, 10:70] = 100
    cells[40, 10:70:2] = 100
    cells[60:63, 30:33] = 100
    side = prepare(OccupancyGrid(cells, 0.05), 0.05)
    rows = np.round((side.points[:, 1] - 0.025) / 0.05).astype(int)
    assert side.solid[rows == 10].all() and side.solid[rows == 40].all()
    assert not side.solid[rows >= 60].any() and (rows >= 60).any()


def test_nearest_labels_like_its_twin():
    rng = np.random.default_rng(1)
    cells = rng.integers(0, 30, (40, 2)).astype(np.int32)
    angles = rng.uniform(-math.pi, math.pi, 40)
    normals = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    normals[:3] = 0.0
    label = wall_kernels.nearest_labels(30, 30, cells, normals, 6)
    facing = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    for q in range(4):
        member = (normals @ facing[q] > 0.42) | (normals == 0).all(axis=1)
        for r in range(30):
            for c in range(30):
                d2 = np.where(member, ((cells - (r, c)) ** 2).sum(axis=1), 10_000)
                expected = d2.min() if d2.min() <= 36 else None
                got = label[q, r, c]
                assert (None if got == wall_kernels.NOTHING else d2[got]) == expected


def test_extents_like_their_twin():
    occupied = np.random.default_rng(3).random((60, 70)) < 0.03
    occupied[[0, 59], 5:30:3] = True
    rows, cols = np.nonzero(occupied)
    chosen = np.flatnonzero(np.random.default_rng(4).random(len(rows)) < 0.5)
    got = wall_kernels.extents(rows, cols, 3, np.stack([rows, cols], axis=-1)[chosen].astype(np.int32))
    near = (abs(rows[:, None] - rows) <= 3) & (abs(cols[:, None] - cols) <= 3)
    label = connected_components(near)[1]
    things = [label == label[k] for k in chosen]
    expected = [max(np.ptp(rows[thing]), np.ptp(cols[thing])) + 1 for thing in things]
    assert got.tolist() == expected and len(set(expected)) > 5
