from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.alignment import Alignment, Evidence, Rejection, WallEvidence
from mrslam.merge.draw import INK, PAPER
from mrslam.merge.fit_picture import (
    AGAINST,
    CAPTION_PX,
    FLOOR,
    LEAST_PX,
    MOST_PX,
    OF_A,
    OF_B,
    ONE_ONLY,
    draw_fit,
    draw_places,
)
from mrslam.merge.picture_key import KEY_PX
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


@pytest.mark.parametrize("is_in_a", [False, True])
def test_a_wall_across_the_other_maps_floor_is_red_where_it_stands(is_in_a: bool) -> None:
    bare, crossed = room(200), room(200, wall_at=100)
    picture = draw_fit(crossed, bare, place(np.zeros(3))) if is_in_a else draw_fit(bare, crossed, place(np.zeros(3)))
    rows, cols = np.nonzero((picture[:-CAPTION_PX] == AGAINST).all(axis=-1))
    assert len(rows) > 500
    assert np.abs(cols / picture.shape[1] - 0.5).max() < 0.05  # in the middle of a room as long as the picture
    assert len(np.unique(cols)) == 3 * (LEAST_PX // 220)  # red is seen from afar
    of_nothing = draw_fit(bare, bare, place(np.zeros(3)))[-CAPTION_PX:]
    assert (picture[-CAPTION_PX:] != of_nothing).any()  # the caption says how many metres


def test_walls_the_other_map_does_not_know_have_their_own_colour() -> None:
    apart = draw_fit(room(200), room(200), place(se2.transform(30.0, 0.0, 0.0)))
    assert counted(apart, OF_B) > 200 and counted(apart, AGAINST) == 0 == counted(apart, INK)


def test_everything_is_drawn_where_it_is_in_the_first_maps_frame() -> None:
    a, b = (np.full((130, 250), -1, dtype=np.int8) for _ in range(2))
    a[5:125, 40:240], b[5:125, 10:160] = 0, 0
    for cells, left, right in ((a, 40, 240), (b, 10, 160)):
        cells[5, left:right] = cells[124, left:right] = cells[5:125, left] = 100
    a[5:125, 239], b[40:50, 100:110], b[5:125, 40] = 100, 100, 100
    T_b_a = se2.transform(6.5, 2.0, 0.5 * math.pi)  # a quarter of a turn about a's corner, which is at (-2, 0)
    turned = OccupancyGrid(np.ascontiguousarray(np.rot90(b, -1)), 0.05)
    picture = draw_fit(OccupancyGrid(a, 0.05, (-2.0, 0.0)), turned, place(se2.inverse(T_b_a)))
    for x_m, y_m, rgb in (
        (1.0, 1.0, FLOOR), (8.0, 3.0, ONE_ONLY), (-1.0, 3.0, ONE_ONLY), (-1.75, 3.0, PAPER), (8.0, 6.5, PAPER),
        (3.0, 0.275, INK), (3.0, 6.225, INK), (0.025, 3.0, INK), (8.0, 0.275, OF_A), (9.975, 5.0, OF_A),
        (-1.0, 0.275, OF_B), (-1.475, 1.0, OF_B), (3.025, 2.25, AGAINST), (3.25, 2.475, AGAINST),
    ):  # fmt: skip
        row, col = (int(3 * (metres + margin) / 0.05) for metres, margin in ((y_m, 0.25), (x_m, 2.0)))
        assert tuple(picture[-CAPTION_PX - 1 - row, col]) == rgb, (x_m, y_m)


@pytest.mark.parametrize("origin_m", [0.0, 1.1, -3.37])
def test_a_straight_wall_is_one_straight_line(origin_m: float) -> None:
    here = OccupancyGrid(room(200).cells, 0.05, (origin_m, origin_m))
    is_ink = (draw_fit(here, here, place(np.zeros(3)))[:-CAPTION_PX] == INK).all(axis=-1)
    times = LEAST_PX // 220
    assert np.count_nonzero(is_ink.sum(axis=1) == 200 * times) == 2 * times
    assert np.count_nonzero(is_ink.sum(axis=0) == 120 * times) == 2 * times


@pytest.mark.parametrize("is_in_a", [False, True])
def test_a_part_that_nothing_joins_to_the_rest_is_not_drawn(is_in_a: bool) -> None:
    one = room(200)
    two = OccupancyGrid(np.concatenate([one.cells, room(100).cells], axis=1), 0.05)
    picture = draw_fit(two, one, place(np.zeros(3))) if is_in_a else draw_fit(one, two, place(np.zeros(3)))
    np.testing.assert_array_equal(picture, draw_fit(one, one, place(np.zeros(3))))


def test_very_large_maps_are_shrunk_alike_both_ways() -> None:
    picture = draw_fit(room(2600), room(2600), place(np.zeros(3)))
    assert picture.shape[1] == MOST_PX
    assert picture.shape[0] - CAPTION_PX == pytest.approx(140 * MOST_PX / 2620, abs=1.0)


def test_the_caption_names_the_verdict_and_the_first_rival() -> None:
    one, turned, shifted = room(200), se2.transform(10.0, 6.0, math.pi), se2.transform(1.0, 0.0, 0.0)
    best = np.zeros(3)
    for outcome, places in (
        (Alignment(best, 0.9, Evidence(), np.eye(3), "auto"), [(best, "accepted")]),
        (place(best), [(best, "rejected")]),
        (place(best, turned, shifted), [(best, "ambiguous"), (turned, "its rival")]),
    ):
        np.testing.assert_array_equal(draw_fit(one, one, outcome), draw_places(one, one, places))


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


def test_the_key_tells_colours_and_a_length() -> None:
    picture = draw_fit(room(200), room(200), place(np.zeros(3)))
    key, times = picture[-KEY_PX:], LEAST_PX // 220
    for colour in (OF_A, OF_B, AGAINST):
        assert (key == colour).all(axis=-1).sum() == 100
    is_ink, bar_px = (key[13] == INK).all(axis=-1), round(2.0 / 0.05 * times)
    assert is_ink[8 : 8 + bar_px].all() and not is_ink[8 + bar_px]
