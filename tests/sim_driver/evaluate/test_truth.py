from __future__ import annotations

import numpy as np

from sim_driver.evaluate.truth import Judge
from spatial import OccupancyGrid


def room(wall_col: int) -> OccupancyGrid:
    cells = np.zeros((20, 20), dtype=np.int8)
    cells[:, wall_col] = 100
    return OccupancyGrid(cells, 0.05)


def test_two_cells_away_is_near_a_wall_and_three_are_not() -> None:
    world = room(10)
    judge = Judge(world, world.cells == 0)
    for col, is_near in ((12, 1.0), (13, 0.0)):
        assert judge.occupied_precision(room(col), np.zeros(3)) == is_near
        assert judge.occupied_recall(room(col), np.zeros(3)) == is_near
        drive = room(col).centres(room(col).is_occupied)
        assert (judge.ghosts(room(col), np.zeros(3), drive, 0.2) == 0) == bool(is_near)


def test_two_maps_contradict_where_a_wall_moved_stands_on_floor_that_the_other_shows() -> None:
    judge = Judge(room(10), room(10).cells == 0)
    own = (room(10), np.zeros(3))
    assert judge.contradiction_m(own, own, np.zeros(3)) == 0.0
    assert judge.contradiction_m(own, own, np.array([0.3, 0.0, 0.0])) == 1.0  # 20 cells of 0.05 m
    blind = (OccupancyGrid(np.full((20, 20), -1, dtype=np.int8), 0.05), np.zeros(3))
    assert judge.contradiction_m(own, blind, np.array([0.3, 0.0, 0.0])) == 0.0
