"""Robots that see each other know where their maps lie; those that see someone else do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.mutual_detection import mutual_fix
from mrslam.mutual_detection.mutual import SIGMA_M
from mrslam.spatial import se2
from tests.mutual_detection.sights import moment, way
from tests.mutual_detection.test_encounters import CORRIDOR_Y, FRAMES, MATE, OWN, RIGHT, moments


def test_two_robots_that_see_each_other_find_the_transform_and_say_how_sure_they_are() -> None:
    fix = mutual_fix(moments())
    assert fix is not None and fix.moments >= 6
    off_m, off_rad = se2.difference(fix.T_map_mate, RIGHT)
    assert off_rad < 0.03
    apart = np.append((fix.T_map_mate - RIGHT)[:2], se2.wrap((fix.T_map_mate - RIGHT)[2]))
    assert apart @ np.linalg.solve(fix.covariance, apart) < 16.0 and off_m < 0.5


def test_few_moments_or_robots_that_stand_still_are_not_enough() -> None:
    assert mutual_fix([]) is None
    assert mutual_fix(moments()[:3]) is None
    stand = [moment(OWN[4], MATE[4], FRAMES, seed=k) for k in range(9)]
    assert mutual_fix(stand) is None
    mate_stands = [moment(a, MATE[4], FRAMES, seed=k) for k, a in enumerate(OWN)]
    assert mutual_fix(mate_stands) is None


def exact(picked: list[int], *, own_stands: bool = False) -> list:
    """Return some of the moments, in which each robot sees the other where it is."""
    chosen = [one for k, one in enumerate(moments()) if k in picked]
    if own_stands:
        chosen = [replace(one, T_map_base=chosen[0].T_map_base) for one in chosen]
    return [
        replace(one, bodies_m=one.place_m(RIGHT)[None], mate_bodies_m=one.mate_place_m(RIGHT)[None]) for one in chosen
    ]


def test_three_moments_are_not_enough_however_far_the_robots_drove_nor_are_many_on_little_way() -> None:
    assert mutual_fix(exact([0, 4, 8])) is None
    assert mutual_fix(exact([0, 3, 5, 8])) is not None
    assert mutual_fix(exact([0, 1, 2, 3, 4], own_stands=True)) is None  # the other drove 1.1 m
    assert mutual_fix(exact([0, 2, 4, 6, 8], own_stands=True)) is not None


def test_it_is_as_sure_as_half_of_the_bodies_are() -> None:
    """The two of one moment share the error of its time."""
    seen = exact(list(range(9)))
    fix = mutual_fix(seen)
    assert fix is not None
    points = np.array([T[:2] for one in seen for T in (one.T_map_base, se2.compose(RIGHT, one.T_mate_base))])
    around_m2 = np.sum(np.var(points, axis=0))
    assert np.sqrt(fix.covariance[2, 2]) == pytest.approx(SIGMA_M / np.sqrt(9 * around_m2), rel=1e-6)


@pytest.mark.parametrize("walks", [True, False])
def test_somebody_whom_both_see_is_not_the_teammate(walks: bool) -> None:
    middle = (
        np.array([OWN[k][:2] + MATE[k][:2] for k in range(9)]) / 2.0 if walks else np.full((9, 2), (6.6, CORRIDOR_Y))
    )
    # Both see the same person half way, at one distance, and their bodies are below each other's lasers.
    seen = [
        moment(a, b, FRAMES, [middle[k] + (0.0, 0.3 * np.sin(k))], seed=k, hidden=True)
        for k, (a, b) in enumerate(zip(OWN, MATE, strict=True))
    ]
    fix = mutual_fix(seen)
    assert fix is None or se2.difference(fix.T_map_mate, RIGHT)[0] < 0.5


def test_a_person_beside_does_not_disturb() -> None:
    person = way((5.0, CORRIDOR_Y + 0.45), (8.0, CORRIDOR_Y + 0.45), 9)
    seen = [moment(a, b, FRAMES, [p[:2]], seed=k) for k, (a, b, p) in enumerate(zip(OWN, MATE, person, strict=True))]
    fix = mutual_fix(seen)
    assert fix is not None and se2.difference(fix.T_map_mate, RIGHT)[1] < 0.05


def test_it_is_less_sure_of_a_map_whose_origin_is_far_from_where_the_robots_met() -> None:
    frames = (FRAMES[0], se2.transform(70.0, 4.0, -2.0))
    seen = [moment(a, b, frames, seed=k) for k, (a, b) in enumerate(zip(OWN, MATE, strict=True))]
    fix = mutual_fix(seen)
    assert fix is not None
    apart = fix.T_map_mate - se2.between(*frames)
    apart[2] = se2.wrap(apart[2])
    assert apart @ np.linalg.solve(fix.covariance, apart) < 16.0
    lever_m, turn_rad = 62.0, np.sqrt(fix.covariance[2, 2])
    assert np.sqrt(np.trace(fix.covariance[:2, :2])) == pytest.approx(lever_m * turn_rad, rel=0.1)


def test_however_far_the_maps_began_it_is_sure_of_where_the_robots_met() -> None:
    frames = (FRAMES[0], se2.transform(70.0, 4.0, -2.0))
    fix = mutual_fix([moment(a, b, frames, seed=k) for k, (a, b) in enumerate(zip(OWN, MATE, strict=True))])
    assert fix is not None
    met = se2.apply(se2.inverse(frames[0]), np.array([6.3, CORRIDOR_Y])) - fix.T_map_mate[:2]
    turns_with = np.array([[1.0, 0.0, -met[1]], [0.0, 1.0, met[0]]])
    assert np.sqrt(np.trace(turns_with @ fix.covariance @ turns_with.T)) < 0.1 < np.sqrt(fix.covariance[0, 0])


def test_of_two_transforms_that_bodies_suggest_the_one_that_most_moments_agree_on_is_taken() -> None:
    others = se2.compose(RIGHT, np.array([3.0, -1.0, 0.5]))  # by two people who walk along, seen from the 5th moment on
    for both in ((others, RIGHT), (RIGHT, others)):
        seen = [
            replace(
                one,
                bodies_m=np.array([one.place_m(T) for T in (both if k >= 4 else (RIGHT,))]),
                mate_bodies_m=np.array([one.mate_place_m(T) for T in (both if k >= 4 else (RIGHT,))]),
            )
            for k, one in enumerate(moments())
        ]
        fix = mutual_fix(seen)
        assert fix is not None and fix.moments == 9
        np.testing.assert_allclose(fix.T_map_mate, RIGHT, atol=1e-9)
