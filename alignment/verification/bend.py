"""A bend: the small smooth deformation under which a map lies on another, and the map bent by it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrslam.alignment.kernels.bending import bent_state, shifts_at
from mrslam.alignment.prepared import PreparedMap
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

F64 = NDArray[np.float64]
ROUNDS_BACK = 4
"""Rounds of the fixed point that inverts a bend; each shrinks the error by the strain, 0.03 to 0.1."""


@dataclass(frozen=True, eq=False)
class Bend:
    """Where the places p of map b lie in map a: ``T_a_b (p + u(p))``, u bilinear between the nodes of a lattice."""

    T_a_b: Transform
    """The rigid part: what it leaves over is least, in the mean over the walls that agree."""
    nodes: F64
    """``(rows, cols, 2)`` shifts u of the nodes, metres, frame b."""
    x0: float
    """First node, frame b, metres."""
    y0: float
    """First node, frame b, metres."""
    spacing_m: float
    """Distance of neighbouring nodes."""
    residual_m: float
    """Root mean square of u over the walls that agree, metres: how far off the rigid part is."""

    @property
    def strain(self) -> float:
        """Return the root mean square change of the shift per metre, over the lattice: 0.03 is 3 % of scale."""
        steps = np.concatenate([np.diff(self.nodes, axis=k).reshape(-1, 2) for k in (0, 1)])
        return float(np.sqrt(np.mean(np.sum(steps**2, axis=1)))) / self.spacing_m

    def shifts(self, at: F64) -> F64:
        """Return u ``(N, 2)`` at places of map b ``(N, 2)``."""
        return shifts_at(at, self.nodes, self.x0, self.y0, self.spacing_m)

    def forward(self, at: F64) -> F64:
        """Return where places ``(N, 2)`` of map b lie in map a."""
        return se2.apply(self.T_a_b, at + self.shifts(at))

    def backward(self, at: F64) -> F64:
        """Return which places of map b lie at ``(N, 2)`` of map a."""
        straight = se2.apply(se2.inverse(self.T_a_b), at)
        out = straight
        for _ in range(ROUNDS_BACK):
            out = straight - self.shifts(out)
        return out

    def bent(self, b: PreparedMap) -> PreparedMap:
        """Return map b bent, in its own frame: ``T_a_b`` lays it on map a."""
        most = math.ceil(float(np.max(np.abs(self.nodes))) / b.res)
        shape = (b.state.shape[0] + 2 * most, b.state.shape[1] + 2 * most)
        x0, y0 = b.x0 - most * b.res, b.y0 - most * b.res
        place = (self.nodes, self.x0, self.y0, self.spacing_m)
        state = bent_state(b.state, b.x0, b.y0, b.res, place, (shape[0], shape[1], x0, y0), ROUNDS_BACK)
        return PreparedMap(state, x0, y0, b.res)
