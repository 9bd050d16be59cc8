"""How far along their ways robots are from each other, and what of their bent maps must agree."""

import gc
import weakref

import numpy as np
import pytest

from mrslam.merge import Trail
from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.merge.joint.bend import Bend
from mrslam.merge.joint.consistent import KeyMatch
from mrslam.merge.joint.ties import Tie
from mrslam.merge.joint.ways import HELD_M, SHOWN_M, Ways, part_around
from mrslam.spatial import TILE_CELLS, KeyScans, se2

COUNT = 50
EDGE_M = 0.05 * TILE_CELLS


def straight(step_m: float = 1.0) -> Trail:
    """A trail along x, without scans."""
    keys = np.array([[step_m * k, 0.0, 0.0] for k in range(COUNT)])
    return Trail(keys, KeyScans.of_points([np.empty((0, 2))] * COUNT, np.zeros((COUNT, 2))))


def tie(a: str, i: int, b: str, j: int, *, believed: bool = True) -> Tie:
    return Tie(a, b, KeyMatch(i, j, np.zeros(3), np.eye(3)), believed)


def test_the_way_to_another_robot_leads_along_both_ways_and_over_ties() -> None:
    trails = {"a": straight(), "b": straight(2.0), "c": straight(), "d": straight()}
    elsewhere = tie("e", 1, "f", 1)  # two that met, and nobody else
    ways = Ways(trails, [tie("a", 10, "b", 5), tie("b", 20, "c", 7), tie("c", 3, "d", 3, believed=False), elsewhere])
    k = np.arange(COUNT)
    assert ways.to("b")["a"] == pytest.approx(np.abs(k - 10.0), abs=1e-3)
    assert ways.to("a")["b"] == pytest.approx(2.0 * np.abs(k - 5.0), abs=1e-3)
    assert ways.to("c")["a"] == pytest.approx(np.abs(k - 10.0) + 30.0, abs=1e-3)  # through b
    assert ways.to("c")["c"] == pytest.approx(0.0)
    assert np.isinf(ways.to("d")["a"]).all()  # nothing that is believed leads there


def test_what_was_computed_for_a_trail_goes_with_it() -> None:
    trails = {"a": straight(), "b": straight()}
    cores = [weakref.ref(trail.core.trail) for trail in trails.values()]
    ways = Ways(trails, [tie("a", 0, "b", 0)])
    del trails
    gc.collect()
    assert [core() for core in cores] == [None, None]
    assert ways.to("a")["b"][1] == pytest.approx(1.0, abs=1e-3)


def test_a_map_is_held_as_far_from_another_robot_as_maps_bend_by_less_than_walls_are_compared_by() -> None:
    held = Ways({"a": straight(0.9), "b": straight()}, [tie("a", 0, "b", 0)]).held("a", "b")
    assert held.tolist() == [0.9 * k <= HELD_M for k in range(COUNT)]


def test_the_part_around_keyframes_that_are_held_is_cut_from_the_map_as_it_is_bent() -> None:
    tiles = {(0, j): np.zeros((TILE_CELLS, TILE_CELLS), dtype=np.int8) for j in range(20)}
    keys = np.array([[0.5 * EDGE_M, 0.0, 0.0], [10.5 * EDGE_M, 0.0, 0.0]])
    T_team_map = se2.transform(5.0, -3.0, 1.0)
    bend = Bend(keys - np.array([[0.0, 0.0, 0.0], [2.0 * EDGE_M, 0.0, 0.0]]), se2.compose(T_team_map, keys))

    def kept(*is_held: bool) -> list[int]:
        return sorted(j for _, j in part_around(TiledGrid(tiles, 0.05), bend, np.array(is_held)).tiles)

    # The bend lengthens the way by two tiles, one to either side: keyframes are at -0.5 and 9.5 tiles.
    assert 2.0 * EDGE_M < SHOWN_M < 3.0 * EDGE_M
    assert kept(True, True) == [0, 1, 7, 8, 9, 10, 11]
    assert kept(True, False) == [0, 1] and kept(False, True) == [7, 8, 9, 10, 11]
    assert kept(False, False) == []
    near = Bend(keys * [0.2, 1.0, 1.0], se2.compose(T_team_map, keys * [0.2, 1.0, 1.0]))  # 6 m apart
    (last,) = part_around(TiledGrid({(0, 2): tiles[0, 2]}, 0.05), near, np.array([False, True])).tiles
    assert last == (0, 2)
    assert not part_around(TiledGrid({(0, 0): tiles[0, 0]}, 0.05), near, np.array([False, True])).tiles  # the other's
