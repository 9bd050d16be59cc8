import gc
import weakref

import numpy as np

from mrslam.merge import MergeConfig
from mrslam.merge.contradictions import Contradictions
from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.spatial import OccupancyGrid, se2


def room(open_to_m: float) -> TiledGrid:
    """A room of 5 x 5 m with walls, its free space ending at ``open_to_m``."""
    cells = np.full((120, 120), -1, dtype=np.int8)
    cells[10:110, 10 : round(open_to_m / 0.05)] = 0
    cells[10, 10:110] = cells[109, 10:110] = cells[10:110, 10] = 100
    return TiledGrid.of(OccupancyGrid(cells, 0.05))


def test_walls_on_free_space_are_a_contradiction_with_its_length():
    kept = Contradictions(MergeConfig())
    grids = room(5.0), room(5.0)
    assert kept.against("a", "b", grids, se2.IDENTITY, 1) is None
    against = kept.against("a", "b", grids, se2.transform(0.0, 1.0, 0.0), 1)
    assert against is not None and "of wall of a and b" in against


def test_placed_by_way_of_several_alignments_walls_may_lie_farther_off() -> None:
    config = MergeConfig()
    kept, grids = Contradictions(config), (room(5.0), room(5.0))
    off = se2.transform(0.0, 1.5 * config.contradiction_tolerance_m, 0.0)
    hops = [hops for hops in (1, 2, 4) if kept.against("a", "b", grids, off, hops) is not None]
    assert hops == [1, 2]  # errors of several add up as a square root


def test_a_forgotten_robots_maps_are_let_go():
    kept, gone, stays = Contradictions(MergeConfig()), room(5.0), room(4.0)
    of_gone, of_stays = weakref.ref(gone), weakref.ref(stays)
    kept.against("a", "b", (stays, gone), se2.IDENTITY, 1)
    kept.against("a", "c", (stays, stays), se2.IDENTITY, 1)
    kept.forget("b")
    del gone, stays
    gc.collect()
    assert of_gone() is None and of_stays() is not None
