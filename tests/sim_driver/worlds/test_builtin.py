"""Worlds that come with the package: what makes each of them the place that missions and docs speak of."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from mrslam.sim_driver.worlds import load_world
from mrslam.sim_driver.worlds.builtin import BUILT_IN

FLOOR_M2 = {
    "arena1": 16.63, "arena2": 110.77, "office": 386.92, "corridor": 110.09, "block": 349.72, "symmetric-house": 103.57
}  # fmt: skip
"""Floor of each world, square metres, so that none changes unseen: shipped missions name places in them."""


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_world_has_as_much_floor_as_ever(name: str) -> None:
    world = load_world(name)
    assert np.count_nonzero(~world.is_wall) * world.resolution_m**2 == pytest.approx(FLOOR_M2[name], rel=1e-3)


def test_the_corridor_has_four_recesses_on_either_side() -> None:
    free = load_world("corridor").grid.cells == 0
    for side in (free[round(1.7 / 0.05)], free[round(4.5 / 0.05)]):
        assert ndimage.label(side)[1] == 4
    begins = np.flatnonzero(np.diff(free.sum(axis=0)) > 0)
    assert len(set(np.diff(begins).tolist())) == len(begins) - 1  # nothing looks like the next


def test_the_block_is_one_loop_and_its_sides_can_be_told_apart() -> None:
    world = load_world("block")
    labels, _ = ndimage.label(world.is_wall)
    core = labels == labels[world.is_wall.shape[0] // 2, world.is_wall.shape[1] // 2]
    assert core.any() and world.is_wall[core].all() and not core[0].any()
    assert np.count_nonzero(core) * 0.05**2 == pytest.approx(580.0, rel=0.02)
    cells = world.grid.cells
    for turned in (cells[::-1], cells[:, ::-1], cells[::-1, ::-1]):
        assert np.mean(cells != turned) > 0.05


def test_walls_of_the_small_arena_are_thin() -> None:
    cells = load_world("arena1").grid.cells
    assert ndimage.distance_transform_edt(cells[60, :20]).max() <= 2
