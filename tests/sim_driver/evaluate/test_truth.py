from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.evaluate.truth import (
    BLOCK_POINTS,
    Judge,
    overlap,
    pair_error,
    shared_middle,
    values_at,
    values_from,
)
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.spatial import OccupancyGrid, se2
from mrslam.spatial.files.tum import write_tum


def room(wall_col: int) -> OccupancyGrid:
    cells = np.zeros((20, 20), dtype=np.int8)
    cells[:, wall_col] = 100
    return OccupancyGrid(cells, 0.05)


def test_a_transform_that_turns_about_a_point_is_right_there_and_wrong_elsewhere() -> None:
    T_world_a, T_world_b = se2.transform(3.0, -1.0, 0.7), se2.transform(-2.0, 5.0, -1.1)
    middle, turn_rad = np.array([40.0, 30.0]), np.deg2rad(1.0)
    turned = se2.compose(se2.compose(np.array([*middle, 0.0]), np.array([0.0, 0.0, turn_rad])), [-40.0, -30.0, 0.0])
    T_a_b = se2.compose(se2.between(T_world_a, T_world_b), turned)
    assert pair_error(T_a_b, T_world_a, T_world_b, middle) == pytest.approx((0.0, 1.0))
    assert pair_error(T_a_b, T_world_a, T_world_b) == pytest.approx((2.0 * 50.0 * np.sin(turn_rad / 2.0), 1.0))


def test_what_two_maps_share_has_its_middle_in_the_second_ones_frame() -> None:
    cells = np.zeros((20, 40), dtype=np.int8)
    a, b = OccupancyGrid(cells, 0.05), OccupancyGrid(cells, 0.05, (10.0, 0.0))
    T_world_b = se2.transform(-9.0, 0.0, 0.0)  # its second metre on is beyond the first map's end
    assert shared_middle(a, b, np.zeros(3), T_world_b) == pytest.approx([10.5, 0.5])
    cells_seen = cells.copy()
    cells_seen[:, 10:] = -1
    assert shared_middle(a, OccupancyGrid(cells_seen, 0.05, (10.0, 0.0)), np.zeros(3), T_world_b)[0] == 10.25
    assert shared_middle(a, b, np.zeros(3), np.zeros(3)) == pytest.approx([11.0, 0.5])  # nothing
    unseen = OccupancyGrid(np.full_like(cells, -1), 0.05)
    assert shared_middle(a, unseen, np.zeros(3), np.zeros(3)).tolist() == [0.0, 0.0]


def test_many_points_are_asked_for_in_blocks_and_get_the_values_of_one_question() -> None:
    rng = np.random.default_rng(7)
    grid = OccupancyGrid(rng.choice(np.array([-1, 0, 100], dtype=np.int8), (400, 500)), 0.05, (-3.0, 2.0))
    points, T_grid_frame = grid.centres(np.ones(grid.shape, dtype=np.bool_)), se2.transform(1.3, -0.4, 0.6)
    assert len(points) > 3 * BLOCK_POINTS
    whole = values_at(grid, se2.apply(T_grid_frame, points))
    assert np.array_equal(values_from(grid, T_grid_frame, points), whole)
    assert len(set(whole.tolist())) == 3
    assert values_from(grid, T_grid_frame, points[:0]).shape == (0,)


def test_two_cells_away_is_near_a_wall_and_three_are_not() -> None:
    world = room(10)
    judge = Judge(world, world.cells == 0)
    for col, is_near in ((12, 1.0), (13, 0.0)):
        assert judge.occupied_precision(room(col), np.zeros(3)) == is_near
        assert judge.occupied_recall(room(col), np.zeros(3)) == is_near
        drive = room(col).centres(room(col).is_occupied)
        assert (judge.ghosts(room(col), np.zeros(3), drive, 0.2) == 0) == bool(is_near)


def test_of_a_thick_wall_a_map_need_show_the_face_only() -> None:
    world, found = room(10), room(10)
    world.cells[:, 10:] = 100  # half a metre thick
    found.cells[:, 11:] = -1
    assert Judge(world, world.cells == 0).occupied_recall(found, np.zeros(3)) == 1.0
    found.cells[:8, 10] = 0
    assert Judge(world, world.cells == 0).occupied_recall(found, np.zeros(3)) == pytest.approx(0.7, abs=0.06)


def test_walls_that_are_missing_count_only_where_a_map_knows_the_floor_before_them() -> None:
    world, found = room(10), room(10)
    judge = Judge(world, world.cells == 0)
    found.cells[10:] = -1  # half of the room was never seen
    assert judge.occupied_recall(found, np.zeros(3)) == 1.0
    found.cells[10:15] = 0  # floor without the wall, but near the end of the wall that was found
    assert judge.occupied_recall(found, np.zeros(3)) == pytest.approx(0.7, abs=0.06)
    found.cells[:] = -1
    assert judge.occupied_recall(found, np.zeros(3)) is None


def test_floor_of_a_map_within_a_wall_of_the_world_is_wrong() -> None:
    world, found = room(10), room(0)
    world.cells[:, 10:] = 100  # half a metre thick
    assert Judge(world, world.cells == 0).free_agreement(found, np.zeros(3)) == pytest.approx(11 / 19)
    found.cells[:] = -1
    assert Judge(world, world.cells == 0).free_agreement(found, np.zeros(3)) is None


def test_a_wall_at_the_worlds_edge_is_near_on_its_far_side_too() -> None:
    world = room(19)
    judge = Judge(world, world.cells == 0)
    beyond = OccupancyGrid(world.cells, 0.05, (0.1, 0.0))  # the same wall, drawn two cells farther out
    assert judge.occupied_precision(beyond, np.zeros(3)) == 1.0
    assert judge.occupied_precision(OccupancyGrid(world.cells, 0.05, (0.15, 0.0)), np.zeros(3)) == 0.0


def test_overlap_is_of_the_smaller_map_whichever_comes_first() -> None:
    whole = OccupancyGrid(np.zeros((40, 40), dtype=np.int8), 0.05)
    part = OccupancyGrid(np.zeros((10, 20), dtype=np.int8), 0.05)
    there, beside = np.array([0.5, 0.5, 0.0]), np.array([1.5, 0.5, 0.0])  # the second half lies outside
    for T_world_part, share in ((there, 1.0), (beside, 0.5)):
        assert overlap(whole, part, np.zeros(3), T_world_part) == pytest.approx(share)
        assert overlap(part, whole, T_world_part, np.zeros(3)) == pytest.approx(share)


def test_two_maps_contradict_where_a_wall_moved_stands_on_floor_that_the_other_shows() -> None:
    judge = Judge(room(10), room(10).cells == 0)
    own = (room(10), np.zeros(3))
    assert judge.contradiction_m(own, own, np.zeros(3)) == 0.0
    assert judge.contradiction_m(own, own, np.array([0.3, 0.0, 0.0])) == 1.0  # 20 cells of 0.05 m
    blind = (OccupancyGrid(np.full((20, 20), -1, dtype=np.int8), 0.05), np.zeros(3))
    assert judge.contradiction_m(own, blind, np.array([0.3, 0.0, 0.0])) == 0.0


@pytest.mark.parametrize(("first_s", "x"), [(None, 0.0), (0, 0.0), (4, 4.0)])
def test_the_frame_of_a_map_begun_anew_is_where_the_robot_was_then(
    tmp_path: Path, first_s: int | None, x: float
) -> None:
    tables = {"mission": {"name": "one"}, "world": {"name": "office"}, "robots": [{"id": "a"}]}
    stamps_ns = np.arange(10) * 10**9
    poses = np.stack([np.arange(10.0), np.zeros(10), np.zeros(10)], axis=1)
    write_tum(tmp_path / "a" / "truth.tum", stamps_ns, poses)
    if first_s is not None:
        write_tum(tmp_path / "a" / "trajectory.tum", stamps_ns[first_s:], poses[first_s:] - poses[first_s])
    run = RunResults.of(make_mission(tables, tmp_path / "m.toml"), tmp_path)
    assert run.T_world_map["a"].tolist() == [x, 0.0, 0.0]
