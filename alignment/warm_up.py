"""Compiles every kernel once, so that no mission waits for the compiler."""

from __future__ import annotations

import numpy as np

from mrslam.spatial import OccupancyGrid


def warm_up() -> None:
    """Call each kernel of this package with tiny input."""
    from mrslam.alignment.align import align  # late: align imports every kernel
    from mrslam.alignment.aligners import ALIGNERS
    from mrslam.alignment.config import AlignmentConfig
    from mrslam.alignment.prepared import prepare

    cells = np.full((120, 160), -1, dtype=np.int8)
    cells[20:100, 20:140] = 0
    for r, c in ((20, slice(20, 140)), (99, slice(20, 140)), (slice(20, 100), 20), (slice(20, 100), 139)):
        cells[r, c] = 100
    cells[20:60, 70], cells[70, 20:50], cells[40, 100:110] = 100, 100, 100
    grid = OccupancyGrid(cells, 0.05)
    config = AlignmentConfig(evaluations=5, ransac_draws=50)
    align(grid, grid, config=config)
    a, b = (prepare(grid, grid.resolution_m) for _ in range(2))
    for propose in ALIGNERS.values():  # what they propose is judged by the same kernels
        propose(a, b, config, None)
    # What does not fit rigidly is bent, which has kernels of its own.
    align(grid, grid, config=AlignmentConfig(min_score_m=1e6))
