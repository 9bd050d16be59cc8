"""Compiles this package's kernels ahead of use."""

from __future__ import annotations

import numpy as np

from mrslam.mutual_detection.ghosts import clear_ghosts
from mrslam.mutual_detection.mask import mask_teammates
from mrslam.mutual_detection.tracker import TeammateTracker
from mrslam.spatial import OccupancyGrid, Scan


def warm_up() -> None:
    """Call each kernel once, and load what tracks teammates: half a second, or scans are lost on meeting the first."""
    ranges = np.ones(4, dtype=np.float32)
    scan = Scan(stamp_ns=0, ranges_m=ranges, angle_min_rad=0.0, angle_increment_rad=0.1, range_max_m=5.0)
    mask_teammates(scan, np.zeros(3), np.array([[1.0, 0.0]]), np.array([0.2]))
    clear_ghosts(OccupancyGrid(np.full((8, 8), 100, dtype=np.int8), 0.05), [np.full((2, 2), 0.2)], 0.1)
    TeammateTracker().observe("r2", 0, (1.0, 0.0))
