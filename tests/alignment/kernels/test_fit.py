"""Walls laid on walls: normal equations against numeric derivatives, and what each step may do."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.alignment.kernels import fit
from mrslam.alignment.kernels.walls import NOTHING, WallMap, nearest_labels
from mrslam.alignment.prepared import PreparedMap
from mrslam.spatial import se2

F64 = NDArray[np.float64]

RES, REACH_CELLS = 0.05, 12
ALONG_X, ALONG_Y = np.array([0.0, 1.0]), np.array([1.0, 0.0])
"""Normals of walls along x and along y."""


def wall_map(*walls: tuple[F64, F64]) -> WallMap:
    """Return a map of 10 m x 10 m about the origin with these points ``(n, 2)`` and the normal of each wall."""
    points = np.concatenate([wall for wall, _ in walls])
    normals = np.concatenate([np.tile(normal, (len(wall), 1)) for wall, normal in walls])
    cells = np.floor((points[:, ::-1] + 5.0) / RES).astype(np.int32)
    label = nearest_labels(200, 200, cells, normals, REACH_CELLS)
    state = np.ones((200, 200), dtype=np.uint8)
    return WallMap(state, label, points, normals, np.ones(len(points), dtype=np.bool_), -5.0, -5.0, RES)


def line(x0: float, y0: float, x1: float, y1: float, points: int = 60) -> F64:
    return np.linspace([x0, y0], [x1, y1], points)


def equations(source: WallMap, target: WallMap, T: F64, reach_m: float = 0.6, scale_m: float = 0.2):
    H, g = np.zeros((3, 3)), np.zeros(3)
    used, cost = fit.normal_equations(source, target, T, 1, reach_m, scale_m, np.zeros(2), True, H, g)
    return H, g, used, cost


def moved(T_a_b: F64, pivot: F64, step: F64) -> F64:
    """Return a transform after a shift and a turn about ``pivot``, in frame a."""
    about = se2.transform(*pivot, 0.0)
    return se2.compose(se2.compose(se2.compose(about, step), se2.inverse(about)), T_a_b)


def twin(a: WallMap, b: WallMap, T_a_b: F64, pivot: F64, reach_m: float, scale_m: float, source_is_b: bool):
    """Return H's upper triangle, g, points used and cost, derivatives by differences."""
    source, target = (b, a) if source_is_b else (a, b)
    H, g, used, cost = np.zeros((3, 3)), np.zeros(3), 0, 0.0

    def placed(step: F64) -> F64:
        T = moved(T_a_b, pivot, step)
        return T if source_is_b else se2.inverse(T)

    T = placed(np.zeros(3))
    nudged = [(placed(1e-6 * np.eye(3)[k]), placed(-1e-6 * np.eye(3)[k])) for k in range(3)]
    quadrants = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    for p, n in zip(source.points, source.normals, strict=True):
        if not n.any():
            continue
        at, facing = se2.apply(T, p), se2.apply(np.array([0.0, 0.0, T[2]]), n)
        c, r = np.floor((at - (target.x0, target.y0)) / target.res).astype(int)
        if not (0 <= r < target.state.shape[0] and 0 <= c < target.state.shape[1]):
            continue
        j = target.label[int(np.argmax(quadrants @ facing)), r, c]
        if j == NOTHING:
            continue
        q, m = target.points[j], target.normals[j]
        if np.hypot(*(at - q)) > reach_m or m @ facing < 0.8:
            continue
        residual = m @ (at - q)
        J = np.array([m @ (se2.apply(up, p) - se2.apply(down, p)) / 2e-6 for up, down in nudged])
        weight = (scale_m**2 / (scale_m**2 + residual**2)) ** 2
        H, g = H + weight * np.outer(J, J), g + weight * J * residual
        used, cost = used + 1, cost + residual**2 / (scale_m**2 + residual**2)
    return np.triu(H), g, used, cost


@pytest.mark.parametrize("source_is_b", [True, False])
def test_normal_equations_like_numeric_derivatives(
    sides: tuple[PreparedMap, PreparedMap], pair: tuple, source_is_b: bool
) -> None:
    a, b = sides[0].wall_map, sides[1].wall_map
    T_a_b, pivot = se2.compose(pair[2], np.array([0.12, -0.07, 0.01])), np.array([3.0, -1.0])
    source, target, T = (b, a, T_a_b) if source_is_b else (a, b, se2.inverse(T_a_b))
    H, g = np.zeros((3, 3)), np.zeros(3)
    used, cost = fit.normal_equations(source, target, T, 1, 0.3, 0.1, pivot, source_is_b, H, g)
    expected = twin(a, b, T_a_b, pivot, 0.3, 0.1, source_is_b)
    assert used > 500 and abs(used - expected[2]) <= 2  # normals midway between two quadrants may fall either way
    np.testing.assert_allclose(H, expected[0], rtol=5e-3, atol=1e-3 * np.abs(H).max())
    np.testing.assert_allclose(g, expected[1], rtol=2e-2, atol=1e-3 * np.abs(g).max())
    assert cost == pytest.approx(expected[3], rel=5e-3)


def test_what_is_too_far_faces_elsewhere_or_has_no_direction_takes_no_part() -> None:
    target = wall_map((line(-2, 0, 2, 0), ALONG_X))
    slanted = np.array([math.sin(0.7), math.cos(0.7)])  # cosine 0.76, and nearest to the same axis
    for away_m, normal, expected in (
        (0.1, ALONG_X, 60),
        (0.35, ALONG_X, 0),
        (0.1, -ALONG_X, 0),
        (0.1, slanted, 0),
        (0.1, np.zeros(2), 0),
    ):
        source = wall_map((line(-1, away_m, 1, away_m), normal))
        assert equations(source, target, np.zeros(3), reach_m=0.3)[2] == expected


def test_a_distance_weighs_by_the_square_of_geman_and_mcclures_weight() -> None:
    target = wall_map((line(-2, 0, 2, 0), ALONG_X))
    H, g, used, cost = equations(wall_map((line(-1, 0.2, 1, 0.2), ALONG_X)), target, np.zeros(3), scale_m=0.2)
    assert H[1, 1] == pytest.approx(used * 0.25) and g[1] == pytest.approx(used * 0.25 * 0.2)
    assert cost == pytest.approx(used * 0.5)


def test_solving_like_numpy() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        J, g, out = rng.normal(size=(9, 3)), rng.normal(size=3), np.empty(3)
        fit.solve3(np.triu(J.T @ J), g, out)
        np.testing.assert_allclose(out, np.linalg.solve(J.T @ J, g), rtol=1e-9)


CROSS = wall_map((line(-2, 0, 2, 0), ALONG_X), (line(0, -2, 0, 2), ALONG_Y))


def fitted(
    a: WallMap, b: WallMap, T: F64, rounds: int, pivot: tuple[float, float] = (0.0, 0.0), scale_m: float = 0.2
) -> tuple[bool, F64]:
    out = np.array(T, dtype=np.float64)
    return fit.gauss_newton(a, b, out, np.array(pivot), (1, 1), 0.6, scale_m, rounds), out


def test_walls_come_to_lie_on_walls(sides: tuple[PreparedMap, PreparedMap], pair: tuple) -> None:
    a, b = sides
    start = se2.compose(pair[2], np.array([0.2, -0.15, 0.02]))
    pivot = 0.5 * (a.centre + se2.apply(start, b.centre))
    fine, found = fitted(a.wall_map, b.wall_map, start, 20, tuple(pivot))
    assert fine
    away = se2.apply(found, b.points) - se2.apply(pair[2], b.points)
    assert np.hypot(*away.T).max() < 0.05


def test_one_round_shifts_by_half_a_metre_and_turns_by_a_tenth_at_most() -> None:
    start = np.array([0.4, 0.42, 0.0])
    shifted = fitted(CROSS, CROSS, start, 1, scale_m=10.0)[1] - start
    turned = fitted(CROSS, CROSS, np.array([0.0, 0.0, 0.25]), 1, scale_m=10.0)[1]
    assert np.hypot(*shifted[:2]) == pytest.approx(fit.MAX_SHIFT_M, abs=0.05)
    assert np.hypot(*shifted[:2]) <= fit.MAX_SHIFT_M + 1e-9
    assert turned[2] == pytest.approx(0.25 - fit.MAX_TURN_RAD)


def test_along_a_corridor_nothing_moves() -> None:
    corridor = wall_map((line(-2, 0, 2, 0), ALONG_X), (line(-2, 1.5, 2, 1.5), -ALONG_X))
    fine, found = fitted(corridor, corridor, np.array([0.2, 0.1, 0.0]), 20)
    assert fine and np.isfinite(found).all()
    assert found[0] == pytest.approx(0.2, abs=0.01) and found[1] == pytest.approx(0.0, abs=0.01)


def test_a_few_points_hold_nothing() -> None:
    few = wall_map((line(-0.1, 0, 0.1, 0, points=4), ALONG_X))
    start = np.array([0.0, 0.1, 0.0])
    fine, found = fitted(few, few, start, 5)
    assert not fine and np.array_equal(found, start)
