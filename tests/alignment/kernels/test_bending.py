from __future__ import annotations

import numpy as np
import pytest

from mrslam.alignment.kernels.bending import add_walls, bent_state, partners, shifts_at
from mrslam.alignment.kernels.walls import WallMap, nearest_labels

LATTICE = (3, 4, -1.0, 2.0, 2.0)
"""Rows, columns, first node's x and y, spacing."""


def naive_share(at: np.ndarray) -> np.ndarray:
    """Return ``(N, rows * cols)``: what each node counts at each place."""
    rows, cols, x0, y0, spacing = LATTICE
    x, y = np.arange(cols) * spacing + x0, np.arange(rows) * spacing + y0
    wx = np.clip(1 - np.abs(at[:, :1] - x) / spacing, 0, None)
    wy = np.clip(1 - np.abs(at[:, 1:] - y) / spacing, 0, None)
    return (wy[:, :, None] * wx[:, None, :]).reshape(len(at), -1)


def some_places(n: int) -> np.ndarray:
    return np.random.default_rng(3).uniform((-1.0, 2.0), (4.99, 5.99), (n, 2))


def test_shifts_are_bilinear_between_the_nodes() -> None:
    nodes = np.random.default_rng(1).normal(size=(3, 4, 2))
    at = some_places(50)
    found = shifts_at(at, nodes, *LATTICE[2:])
    np.testing.assert_allclose(found, naive_share(at) @ nodes.reshape(-1, 2), atol=1e-9)


def test_shifts_outside_are_those_of_the_nearest_edge() -> None:
    nodes = np.random.default_rng(1).normal(size=(3, 4, 2))
    found = shifts_at(np.array([[-50.0, -50.0], [50.0, 50.0]]), nodes, *LATTICE[2:])
    np.testing.assert_allclose(found, [nodes[0, 0], nodes[-1, -1]], atol=1e-4)


def test_walls_give_the_equations_of_weighted_least_squares() -> None:
    rng = np.random.default_rng(5)
    at, normals, residuals = some_places(40), rng.normal(size=(40, 2)), rng.normal(0.0, 0.2, 40)
    H, g = np.zeros((24, 24)), np.zeros(24)
    add_walls(at, normals, residuals, LATTICE, 7.0, 0.3, H, g)
    J = np.einsum("nm,nk->nmk", naive_share(at), normals).reshape(40, 24)
    w = 7.0 * (0.3**2 / (0.3**2 + residuals**2)) ** 2
    np.testing.assert_allclose(H, J.T @ (w[:, None] * J), atol=1e-9)
    np.testing.assert_allclose(g, J.T @ (w * residuals), atol=1e-9)


def test_a_map_that_is_shifted_as_a_whole_keeps_its_cells() -> None:
    state = np.random.default_rng(2).integers(0, 3, (30, 40)).astype(np.uint8)
    nodes = np.tile([0.5, -0.25], (3, 4, 1))
    drawn = bent_state(state, 1.0, 2.0, 0.05, (nodes, 0.0, 0.0, 1.0), (30, 40, 1.5, 1.75), 4)
    np.testing.assert_array_equal(drawn, state)


def test_a_thin_wall_stays_whole_where_the_map_is_stretched() -> None:
    state = np.full((40, 40), 1, dtype=np.uint8)
    state[:, 20] = 2
    nodes = np.zeros((2, 2, 2))
    nodes[:, 1, 0] = -0.2  # pressed together along x by a tenth: walls may fall between two samples
    drawn = bent_state(state, 0.0, 0.0, 0.05, (nodes, 0.0, 0.0, 2.0), (40, 40, 0.0, 0.0), 4)
    assert (drawn == 2).any(axis=1).all()


@pytest.mark.parametrize("column", range(10, 30))
def test_no_wall_falls_between_two_samples(column: int) -> None:
    state = np.full((40, 40), 1, dtype=np.uint8)
    state[:, column] = 2
    nodes = np.zeros((2, 2, 2))
    nodes[:, 1, 0] = -0.2
    drawn = bent_state(state, 0.0, 0.0, 0.05, (nodes, 0.0, 0.0, 2.0), (40, 40, 0.0, 0.0), 4)
    assert (drawn == 2).any(axis=1).all()


def test_floor_is_drawn_where_the_bend_takes_it() -> None:
    state = np.full((40, 40), 1, dtype=np.uint8)
    state[:, :20] = 0
    nodes = np.zeros((2, 2, 2))
    nodes[:, 1, 0] = -0.8  # pressed together by two fifths: what was at 1 m is at 0.6 m
    drawn = bent_state(state, 0.0, 0.0, 0.05, (nodes, 0.0, 0.0, 2.0), (40, 40, 0.0, 0.0), 12)
    assert np.flatnonzero(drawn[20] == 1)[0] == 12


def test_partners_are_near_and_face_as_the_points_do() -> None:
    cells = np.array([[20, 20], [20, 30]], dtype=np.int32)
    normals = np.array([[0.0, 1.0], [0.6, 0.8]])
    label = nearest_labels(41, 41, cells, normals, 6)
    state = np.ones((41, 41), dtype=np.uint8)
    points = (cells[:, ::-1] + 0.5) * 0.1
    target = WallMap(state, label, points, normals, np.ones(2, dtype=bool), 0.0, 0.0, 0.1)
    cases = [
        ((2.05, 2.25), (0.0, 1.0), 0),
        ((2.05, 2.25), (0.0, -1.0), -1),  # another side of the wall
        ((2.05, 2.25), (0.0, 0.0), -1),  # a speck
        ((2.05, 2.45), (0.0, 1.0), -1),  # too far away
        ((3.05, 2.15), (0.6, 0.8), 1),
        ((3.05, 2.15), (-0.6, 0.8), -1),  # in one quadrant with the wall, but facing otherwise
        ((3.15, -0.5), (0.0, 1.0), -1),  # outside of the map
    ]
    at, facing, expected = (np.array(column) for column in zip(*cases, strict=True))
    found = np.empty(len(cases), dtype=np.int64)
    assert partners(at, facing, target, 0.3, found) == 2
    assert found.tolist() == expected.tolist()
