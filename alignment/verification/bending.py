"""Finding a bend: walls laid on walls, each metre of deformation paid for (a membrane, Gauss-Newton, coarse to fine).

Both maps' walls take part, as in the rigid refinement; unknowns are the shifts of a lattice of nodes. A rival gets the
same freedom as the best fit: what is judged is how well a place fits at the least deformation that helps it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mrslam.alignment.kernels.agreement import agreement
from mrslam.alignment.kernels.bending import add_walls, partners, shifts_at
from mrslam.alignment.kernels.fit import MIN_POINTS
from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.verification.bend import Bend
from mrslam.alignment.verification.refine import CELLS_PER_READING
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

F64 = NDArray[np.float64]
SPACING_M = 3.0
"""Distance of the nodes, metres: about a room."""
MOST_NODES = 10
"""Nodes along the longer side above which they lie farther apart; bounds the time of a solution."""
SIGMA_M = 0.07
"""Standard deviation of one reading of a wall, metres: a cell and a half, as walls of other mappers are ragged."""
HELD = 1e-3
"""Added to the diagonal, 1 / m^2: shifts of all nodes together cost next to nothing, and yet have one answer."""
Rounds = tuple[tuple[float, float, int], ...]
"""(reach m, kernel scale m, rounds) from coarse to fine."""
COARSE: Rounds = ((0.6, 0.3, 4),)
"""What lies within the reach of the nearest walls (0.6 m) is drawn near, and with it what lies farther out."""
FINE: Rounds = ((0.6, 0.2, 4), (0.4, 0.12, 3))
"""What comes after."""
MOST_POINTS = 1500
"""Wall points per map that a bend is computed from."""
MOST_JUDGED = 6000
"""Wall points per map that are judged under a bend, at each of the places."""


def straight(b: PreparedMap, T_a_b: Transform) -> Bend:
    """Return the bend that bends nothing, on the lattice that map b gets."""
    low, high = b.points.min(axis=0), b.points.max(axis=0)
    spacing_m = max(SPACING_M, float(np.max(high - low)) / MOST_NODES)
    cols, rows = (max(math.ceil(float(n) / spacing_m) + 1, 2) for n in high - low)
    return Bend(np.array(T_a_b), np.zeros((rows, cols, 2)), float(low[0]), float(low[1]), spacing_m, 0.0)


def bend(a: PreparedMap, b: PreparedMap, start: Bend, strain: float, schedule: Rounds = COARSE + FINE) -> Bend:
    """Return the deformation of b that lays wall on wall, nearest to ``start``.

    ``strain`` : usual change of the shift per metre. Membrane prior: the shifts of two neighbouring nodes differ by
    ``strain`` x spacing, one sigma.
    """
    rows, cols = start.nodes.shape[:2]
    stiff = membrane(rows, cols) / (strain * start.spacing_m) ** 2 + HELD * np.eye(2 * rows * cols)
    here = start
    for reach_m, scale_m, rounds in schedule:
        for _ in range(rounds):
            here = _step(a, b, here, stiff, (reach_m, scale_m))
    return here


def membrane(rows: int, cols: int) -> F64:
    """Return the ``(2M, 2M)`` matrix of the sum of squared differences between neighbouring nodes."""
    index = np.arange(rows * cols).reshape(rows, cols)
    one = np.concatenate([index[:, :-1].ravel(), index[:-1].ravel()])
    two = np.concatenate([index[:, 1:].ravel(), index[1:].ravel()])
    ends = np.zeros((len(one), rows * cols))
    ends[np.arange(len(one)), one], ends[np.arange(len(one)), two] = 1.0, -1.0
    return np.asarray(np.kron(ends.T @ ends, np.eye(2)), dtype=np.float64)


def _step(a: PreparedMap, b: PreparedMap, here: Bend, stiff: F64, kernel: tuple[float, float]) -> Bend:
    """Return the bend after one Gauss-Newton step, its rigid part moved into ``T_a_b``."""
    reach_m, scale_m = kernel
    rows, cols = here.nodes.shape[:2]
    lattice = (rows, cols, here.x0, here.y0, here.spacing_m)
    R = se2.matrix(here.T_a_b)[:2, :2]
    H, g = stiff.copy(), stiff @ here.nodes.ravel()
    held = []
    for source, of_b in ((b, True), (a, False)):
        step = -(-len(source.points) // MOST_POINTS)
        at, normals = source.points[::step].copy(), source.normals[::step].copy()
        moved, facing, target = (here.forward(at), normals @ R.T, a) if of_b else (here.backward(at), normals @ R, b)
        j = np.empty(len(at), dtype=np.int64)
        partners(moved, facing, target.wall_map, reach_m, j)
        hit, j = j >= 0, j[j >= 0]
        gap, normal = moved[hit] - target.points[j], target.normals[j]
        # The residual falls as b moves against the normal (frame b); a's points are bent back: the wall of b moves.
        place, normal, residual = (
            (at[hit], normal @ R, np.sum(gap * normal, axis=1))
            if of_b
            else (target.points[j], normal, -np.sum(gap * normal, axis=1))
        )
        add_walls(place, normal, residual, lattice, step / CELLS_PER_READING / SIGMA_M**2, scale_m, H, g)
        held.append(place)
    places = np.concatenate(held)
    if len(places) < MIN_POINTS:
        return here
    nodes = here.nodes - np.linalg.solve(H, g).reshape(here.nodes.shape)
    return without_rigid(here, nodes, places)


def without_rigid(here: Bend, nodes: F64, places: F64) -> Bend:
    """Return the deformation with other ``nodes``, its rigid part over ``places (N, 2)`` moved into ``T_a_b``."""
    moved = places + shifts_at(places, nodes, here.x0, here.y0, here.spacing_m)
    T = se2.fit_rigid(moved, places)
    rows, cols = nodes.shape[:2]
    xs, ys = np.meshgrid(here.x0 + np.arange(cols) * here.spacing_m, here.y0 + np.arange(rows) * here.spacing_m)
    lattice = np.stack([xs, ys], axis=-1)
    left = se2.apply(se2.inverse(T), lattice + nodes) - lattice
    over = shifts_at(places, left, here.x0, here.y0, here.spacing_m)
    residual_m = float(np.sqrt(np.mean(np.sum(over**2, axis=1))))
    return Bend(se2.compose(here.T_a_b, T), left, here.x0, here.y0, here.spacing_m, residual_m)


def judge_bent(a: PreparedMap, b: PreparedMap, by: Bend, tolerance_m: float) -> tuple[F64, F64]:
    """Return metres of wall (matched, opposed, contradicted, unseen) of b on a, and of a on b, under the bend."""
    step_a, step_b = (-(-len(side.points) // MOST_JUDGED) for side in (a, b))
    bent = b.wall_map._replace(points=b.points + by.shifts(b.points))
    # Normals are turned by the rigid part alone: a bend turns them by a degree or two.
    turned = a.normals @ se2.matrix(by.T_a_b)[:2, :2]
    back = a.wall_map._replace(points=by.backward(a.points), normals=turned)
    on_a = agreement(bent, a.wall_map, by.T_a_b, step_b, tolerance_m, np.empty(len(b.points), dtype=np.uint8))
    on_b = agreement(back, b.wall_map, se2.IDENTITY, step_a, tolerance_m, np.empty(len(a.points), dtype=np.uint8))
    return np.array(on_a) * step_b * a.res, np.array(on_b) * step_a * a.res
