"""Sub-cell refinement: walls of each map onto walls of the other, least squares in both directions, with covariance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.alignment.kernels.fit import gauss_newton, normal_equations
from mrslam.alignment.prepared import PreparedMap
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

CELLS_PER_READING = 5.0
"""Neighbouring wall cells that count as one independent reading: they are drawn by the same beams and share their
error. Bounds how sure a long wall makes the transform; 0.25 m of wall at cells of 0.05 m."""
LEAST_INFORMATION = 1e-6
"""Added to the information matrix, 1 / m^2 and 1 / rad^2: a direction that nothing holds gets a sigma of 1000."""


def equations(
    a: PreparedMap,
    b: PreparedMap,
    T_a_b: Transform,
    pivot: NDArray[np.float64],
    reach_m: float,
    scale_m: float,
    step: int = 1,
) -> tuple[NDArray[np.float64], NDArray[np.float64], int, float]:
    """Return ``H (3, 3)``, ``g (3,)``, points used and cost of the walls' distances at ``T_a_b``, both directions."""
    H, g = np.zeros((3, 3)), np.zeros(3)
    T_b_a = se2.inverse(T_a_b)
    n1, cost1 = normal_equations(b.wall_map, a.wall_map, T_a_b, step, reach_m, scale_m, pivot, True, H, g)
    n2, cost2 = normal_equations(a.wall_map, b.wall_map, T_b_a, step, reach_m, scale_m, pivot, False, H, g)
    H += np.triu(H, 1).T
    return H, g, n1 + n2, cost1 + cost2


def refine(
    a: PreparedMap,
    b: PreparedMap,
    T_a_b: Transform,
    schedule: tuple[tuple[float, float, int], ...] = ((0.6, 0.2, 5), (0.3, 0.1, 8)),
    most_points: int = 1_000_000,
) -> Transform:
    """Return the transform that lays wall on wall nearest to ``T_a_b`` (Gauss-Newton, Geman-McClure).

    ``schedule``: (reach m, kernel scale m, rounds) from coarse to fine; ``most_points`` thins the walls of each map.
    Directions that no wall holds do not move.
    """
    out = np.array(T_a_b, dtype=np.float64)
    pivot = 0.5 * (a.centre + se2.apply(out, b.centre))
    steps = (-(-len(a.points) // most_points), -(-len(b.points) // most_points))
    for reach_m, scale_m, rounds in schedule:
        if not gauss_newton(a.wall_map, b.wall_map, out, pivot, steps, reach_m, scale_m, rounds):
            break
    return out


def covariance(
    H: NDArray[np.float64], pivot: NDArray[np.float64], T_a_b: Transform, sigma_m: float
) -> NDArray[np.float64]:
    """Return the ``(3, 3)`` covariance of ``T_a_b`` (m, m, rad) from the Hessian about ``pivot`` (unit weights).

    ``sigma_m``: standard deviation of one independent wall point's distance, metres.
    """
    information = H / CELLS_PER_READING / sigma_m**2 + LEAST_INFORMATION * np.eye(3)
    return carried(np.asarray(np.linalg.inv(information), dtype=np.float64), pivot, T_a_b)


def carried(C: NDArray[np.float64], pivot: NDArray[np.float64], T_a_b: Transform) -> NDArray[np.float64]:
    """Return the ``(3, 3)`` covariance of ``T_a_b`` by that of a shift, and of a turn about ``pivot``, in frame a."""
    # A turn about the pivot moves the origin of b: d t = shift + turn x (t - pivot).
    J = np.eye(3)
    J[0, 2], J[1, 2] = -(T_a_b[1] - pivot[1]), T_a_b[0] - pivot[0]
    C = J @ C @ J.T
    return 0.5 * (C + C.T)
