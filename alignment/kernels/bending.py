"""Compiled loops that lay a bent map on another: partners of walls, and the equations of the bend."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.alignment.kernels.agreement import quadrant
from mrslam.alignment.kernels.fit import FACES_LIKE
from mrslam.alignment.kernels.walls import NOTHING, OCCUPIED, WallMap

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]


@njit(cache=True, nogil=True)
def shifts_at(at: F64, nodes: F64, x0: float, y0: float, spacing_m: float) -> F64:  # pragma: no cover - compiled
    """Return the shifts ``(N, 2)`` at places ``at (N, 2)``: bilinear between ``nodes (rows, cols, 2)``, metres.

    ``x0``, ``y0`` : place of the first node. Outside of the lattice the shift of its nearest edge.
    """
    rows, cols = nodes.shape[0], nodes.shape[1]
    out = np.empty_like(at)
    for i in range(at.shape[0]):
        x = min(max((at[i, 0] - x0) / spacing_m, 0.0), cols - 1.000001)
        y = min(max((at[i, 1] - y0) / spacing_m, 0.0), rows - 1.000001)
        c, r = int(x), int(y)
        fx, fy = x - c, y - r
        for k in range(2):
            low = (1.0 - fx) * nodes[r, c, k] + fx * nodes[r, c + 1, k]
            high = (1.0 - fx) * nodes[r + 1, c, k] + fx * nodes[r + 1, c + 1, k]
            out[i, k] = (1.0 - fy) * low + fy * high
    return out


@njit(cache=True, nogil=True)
def partners(at: F64, normals: F64, target: WallMap, reach_m: float, out: I64) -> int:  # pragma: no cover - compiled
    """Write to ``out (N,)`` the target's nearest wall point that faces as each point does, or -1; return how many.

    ``at``, ``normals`` ``(N, 2)`` : points in the target's frame.
    """
    height, width = target.label.shape[1], target.label.shape[2]
    found = 0
    for i in range(at.shape[0]):
        out[i] = -1
        nx, ny = normals[i, 0], normals[i, 1]
        if nx == 0.0 and ny == 0.0:
            continue
        c = int(math.floor((at[i, 0] - target.x0) / target.res))
        r = int(math.floor((at[i, 1] - target.y0) / target.res))
        if not (0 <= r < height and 0 <= c < width):
            continue
        j = target.label[quadrant(nx, ny), r, c]
        if j == NOTHING:
            continue
        dx, dy = at[i, 0] - target.points[j, 0], at[i, 1] - target.points[j, 1]
        facing = nx * target.normals[j, 0] + ny * target.normals[j, 1]
        if dx * dx + dy * dy <= reach_m * reach_m and facing >= FACES_LIKE:
            out[i] = j
            found += 1
    return found


@njit(cache=True, nogil=True)
def add_walls(
    at: F64,
    normals: F64,
    residuals: F64,
    lattice: tuple[int, int, float, float, float],
    weight: float,
    scale_m: float,
    H: F64,
    g: F64,
) -> None:  # pragma: no cover - compiled
    """Add wall distances to ``H (2M, 2M)`` and ``g (2M,)`` of the nodes' shifts, by the Geman-McClure kernel.

    ``residuals (N,)`` fall as the map at ``at (N, 2)`` moves against ``normals (N, 2)``; ``lattice`` : rows, columns,
    first node's x and y, spacing; ``weight`` : of one residual, 1 / m^2.
    """
    rows, cols, x0, y0, spacing_m = lattice
    s2 = scale_m * scale_m
    index, share = np.empty(8, dtype=np.int64), np.empty(8)
    for i in range(at.shape[0]):
        x = min(max((at[i, 0] - x0) / spacing_m, 0.0), cols - 1.000001)
        y = min(max((at[i, 1] - y0) / spacing_m, 0.0), rows - 1.000001)
        c, r = int(x), int(y)
        fx, fy = x - c, y - r
        for k in range(4):
            node = 2 * ((r + k // 2) * cols + c + k % 2)
            part = (fx if k % 2 else 1.0 - fx) * (fy if k // 2 else 1.0 - fy)
            index[2 * k], index[2 * k + 1] = node, node + 1
            share[2 * k], share[2 * k + 1] = part * normals[i, 0], part * normals[i, 1]
        robust = s2 / (s2 + residuals[i] * residuals[i])
        w = weight * robust * robust
        for k in range(8):
            g[index[k]] += w * share[k] * residuals[i]
            for m in range(8):
                H[index[k], index[m]] += w * share[k] * share[m]


@njit(cache=True, nogil=True)
def bent_state(
    state: NDArray[np.uint8],
    x0: float,
    y0: float,
    res: float,
    bend: tuple[F64, float, float, float],
    target: tuple[int, int, float, float],
    rounds: int,
) -> NDArray[np.uint8]:  # pragma: no cover - compiled
    """Return the cells ``(H, W)`` of a bent map; ``target`` : H, W, left and lower edge; ``bend`` : see shifts_at.

    Every cell takes the state of the place that is bent to its middle; walls are then drawn cell by cell, so that none
    is lost between two samples.
    """
    nodes, nx0, ny0, spacing_m = bend
    height, width, left, low = target
    out = np.zeros((height, width), dtype=np.uint8)
    here, straight = np.empty((width, 2)), np.empty((width, 2))
    for r in range(height):
        for c in range(width):
            straight[c, 0], straight[c, 1] = left + (c + 0.5) * res, low + (r + 0.5) * res
        here[:] = straight
        for _ in range(rounds):
            here[:] = straight - shifts_at(here, nodes, nx0, ny0, spacing_m)
        for c in range(width):
            sc, sr = int(math.floor((here[c, 0] - x0) / res)), int(math.floor((here[c, 1] - y0) / res))
            if 0 <= sr < state.shape[0] and 0 <= sc < state.shape[1]:
                out[r, c] = state[sr, sc]
    at = np.empty((1, 2))
    for r in range(state.shape[0]):
        for c in range(state.shape[1]):
            if state[r, c] != OCCUPIED:
                continue
            at[0, 0], at[0, 1] = x0 + (c + 0.5) * res, y0 + (r + 0.5) * res
            u = shifts_at(at, nodes, nx0, ny0, spacing_m)
            tc = int(math.floor((at[0, 0] + u[0, 0] - left) / res))
            tr = int(math.floor((at[0, 1] + u[0, 1] - low) / res))
            if 0 <= tr < height and 0 <= tc < width:
                out[tr, tc] = OCCUPIED
    return out
