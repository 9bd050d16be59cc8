"""The distinct places that candidates lead to, best first."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.alignment import AlignmentConfig, Candidate
from mrslam.alignment.prepared import PreparedMap, prepare
from mrslam.alignment.verification import fits as fits_module
from mrslam.alignment.verification.fits import fits_of, margin_over, rivalry, slid
from mrslam.alignment.verification.verify import Case, examine
from mrslam.spatial import OccupancyGrid, se2

Pair = tuple[OccupancyGrid, OccupancyGrid, se2.Transform]
Sides = tuple[PreparedMap, PreparedMap]


def off(truth: se2.Transform, x: float, y: float = 0.0) -> Candidate:
    return Candidate(truth + np.array([x, y, 0.0]))


def test_candidates_of_one_place_are_one_fit_and_the_best_comes_first(sides: Sides, pair: Pair) -> None:
    truth = pair[2]
    wrong, right = off(truth, 5.0, 3.0), off(truth, 0.1)
    found = fits_of(*sides, [wrong, right, off(truth, -0.1), off(truth, 0.3)], AlignmentConfig())
    assert [candidate for _, _, candidate in found] == [right, wrong]
    assert np.hypot(*(se2.apply(found[0][1], sides[1].centre) - se2.apply(truth, sides[1].centre))) < 0.03
    assert found[0][0].worth() > 3.0 * found[1][0].worth()


def test_no_more_fits_than_asked_for_are_refined(sides: Sides, pair: Pair) -> None:
    many = [off(pair[2], 1.5 * k) for k in range(6)]
    assert len(fits_of(*sides, many, AlignmentConfig(max_candidates=3))) == 3


def test_the_best_is_refined_on_all_walls(sides: Sides, pair: Pair, monkeypatch: pytest.MonkeyPatch) -> None:
    def found() -> se2.Transform:
        return fits_of(*sides, [off(pair[2], 0.1)], AlignmentConfig())[0][1]

    on_all = found()
    monkeypatch.setattr(fits_module, "THINNED", 60)
    thinned = found()
    assert np.hypot(*(thinned - on_all)[:2]) < 0.002
    monkeypatch.setattr(fits_module, "FINE", ())
    assert np.hypot(*(found() - on_all)[:2]) > 0.002


def corridor() -> PreparedMap:
    cells = np.full((60, 400), 0, dtype=np.int8)
    cells[[0, -1]] = 100
    cells[20:40, 0] = 100
    return prepare(OccupancyGrid(np.pad(cells, 5, constant_values=-1), 0.05), 0.05)


def test_a_fit_is_slid_along_its_walls_and_not_across() -> None:
    one = corridor()
    fit = examine(one, one, se2.IDENTITY, 0.15)
    cases = slid(one, one, fit, 0.15)
    assert len(cases) == 6 and min(case.matched_m for case in cases) > 30.0
    assert margin_over(cases, fits_module._case(one, one, se2.IDENTITY, 0.15)) < 0.3


CLEAN = Case(matched_m=50.0, opposed_m=0.0, contradicted_m=0.0, free_m2=100.0)


def test_the_cleaner_the_best_fit_the_more_a_rivals_contradictions_count_but_never_all() -> None:
    stained = Case(matched_m=50.0, opposed_m=0.0, contradicted_m=4.0, free_m2=100.0)
    rival = Case(matched_m=40.0, opposed_m=0.0, contradicted_m=2.0, free_m2=80.0)
    assert rivalry(stained, rival) > rivalry(CLEAN, rival)
    usual = rival.worth() / CLEAN.worth()
    assert 0.78 * usual - 1e-9 <= rivalry(CLEAN, rival) < 0.9 * usual
    dirty = Case(matched_m=45.0, opposed_m=0.0, contradicted_m=6.0, free_m2=90.0)
    assert rivalry(CLEAN, dirty) == pytest.approx(0.78 * dirty.worth() / CLEAN.worth())
