"""Compiling the kernels once, before agents start."""

from __future__ import annotations

import numpy as np

from mrslam.merge.draw import draw_team
from mrslam.merge.grids.agreement import Walls, compare
from mrslam.merge.grids.fuse import fuse
from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.merge.grids.warp import warp
from mrslam.merge.joint.bend import Bend
from mrslam.merge.joint.candidate_kernels import nearest_keys
from mrslam.merge.joint.consistent_kernels import grow
from mrslam.merge.joint.local_match import LocalMatcher
from mrslam.merge.joint.trail import Trail
from mrslam.merge.joint.trail_kernels import seen_again
from mrslam.merge.team import TeamMap
from mrslam.spatial import KeyScans, OccupancyGrid, se2
from mrslam.spatial.pose_graph import relax


def warm_up() -> None:
    """Compile the warping, fusing, comparing, matching and bending kernels by calling each once with a tiny map."""
    cells = np.zeros((8, 8), dtype=np.int8)
    cells[3, :] = 100
    grid = OccupancyGrid(cells, 0.05)
    turned = warp(grid, se2.transform(0.1, 0.2, 0.3))
    fuse([grid, turned], method="log-odds")
    walls = Walls(TiledGrid.of(grid))
    compare(walls, walls, se2.IDENTITY, 0.1)
    draw_team(TeamMap(anchor="r1", T_team_map={"r1": se2.IDENTITY}, grid=grid), {"r1": grid}, legend=False, size_px=8)
    _join_and_bend()


def _join_and_bend() -> None:
    """Match two stretches of a room where they are, and where they must be searched for; bend the map of one."""
    corner = np.linspace(0.5, 4.0, 40)
    points = np.concatenate(
        [np.stack([corner, np.full(40, 3.0)], axis=1), np.stack([np.full(40, 4.0), corner - 2.0], axis=1)]
    )
    keys = np.stack([np.linspace(0.0, 0.8, 5), np.zeros(5), np.zeros(5)], axis=1)
    scans = KeyScans.of_points([(points - key[:2])[::2] for key in keys], np.zeros((5, 2)))
    trail, matcher = Trail(keys, scans), LocalMatcher()
    nearest_keys(keys, keys, 1.0, 1.0)
    grow(np.ones((3, 3), dtype=np.int8), 0)
    seen_again(keys, trail.way_m, 1.0, 1.0, 1.0)
    for off_m in (0.0, 1.0):
        matcher.match(trail, 2, trail, 2, se2.transform(off_m, 0.0, 0.0), 20.0)
    relax(keys, trail.edges, np.zeros(trail.edges.first.size, dtype=np.bool_))
    cells = np.zeros((64, 64), dtype=np.int8)
    cells[40, :] = 100
    Bend(keys, keys * np.array([1.2, 1.0, 1.0])).bent(OccupancyGrid(cells, 0.05))
