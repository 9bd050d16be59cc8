"""How far a transform between two maps is from the true one."""

from __future__ import annotations

import numpy as np

from mrslam.spatial import OccupancyGrid, se2


def apart(T: se2.Transform, truth: se2.Transform, b: OccupancyGrid) -> tuple[float, float]:
    middle = b.centres(b.is_occupied).mean(axis=0)
    return float(np.hypot(*(se2.apply(T, middle) - se2.apply(truth, middle)))), se2.difference(T, truth)[1]
