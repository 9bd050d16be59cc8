"""Carpin's acceptance index of a merge (Carpin 2008, equation 4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.kernels.agreement import free_overlap
from mrslam.alignment.prepared import prepare, working_resolution
from mrslam.spatial import OccupancyGrid


def acceptance_index(grid_a: OccupancyGrid, grid_b: OccupancyGrid, T_a_b: ArrayLike) -> float:
    """Return agr / (agr + dis): of the cells known in both maps, the share that is free in both or occupied in both.

    0.0 where no cell is known in both. Says nothing by itself where the common area is small or mostly free.
    """
    a, b = grid_a.cropped(), grid_b.cropped()
    res = working_resolution(a, b, AlignmentConfig())
    if 0 in a.shape or 0 in b.shape:
        return 0.0
    one, two = prepare(a, res), prepare(b, res)
    free, occupied, differ, _ = free_overlap(
        two.state, two.x0, two.y0, 1, np.asarray(T_a_b, dtype=np.float64), one.state, one.x0, one.y0, res
    )
    return (free + occupied) / max(free + occupied + differ, 1)
