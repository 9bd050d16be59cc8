"""Wall points, normals and labels against slow twins."""

from __future__ import annotations

import math
from collections import Counter

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


def facing_twin(state: np.ndarray, r: int, c: int) -> tuple[int, np.ndarray]:
    """Return how many sides of a surface cell are free, and an axis of its normal, from the window about it."""
    at = np.array([(dc, dr) for dr in range(-3, 4) for dc in range(-3, 4) if dr * dr + dc * dc <= 10], dtype=np.float64)
    seen = np.array([state[r + int(dr), c + int(dc)] for dc, dr in at])
    free, walls = at[seen == wall_kernels.FREE].sum(axis=0), at[seen == wall_kernels.OCCUPIED]
    if np.hypot(*free) > wall_kernels.ONE_SIDED:
        return 1, free / np.hypot(*free)
    spread, axes = np.linalg.eigh(np.cov(walls.T, bias=True).reshape(2, 2) * len(walls))
    is_wall = spread[1] - spread[0] >= wall_kernels.STRAIGHT * spread.sum()
    if len(walls) < wall_kernels.MIN_STRAIGHT_CELLS or not is_wall:
        return 1, np.zeros(2)
    return 2, axes[:, 0]


def test_which_sides_of_a_wall_are_free_like_its_twin():
    rng, kinds = np.random.default_rng(2), Counter()
    for _ in range(600):
        state = np.full((7, 7), wall_kernels.FREE, dtype=np.uint8)
        state[rng.random((7, 7)) < rng.uniform(0.0, 0.5)] = wall_kernels.UNKNOWN
        slope, wide = rng.uniform(-1.2, 1.2), rng.uniform(0.5, 2.0)
        rows, cols = np.indices((7, 7)) - 3
        line = (np.abs(rows - slope * cols) < wide) & (np.abs(cols) <= rng.integers(0, 4))
        state[line & (rng.random((7, 7)) < 0.9)] = wall_kernels.OCCUPIED
        state[3, 3] = wall_kernels.OCCUPIED
        sides, nx, ny = wall_kernels.facing(state, 3, 3)
        expected, normal = facing_twin(state, 3, 3)
        along = abs(float(np.dot(normal, (nx, ny)))) if sides == 2 else float(np.dot(normal, (nx, ny)))
        assert sides == expected and (along > 1.0 - 1e-9 or not (normal.any() or nx or ny))
        kinds[sides, bool(normal.any())] += 1
    assert min(kinds[kind] for kind in ((1, True), (1, False), (2, True))) >= 40


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
