from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.alignment import Alignment, Evidence, Rejection, WallEvidence
from mrslam.merge.draw import INK
from mrslam.merge.fit_picture import AGAINST, CAPTION_PX, OF_B, draw_fit
from mrslam.spatial import OccupancyGrid, se2


def room(width: int, wall_at: int | None = None) -> OccupancyGrid:
    """Return a room 6 m high, with a wall across where one is asked for."""
    cells = np.full((130, width + 10), -1, dtype=np.int8)
    cells[5:125, 5 : width + 5] = 0
    for rows, cols in ((5, slice(5, width + 5)), (124, slice(5, width + 5)), (slice(5, 125), 5)):
        cells[rows, cols] = 100
    cells[5:125, width + 4] = 100
    if wall_at is not None:
        cells[5:125, wall_at] = 100
    return OccupancyGrid(cells, 0.05)


def place(T: np.ndarray, *rivals: np.ndarray) -> Rejection:
    return Rejection("no", 0.1, Evidence(a=WallEvidence(), b=WallEvidence()), "auto", T, False, rivals)


def counted(picture: np.ndarray, rgb: tuple[int, int, int]) -> int:
    return int((picture[:-CAPTION_PX] == rgb).all(axis=-1).sum())


def test_walls_that_agree_are_black_and_nothing_is_red() -> None:
    found = Alignment(np.zeros(3), 0.9, Evidence(), np.eye(3), "auto")
    picture = draw_fit(room(200), room(200), found)
    assert counted(picture, INK) > 1000 and counted(picture, AGAINST) == 0 == counted(picture, OF_B)


def test_a_wall_across_the_other_maps_floor_is_red_where_it_stands() -> None:
    picture = draw_fit(room(200), room(200, wall_at=100), place(np.zeros(3)))
    rows, cols = np.nonzero((picture[:-CAPTION_PX] == AGAINST).all(axis=-1))
    assert len(rows) > 500
    assert np.abs(cols / picture.shape[1] - 0.5).max() < 0.05  # in the middle of a room as long as the picture


def test_walls_the_other_map_does_not_know_have_their_own_colour() -> None:
    apart = draw_fit(room(200), room(200), place(se2.transform(30.0, 0.0, 0.0)))
    assert counted(apart, OF_B) > 200 and counted(apart, AGAINST) == 0 == counted(apart, INK)


def test_an_ambiguous_answer_shows_its_rival_beside() -> None:
    turned = se2.transform(10.0, 6.0, math.pi)
    one = draw_fit(room(200), room(200), place(np.zeros(3)))
    both = draw_fit(room(200), room(200), place(np.zeros(3), turned))
    assert both.shape[1] > 1.9 * one.shape[1]
    np.testing.assert_array_equal(both[: one.shape[0] - CAPTION_PX, : one.shape[1]], one[:-CAPTION_PX])


def test_without_a_place_there_is_nothing_to_draw() -> None:
    assert draw_fit(room(200), room(200), Rejection("nothing matches", 0.0, None, "auto")) is None


@pytest.mark.parametrize("bent_m", [0.0, 0.2])
def test_a_bent_fit_is_drawn_bent(bent_m: float) -> None:
    long = room(206)  # 3 % longer: its far wall lies on the other map's unknown, or floor
    found = Alignment(np.zeros(3), 0.9, Evidence(bent_m=bent_m), np.eye(3), "auto")
    picture = draw_fit(long, room(200), found)
    assert (counted(picture, AGAINST) > 0) == (bent_m == 0.0)
