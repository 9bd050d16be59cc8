"""Compiles every kernel that the mapper calls, those of ``mrslam.spatial`` included."""

from __future__ import annotations

import numpy as np

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.filter.resampling import systematic
from mrslam.rbpf.front_end.visibility import contradicted
from mrslam.rbpf.localise.fixed_map import FixedMap
from mrslam.rbpf.mapper import Mapper
from mrslam.spatial import OccupancyGrid, Scan
from mrslam.spatial.hits.store import TileStore
from mrslam.spatial.matching.cloud import find_normals
from mrslam.spatial.matching.correlative import Lattice, search
from mrslam.spatial.matching.global_search import find, wall_grid
from mrslam.spatial.pose_graph import Edges, relax


def warm_up() -> None:
    """Run the mapper on four made-up scans, so that every kernel is compiled and on disk."""
    config = MapperConfig(particles=3, threads=1, clear_range_m=1.0, neff_fraction=1.0, temporal_update_s=0.5)
    mapper = Mapper(config, seed=0)
    angles = np.linspace(-1.5, 1.5, 60)
    for k in range(4):
        walls = 2.0 / np.maximum(np.cos(angles), 0.5) - 0.1 * k
        ranges = np.where(np.arange(60) % 20 == 0, np.inf, walls).astype(np.float32)
        scan = Scan(
            stamp_ns=k * 10**9, ranges_m=ranges, angle_min_rad=-1.5, angle_increment_rad=3.0 / 59, range_max_m=10.0
        )
        mapper.update(scan, np.array([0.6 * k, 0.0, 0.2 * k]))
    mapper.snapshot()
    mapper.trajectory()
    systematic(np.ones(2), 2, 0.5)
    mapper._back.filter.store.resample(np.zeros(3, dtype=np.int64))
    store = TileStore(1, 0.05)
    store.draw(0, np.zeros((1, 2)), np.zeros((1, 3)), [np.zeros((20, 5), dtype=np.float32)], 0.1)
    points = np.linspace(0.0, 1.0, 100).reshape(20, 5)
    find_normals(points, np.zeros(2), points.copy())
    contradicted(points, points, np.zeros(3), scan.T_base_laser[:2])
    find(wall_grid(points[:, :2]), points, np.zeros(3), 0.1, 0.01, 0.0)
    chain = np.arange(3)
    edges = Edges(chain[:2], chain[1:], np.ones((2, 3)), np.ones((2, 3, 3)))
    relax(np.zeros((3, 3)), edges, np.zeros(2, dtype=np.bool_))
    cells = np.zeros((40, 40), dtype=np.int8)
    cells[20] = 100
    FixedMap(OccupancyGrid(cells, 0.05), 0.05)
    search(store.tiles(0), np.zeros((20, 5)), np.zeros(3), Lattice(0.1, 0.05, 0.1, 0.1, 10))
