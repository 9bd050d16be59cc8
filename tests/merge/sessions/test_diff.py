"""What changed between two maps of one building, against a truth that is known."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.merge.grids.warp import warp
from mrslam.merge.picture_key import KEY_PX
from mrslam.merge.sessions.diff import Diff, Piece, _pieces, diff
from mrslam.merge.sessions.picture import APPEARED, FAINT, INK, ONE_ONLY, VANISHED, draw_diff
from mrslam.spatial import InputError, Keyframes, KeyScans, OccupancyGrid, se2
from mrslam.spatial.files.saved_map import SavedMap, of_one_session
from tests.merge.joint.blocks import drive, local_map, walls
from tests.merge.plans import building

GONE, CAME = (2.0, 9.0, 0.6, 0.4), (14.0, 9.0, 1.0, 0.5)
"""Furniture: x, y of its corner and its size, metres."""


def with_boxes(plan: OccupancyGrid, *boxes: tuple[float, float, float, float]) -> OccupancyGrid:
    """Return a plan with the outlines of boxes, as a laser draws them."""
    cells = plan.cells.copy()
    for x, y, wide, high in boxes:
        c0, r0, c1, r1 = (round(v / plan.resolution_m) for v in (x, y, x + wide, y + high))
        cells[r0:r1, c0:c1] = -1
        cells[[r0, r1 - 1], c0:c1] = cells[r0:r1, [c0, c1 - 1]] = 100
    return OccupancyGrid(cells, plan.resolution_m, plan.origin_m)


def room() -> OccupancyGrid:
    """Return a hall of 20 x 12 m with pillars in no order."""
    cells = np.zeros((240, 400), dtype=np.int8)
    cells[:3] = cells[-3:] = cells[:, :3] = cells[:, -3:] = 100
    rng = np.random.default_rng(3)
    for r, c in zip(rng.integers(10, 150, 12), rng.integers(10, 380, 12), strict=True):
        cells[r : r + 9, c : c + 13] = 100
    return OccupancyGrid(cells, 0.05)


def saved(grid: OccupancyGrid) -> SavedMap:
    return of_one_session("r1@monday", grid, Keyframes.empty(), KeyScans.empty())


def test_pieces_are_where_they_stand_and_as_large_as_they_are() -> None:
    before, after = with_boxes(room(), GONE), with_boxes(room(), CAME)
    found = diff(saved(before), saved(after), same_frame=True)
    came, gone = found.pieces
    assert (came.what, gone.what) == ("appeared", "vanished")
    assert [came.x_m, came.y_m, came.width_m, came.height_m] == pytest.approx([14.5, 9.25, 1.0, 0.5])
    assert [gone.x_m, gone.y_m, gone.width_m, gone.height_m] == pytest.approx([2.3, 9.2, 0.6, 0.4])
    assert came.area_m2 == pytest.approx((2 * 20 + 2 * 8) * 0.05**2)
    assert found.both_m2 == pytest.approx(240.0 - (8 * 18 + 10 * 6) * 0.0025)  # all but what is inside of the boxes
    assert set(came.fields()) == {"what", "x_m", "y_m", "width_m", "height_m", "area_m2"}


def test_maps_of_two_frames_are_aligned_first() -> None:
    before, after = with_boxes(building(), (6.0, 3.5, 0.6, 0.4)), with_boxes(building(), (9.0, 3.5, 1.0, 0.5))
    found = diff(saved(before), saved(warp(after, se2.inverse(np.array([3.3, -1.7, 0.4])))))
    assert [piece.what for piece in found.pieces] == ["appeared", "vanished"]
    assert [found.pieces[0].x_m, found.pieces[0].y_m] == pytest.approx([9.5, 3.75], abs=0.1)


def test_maps_that_do_not_fit_are_no_diff() -> None:
    with pytest.raises(InputError, match="the maps do not fit: "):
        diff(saved(building(1)), saved(building(9)))


def test_maps_need_not_have_one_resolution() -> None:
    before, after = with_boxes(room(), GONE), with_boxes(room(), CAME)
    finer = OccupancyGrid(after.cells.repeat(2, axis=0).repeat(2, axis=1), 0.025)
    found = diff(saved(before), saved(finer), same_frame=True)
    assert (found.before.resolution_m, found.after.resolution_m) == (0.05, 0.05)
    assert [piece.what for piece in found.pieces] == ["appeared", "vanished"]
    assert [found.pieces[0].x_m, found.pieces[0].y_m] == pytest.approx([14.5, 9.25], abs=0.05)


def test_maps_need_not_be_on_one_lattice() -> None:
    before, after = with_boxes(room(), GONE), with_boxes(room(), CAME)
    beside = OccupancyGrid(before.cells, before.resolution_m, (0.02, -0.013))
    for one, two in ((beside, after), (after, beside)):
        found = diff(saved(one), saved(two), same_frame=True)
        assert sorted(piece.what for piece in found.pieces) == ["appeared", "vanished"]


def test_small_pieces_are_left_out() -> None:
    after = with_boxes(room(), CAME)
    after.cells[100:103, 200:202] = 100  # 0.015 m2
    assert len(diff(saved(room()), saved(after), same_frame=True).pieces) == 1
    found = diff(saved(room()), saved(after), same_frame=True, least_m2=0.01)
    assert len(found.pieces) == 2 and found.cells.appeared.sum() == 56 + 6


def test_strokes_of_one_piece_are_one() -> None:
    after = room()
    for c in (100, 103, 106):  # strokes 0.1 m apart
        after.cells[200:212, c] = 100
    after.cells[200:212, 116] = 100  # and one 0.45 m away
    assert [piece.width_m for piece in diff(saved(room()), saved(after), same_frame=True).pieces] == pytest.approx(
        [0.35, 0.05]
    )


@pytest.mark.parametrize(("between", "pieces"), [(3, 1), (4, 2)])
def test_strokes_with_at_most_0_15_m_between_them_are_one_piece(between: int, pieces: int) -> None:
    for turned in (False, True):
        cells = room().cells.copy()
        for at in (100, 101 + between):
            (cells.T if turned else cells)[100:112, at] = 100
        found = diff(saved(room()), saved(OccupancyGrid(cells, 0.05)))
        assert [piece.what for piece in found.pieces] == ["appeared"] * pieces


@pytest.mark.parametrize("between", [4, 5])
def test_strokes_that_face_each_other_across_a_corner_are_one_piece(between: int) -> None:
    before, after = (OccupancyGrid(room().cells, 0.03) for _ in range(2))
    after.cells[200:212, 100] = 100
    after.cells[212 + between, 101 + between : 125] = 100  # 0.12 or 0.15 m between the two along either axis
    (piece,) = diff(saved(before), saved(after), same_frame=True).pieces
    assert (piece.width_m, piece.height_m) == pytest.approx((25 * 0.03, (13 + between) * 0.03))


def pieces_one_by_one(grid: OccupancyGrid, mask: NDArray[np.bool_], least_m2: float) -> tuple[list[Piece], Any]:
    """Return the pieces of a mask, each looked for in the whole grid: the slow twin of ``_pieces``."""
    dilated = cv2.dilate(mask.astype(np.uint8), np.ones((4, 4), np.uint8))  # 0.15 m and a cell
    _, label = cv2.connectedComponents(dilated, connectivity=8)
    pieces, kept = [], np.zeros_like(mask)
    for k in range(1, label.max() + 1):
        cells = (label == k) & mask
        area_m2 = cells.sum() * grid.resolution_m**2
        if area_m2 >= least_m2 - 1e-9:
            centres_m = grid.centres(cells)
            (x, y), (wide, high) = centres_m.mean(axis=0), np.ptp(centres_m, axis=0) + grid.resolution_m
            pieces.append(Piece("appeared", float(x), float(y), float(wide), float(high), float(area_m2)))
            kept |= cells
    return pieces, kept


@pytest.mark.parametrize("share", [0.002, 0.02, 0.06])
@pytest.mark.parametrize("least_m2", [0.0, 0.005, 0.02])
def test_pieces_are_those_found_one_by_one(share: float, least_m2: float) -> None:
    rng = np.random.default_rng(7)
    mask = rng.random((90, 130)) < share
    grid = OccupancyGrid(np.zeros(mask.shape, dtype=np.int8), 0.05, (-1.3, 2.7))
    pieces, kept = _pieces(grid, "appeared", mask, least_m2)
    expected, expected_kept = pieces_one_by_one(grid, mask, least_m2)
    assert pieces == expected and (kept == expected_kept).all()
    assert len(expected) > 3 or least_m2 > 0.0


def test_nothing_of_a_building_that_stayed_has_changed_though_its_maps_are_bent() -> None:
    maps = []
    for start, bend, seed in ((0.0, 0.0004, 1), (40.0, -0.0004, 2)):
        local = local_map(drive(start, 90.0, bend, seed))
        maps.append(of_one_session("r1@day", local.map.to_grid(), local.keyframes, local.key_scans))
    found = diff(*maps)
    assert found.bent_m > 0.1 and found.both_m2 > 150.0
    assert sum(piece.area_m2 for piece in found.pieces) < 0.01 * len(walls())


def picture_of(found: Diff, colour: tuple[int, int, int]) -> int:
    return int((draw_diff(found)[:-KEY_PX] == np.array(colour, dtype=np.uint8)).all(axis=2).sum())


def test_the_picture_shows_what_changed() -> None:
    found = diff(saved(with_boxes(room(), GONE)), saved(with_boxes(room(), CAME)), same_frame=True)
    picture = draw_diff(found)
    assert picture.dtype == np.uint8 and max(picture.shape[:2]) >= 900
    scale = picture.shape[1] // (400 + 24)
    assert picture_of(found, APPEARED) == 56 * scale**2 and picture_of(found, VANISHED) == 36 * scale**2
    assert picture_of(found, INK) == int(room().is_occupied.sum()) * scale**2
    row = picture.shape[0] - KEY_PX - 1 - (round(9.02 / 0.05) + 12) * scale  # first row on top
    assert tuple(picture[row, (round(2.3 / 0.05) + 12) * scale]) == VANISHED
    key, bar_px = picture[-KEY_PX:], round(2.0 / 0.05) * scale
    for colour in (APPEARED, VANISHED, FAINT):
        assert (key == colour).all(axis=2).sum() == 100
    is_ink = (key[13] == INK).all(axis=1)
    assert is_ink[8 : 8 + bar_px].all() and not is_ink[7] and not is_ink[8 + bar_px]


def test_the_picture_tells_what_both_have_seen_from_what_one_has() -> None:
    before = room()
    before.cells[:, 300:] = -1
    picture = draw_diff(found := diff(saved(before), saved(room()), same_frame=True))
    scale = picture.shape[1] // (400 + 24)
    walls = [int(grid.is_occupied.sum()) for grid in (found.before, found.after)]
    for colour, cells in (
        (INK, walls[0]),
        (FAINT, walls[1] - walls[0]),
        (ONE_ONLY, int(room().is_free[:, 300:].sum())),
    ):
        assert picture_of(found, colour) == cells * scale**2


@pytest.mark.parametrize(("near_m", "pieces"), [(0.1, 2), (0.3, 0)])
def test_how_far_a_wall_may_be_beside_itself_is_chosen(near_m: float, pieces: int) -> None:
    before, after = room(), room()
    before.cells[180:230, 100], after.cells[180:230, 104] = 100, 100
    assert len(diff(saved(before), saved(after), same_frame=True, near_m=near_m).pieces) == pieces
