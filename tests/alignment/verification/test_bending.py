from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.kernels.bending import shifts_at
from mrslam.alignment.prepared import prepare
from mrslam.alignment.verification import bending
from mrslam.alignment.verification.bend import Bend
from mrslam.alignment.verification.bending import bend, judge_bent, membrane, straight, without_rigid
from mrslam.spatial import OccupancyGrid, se2
from tests.alignment.conftest import House

STRAIN = AlignmentConfig().strain
T_A_B = se2.transform(3.0, -2.0, math.radians(40.0))


def stretched(b, share: float) -> Bend:
    """Return the bend that scales map b by 1 + share about its middle."""
    start = straight(b, T_A_B)
    rows, cols = start.nodes.shape[:2]
    xs = start.x0 + np.arange(cols) * start.spacing_m - b.centre[0]
    ys = start.y0 + np.arange(rows) * start.spacing_m - b.centre[1]
    nodes = share * np.stack(np.meshgrid(xs, ys), axis=-1)
    return Bend(T_A_B, nodes, start.x0, start.y0, start.spacing_m, 0.0)


@pytest.fixture(scope="module")
def whole():
    house = House()
    every = slice(0, 400), slice(0, 520)
    return prepare(house.part(*every, T_A_B), 0.05), prepare(house.part(*every, np.zeros(3)), 0.05)


def test_a_scale_that_is_off_is_found_and_said(whole) -> None:
    a, b = whole
    small = stretched(b, -0.03).bent(b)  # b drawn too small by 3 %
    found = bend(a, small, straight(small, T_A_B), STRAIN)
    places = np.array([[1.0, 1.0], [20.0, 2.0], [3.0, 17.0], [24.0, 18.0]])
    drawn = places + stretched(b, -0.03).shifts(places)
    rigid = np.hypot(*(se2.apply(found.T_a_b, drawn) - se2.apply(T_A_B, places)).T)
    bent = np.hypot(*(found.forward(drawn) - se2.apply(T_A_B, places)).T)
    assert bent.max() < 0.1 < 0.25 < rigid.max()
    assert found.strain == pytest.approx(0.03, rel=0.25)
    assert found.residual_m == pytest.approx(0.25, abs=0.1)


def test_what_contradicts_a_stretched_map_is_gone_once_it_is_bent(whole) -> None:
    a, b = whole
    small = stretched(b, -0.03).bent(b)
    start = straight(small, T_A_B)
    before, after = (judge_bent(a, small, by, 0.15)[0] for by in (start, bend(a, small, start, STRAIN)))
    assert before[2] > 20.0 > 3.0 > after[2]
    assert after[0] > 2.0 * before[0]


def test_maps_that_fit_are_not_bent(whole) -> None:
    a, b = whole
    found = bend(a, b, straight(b, T_A_B), STRAIN)
    assert found.residual_m < 0.02
    assert np.hypot(*(found.T_a_b - T_A_B)[:2]) < 0.03


def test_backward_undoes_forward(whole) -> None:
    by = stretched(whole[1], 0.04)
    places = np.random.default_rng(0).uniform((0.0, 0.0), (25.0, 19.0), (50, 2))
    np.testing.assert_allclose(by.backward(by.forward(places)), places, atol=1e-4)


def test_moving_the_rigid_part_leaves_every_place_where_it_was(whole) -> None:
    _, b = whole
    start = straight(b, T_A_B)
    nodes = np.random.default_rng(1).normal(0.3, 0.1, start.nodes.shape)
    moved = without_rigid(start, nodes, b.points)
    before = se2.apply(T_A_B, b.points + shifts_at(b.points, nodes, start.x0, start.y0, start.spacing_m))
    np.testing.assert_allclose(moved.forward(b.points), before, atol=1e-9)
    assert np.abs(moved.shifts(b.points).mean(axis=0)).max() < 1e-6
    assert moved.residual_m < 0.2


def test_the_membrane_costs_what_neighbours_differ_by() -> None:
    u = np.random.default_rng(4).normal(size=(3, 4, 2))
    naive = sum(np.sum(np.diff(u, axis=axis) ** 2) for axis in (0, 1))
    assert u.ravel() @ membrane(3, 4) @ u.ravel() == pytest.approx(naive)


def test_maps_without_walls_near_each_other_are_not_bent(whole) -> None:
    a, b = whole
    far = straight(b, np.array([500.0, 0.0, 0.0]))
    assert bend(a, b, far, STRAIN) is far


def test_a_map_that_is_bent_outwards_is_drawn_whole(whole) -> None:
    _, b = whole
    for moved_m in (4.0, -4.0):
        start = straight(b, T_A_B)
        drawn = replace(start, nodes=start.nodes + moved_m).bent(b)
        assert np.count_nonzero(drawn.state) == np.count_nonzero(b.state)


def test_walls_agree_as_much_seen_from_either_map(whole) -> None:
    a, b = whole
    on_a, on_b = judge_bent(a, b, straight(b, T_A_B), 0.15)
    for side, walls in ((on_a, b), (on_b, a)):
        assert side[0] > 0.9 * len(walls.points) * walls.res and side[2] < 1.0


def test_a_subsample_of_the_walls_bends_a_map_as_far_as_all_of_them(whole, monkeypatch) -> None:
    a, b = whole
    small = stretched(b, -0.03).bent(b)
    bent_m = []
    for most in (10**6, 500):
        monkeypatch.setattr(bending, "MOST_POINTS", most)
        bent_m.append(bend(a, small, straight(small, T_A_B), 0.002).residual_m)  # stiff: walls and stiffness in balance
    assert bent_m[1] == pytest.approx(bent_m[0], rel=0.1)


def test_a_subsample_of_walls_is_judged_to_be_as_long_as_all_of_them(whole, monkeypatch) -> None:
    a, b = whole[0], prepare(House().part(slice(0, 400), slice(0, 260), np.zeros(3)), 0.05)
    every = judge_bent(a, b, straight(b, T_A_B), 0.15)
    monkeypatch.setattr(bending, "MOST_JUDGED", len(b.points))  # a subsample of a, all of b
    assert len(a.points) > 1.3 * len(b.points)
    for judged, exact in zip(judge_bent(a, b, straight(b, T_A_B), 0.15), every, strict=True):
        np.testing.assert_allclose(judged, exact, rtol=0.05, atol=1.0)


def test_the_nodes_of_a_long_map_lie_farther_apart_and_are_no_more(whole) -> None:
    long = House().part(slice(0, 400), slice(0, 520), np.zeros(3))
    large = prepare(OccupancyGrid(long.cells, 0.2, long.origin_m), 0.2)  # 104 m
    lattice = straight(large, T_A_B)
    assert max(lattice.nodes.shape) == bending.MOST_NODES + 1
    assert lattice.spacing_m == pytest.approx(np.ptp(large.points, axis=0).max() / bending.MOST_NODES)
    assert straight(whole[1], T_A_B).spacing_m == bending.SPACING_M
