from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrslam import alignment
from mrslam.alignment import Alignment, AlignmentConfig, Candidate, Prior, Rejection, align
from mrslam.sim_driver.worlds import load_world
from mrslam.spatial import InputError, OccupancyGrid, se2
from tests.alignment.apart import apart
from tests.alignment.conftest import T_A, House


@pytest.mark.parametrize("method", ["auto", "orb", "surf"])
def test_finds_the_transform_of_two_partial_maps(method, pair):
    a, b, truth = pair
    found = align(a, b, method=method)
    assert isinstance(found, Alignment), found.reason
    metres, radians = apart(found.T_a_b, truth, b)
    assert metres < 0.05 and radians < math.radians(0.3)
    assert found.confidence >= 0.5
    assert found.evidence.contradiction < 0.05
    assert found.covariance.shape == (3, 3)
    assert (np.linalg.eigvalsh(found.covariance) > 0).all()
    assert math.sqrt(found.covariance[2, 2]) < math.radians(1.0)


def test_hough_finds_what_it_was_made_for(house):
    whole = slice(0, 400), slice(0, 520)
    a = house.part(*whole, np.zeros(3))
    b = house.part(*whole, se2.transform(4.0, -3.0, math.radians(30.0)))
    found = align(a, b, method="hough")
    assert isinstance(found, Alignment), found.reason
    assert abs(math.degrees(found.T_a_b[2]) + 30.0) < 0.3


def test_both_orders_give_inverse_answers(pair):
    a, b, _ = pair
    one, other = align(a, b), align(b, a)
    assert isinstance(one, Alignment) and isinstance(other, Alignment)
    np.testing.assert_allclose(se2.compose(one.T_a_b, other.T_a_b), np.zeros(3), atol=1e-9)
    assert one.evidence == other.evidence.swapped()
    assert one.confidence == other.confidence
    # The covariance of the inverse is the covariance moved through the inverse.
    back = other.T_a_b
    J = np.stack([(se2.inverse(back + e) - se2.inverse(back - e)) / 2e-6 for e in 1e-6 * np.eye(3)], axis=1)
    np.testing.assert_allclose(one.covariance, J @ other.covariance @ J.T, rtol=1e-5, atol=1e-12)


def test_same_input_same_output(pair):
    a, b, _ = pair
    for method in ("auto", "orb"):
        one, other = align(a, b, method=method), align(a, b, method=method)
        np.testing.assert_array_equal(one.T_a_b, other.T_a_b)
        assert one.evidence == other.evidence


def test_padding_and_origin_do_not_matter(pair):
    a, b, truth = pair
    cells = np.pad(a.cells, ((31, 7), (11, 52)), constant_values=-1)
    x, y = a.origin_m
    padded = OccupancyGrid(cells, a.resolution_m, (x - 11 * a.resolution_m + 0.013, y - 31 * a.resolution_m - 0.021))
    found = align(padded, b)
    assert isinstance(found, Alignment)
    moved = se2.compose(np.array([0.013, -0.021, 0.0]), truth)
    metres, _ = apart(found.T_a_b, moved, b)
    assert metres < 0.05


def test_maps_of_different_resolution(house, pair):
    a, _, truth = pair
    b = house.part(slice(0, 400), slice(170, 520), se2.compose(se2.inverse(truth), T_A), res=0.08)
    found = align(a, b)
    assert isinstance(found, Alignment), found.reason
    metres, radians = apart(found.T_a_b, truth, b)
    assert metres < 0.1 and radians < math.radians(0.5)


def test_other_building_is_rejected_in_words_with_numbers(pair):
    a, _, _ = pair
    other = House(seed=7).part(slice(0, 400), slice(0, 300), T_A)
    found = align(a, other)
    assert isinstance(found, Rejection)
    assert "overlap" in found.reason and any(ch.isdigit() for ch in found.reason)
    assert found.confidence < 0.5


def test_a_rejection_shows_each_maps_own_evidence_in_both_orders(pair):
    a, b = pair[0], House(7).part(slice(0, 400), slice(170, 520), T_A)
    as_they_are = AlignmentConfig(strain=0.0)
    one, other = align(a, b, config=as_they_are), align(b, a, config=as_they_are)
    assert isinstance(one, Rejection) and isinstance(other, Rejection)
    assert one.evidence.a != one.evidence.b and one.evidence == other.evidence.swapped()


def test_parts_without_overlap_are_rejected(house):
    a = house.part(slice(0, 400), slice(0, 122), T_A)
    b = house.part(slice(0, 400), slice(300, 520), se2.transform(1.0, 2.0, 1.1))
    assert isinstance(align(a, b), Rejection)


def corridor(length: int, shift: int) -> OccupancyGrid:
    cells = np.full((60, length), 0, dtype=np.int8)
    cells[0], cells[-1] = 100, 100
    return OccupancyGrid(np.pad(cells, ((5, 5), (shift, 0)), constant_values=-1), 0.05)


def test_corridor_that_slides_is_ambiguous_or_slides():
    found = align(corridor(600, 3), corridor(500, 0))
    assert isinstance(found, Rejection)
    assert "slide along each other" in found.reason or "ambiguous" in found.reason


def test_any_corner_fits_any_other():
    cells = np.zeros((200, 200), dtype=np.int8)
    cells[0], cells[:, 0] = 100, 100
    found = align(OccupancyGrid(cells, 0.05), OccupancyGrid(cells[:150, :180].copy(), 0.05))
    assert isinstance(found, Rejection)


def test_repeated_rooms_are_ambiguous():
    room = np.zeros((80, 80), dtype=np.int8)
    room[0], room[-1], room[:, 0], room[:, -1], room[20:30, 30:50], room[60, 10:30] = 100, 100, 100, 100, 100, 100
    row = np.concatenate([room] * 5, axis=1)
    found = align(OccupancyGrid(row, 0.05), OccupancyGrid(row[:, :160].copy(), 0.05))
    assert isinstance(found, Rejection)
    assert "ambiguous" in found.reason
    told = align(OccupancyGrid(row, 0.05), OccupancyGrid(row[:, :160].copy(), 0.05), place=np.zeros(3))
    assert isinstance(told, Rejection) and told.ambiguous


def test_at_a_place_maps_are_accepted_if_they_fit_there_and_rejected_without_a_search_if_not(pair, monkeypatch):
    a, b, truth = pair
    near = truth + np.array([0.15, -0.1, 0.01])
    for one, other, place, right in ((a, b, near, truth), (b, a, se2.inverse(near), se2.inverse(truth))):
        found = align(one, other, place=place)
        assert isinstance(found, Alignment), found.reason
        metres, _ = apart(found.T_a_b, right, other)
        assert metres < 0.05
    searched = align(a, b)
    assert align(a, b, place=near).evidence.margin == pytest.approx(searched.evidence.margin, abs=0.05)
    monkeypatch.setitem(alignment.ALIGNERS, "auto", None)  # a search would fail
    away = truth + np.array([1.7, 0.9, 0.0])
    assert isinstance(align(a, b, place=away), Rejection)
    assert isinstance(align(a, b, place=away, prior=Prior(away, np.diag([9.0, 9.0, 0.01]))), Rejection)
    assert isinstance(align(a, b, place=np.array([1e5, -1e5, 2.0])), Rejection)
    followed = align(a, b, place=near, prior=Prior(near, np.diag([0.25, 0.25, 0.01])))
    assert isinstance(followed, Alignment) and apart(followed.T_a_b, truth, b)[0] < 0.05


def test_a_map_torn_in_two_is_judged_by_its_larger_part(pair):
    a, b, truth = pair
    twice = np.full((a.shape[0], 2 * a.shape[1] + 40), -1, dtype=np.int8)
    twice[:, : a.shape[1]] = a.cells
    twice[: a.shape[0] - 60, a.shape[1] + 40 :] = a.cells[:-60]
    found = align(OccupancyGrid(twice, a.resolution_m, a.origin_m), b)
    assert isinstance(found, Alignment), found.reason
    metres, radians = apart(found.T_a_b, truth, b)
    assert metres < 0.1 and radians < math.radians(0.5)


def numbers_of(reason: str) -> list[float]:
    return [float(number) for number in re.findall(r"-?[0-9]+(?:\.[0-9]+)?(?=%)", reason)]


@pytest.mark.parametrize("seed", [7, 8])
def test_reasons_hold_no_shares_beyond_the_whole_and_no_negative_lengths(pair, seed):
    a, _, _ = pair
    other = House(seed=seed).part(slice(0, 300), slice(0, 300), T_A)
    for method in ("auto", "orb", "hough"):
        found = align(a, other, method=method)
        assert isinstance(found, Rejection)
        assert all(0.0 <= share <= 100.0 for share in numbers_of(found.reason)), found.reason
        assert "-" not in re.sub("[a-z]-[a-z]", "", found.reason), found.reason


@pytest.mark.parametrize("method", ["orb", "surf", "hough"])
def test_no_method_alone_overlooks_the_other_place(monkeypatch, method):
    """Two rooms alike: a method that proposes only one of them must not be believed."""
    room = np.zeros((90, 110), dtype=np.int8)
    room[0], room[-1], room[:, 0], room[:, -1], room[20:32, 30:60], room[60:63, 10:40] = (100,) * 6
    gap = np.full((90, 30), -1, dtype=np.int8)
    gap[40:52] = 0
    both = np.concatenate([room, gap, room], axis=1)
    a, b = OccupancyGrid(both, 0.05), OccupancyGrid(room, 0.05)

    def one_place(a, b, config, prior):
        return [Candidate(se2.transform(0.0, 0.0, 0.0), 1.0)]

    monkeypatch.setitem(alignment.ALIGNERS, method, one_place)
    found = align(a, b, method=method)
    assert isinstance(found, Rejection)
    assert "ambiguous" in found.reason


EMPTY = OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05)


ODD = {
    "empty": EMPTY,
    "one cell": OccupancyGrid(np.full((1, 1), 100, dtype=np.int8), 0.05),
    "unknown": OccupancyGrid(np.full((90, 70), -1, dtype=np.int8), 0.05),
    "all free": OccupancyGrid(np.zeros((90, 70), dtype=np.int8), 0.05),
    "all occupied": OccupancyGrid(np.full((90, 70), 100, dtype=np.int8), 0.05),
    "in between": OccupancyGrid(np.full((90, 70), 50, dtype=np.int8), 0.05),
    "huge cells": OccupancyGrid(np.zeros((3, 3), dtype=np.int8), 5.0),
    "noise": OccupancyGrid(np.random.default_rng(0).choice([-1, 0, 100], (120, 130)).astype(np.int8), 0.05),
    "one line": OccupancyGrid(np.array([[100] * 200, [0] * 200], dtype=np.int8), 0.05),
}


@pytest.mark.parametrize("method", list(alignment.ALIGNERS))
@pytest.mark.parametrize("name", list(ODD))
def test_odd_maps_are_rejected_not_raised(method, name, pair):
    config = AlignmentConfig(evaluations=30)
    for grid in (pair[1], ODD[name] if name != "noise" else EMPTY):
        found = align(ODD[name], grid, method=method, config=config)
        assert isinstance(found, Rejection)
        assert found.reason
        assert found.method == method


def test_five_thousand_cells_square():
    cells = np.full((5000, 5000), -1, dtype=np.int8)
    rng = np.random.default_rng(3)
    for _ in range(60):
        r, c = rng.integers(0, 4600, 2)
        h, w = rng.integers(80, 400, 2)
        cells[r : r + h, c : c + w] = 0
        cells[r, c : c + w], cells[r + h - 1, c : c + w], cells[r : r + h, c], cells[r : r + h, c + w - 1] = (100,) * 4
    a = OccupancyGrid(cells, 0.05)
    b = OccupancyGrid(np.ascontiguousarray(np.rot90(cells)), 0.05)
    found = align(a, b)
    assert isinstance(found, Alignment), found.reason
    assert abs(abs(math.degrees(found.T_a_b[2])) - 90.0) < 0.1


def test_a_rejection_says_how_many_of_the_matched_features_agree(pair):
    found = align(pair[0], House(seed=7).part(slice(0, 400), slice(0, 300), T_A), method="orb")
    assert isinstance(found, Rejection) and found.evidence is not None
    inliers, matches = (found.evidence.proposal[name] for name in ("inliers", "matches"))
    assert 0 < inliers < matches and f"{inliers:.0f} of {matches:.0f} matched features agree" in found.reason


def test_the_covariance_says_how_far_off_the_transform_is(house, pair):
    """Errors of many alignments, measured in their own standard deviations: neither lost in it nor beyond it."""
    a, _, _ = pair
    ratios = []
    for k in range(6):
        T_b = se2.transform(-7.0 + k, 4.5, math.radians(160.0 + 11.3 * k))
        b = house.part(slice(0, 400), slice(170, 520), T_b)
        found = align(a, b)
        assert isinstance(found, Alignment), found.reason
        truth = se2.compose(T_A, se2.inverse(T_b))
        error = np.append(found.T_a_b[:2] - truth[:2], se2.wrap(found.T_a_b[2] - truth[2]))
        ratios.append(float(error @ np.linalg.solve(found.covariance, error)) / 3.0)
    assert 0.01 < np.mean(ratios) < 9.0


def test_unknown_method_names_the_known_ones(pair):
    with pytest.raises(InputError, match="must be one of auto, orb"):
        align(pair[0], pair[1], method="magic")


@settings(max_examples=6, deadline=None)
@given(x=st.floats(-50, 50), y=st.floats(-50, 50), theta=st.floats(-math.pi, math.pi))
def test_any_frame(x, y, theta):
    house = House()
    T_b = se2.transform(x, y, theta)
    a = house.part(slice(0, 400), slice(0, 330), T_A)
    b = house.part(slice(0, 400), slice(170, 520), T_b)
    one, other = align(a, b), align(b, a)
    assert isinstance(one, Alignment) and isinstance(other, Alignment)
    metres, radians = apart(one.T_a_b, se2.compose(T_A, se2.inverse(T_b)), b)
    assert metres < 0.05 and radians < math.radians(0.3)
    np.testing.assert_allclose(se2.compose(one.T_a_b, other.T_a_b), np.zeros(3), atol=1e-8)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_nearly_symmetric_arena_does_not_fit_its_mirror_image(axis):
    arena = load_world("arena1").grid
    mirrored = OccupancyGrid(np.flip(arena.cells, axis=axis).copy(), arena.resolution_m, arena.origin_m)
    found = align(arena, mirrored)
    assert isinstance(found, Rejection) and found.evidence is not None and found.evidence.a.matched_m > 10.0
    assert isinstance(align(arena, arena), Alignment)
