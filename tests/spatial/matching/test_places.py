"""Places seen before: what counts as a match, and where it is searched for."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.spatial import se2
from mrslam.spatial.matching.gauss_newton import Match
from mrslam.spatial.matching.places import (
    EDGE_SIGMA,
    FAR_MOST_M,
    NEAR_M,
    VERY_CLEAR,
    Place,
    PlaceMatcher,
    edge_information,
    fits,
    is_seen_all_round,
    within_m,
)
from tests.rbpf.rooms import drive, keyframe

KEYS = drive(24)
NEW = 6
"""The keyframe whose scan is matched with a place around it."""


def found(inliers: float, conflicts: float, information: NDArray[np.float64] | None = None) -> Match:
    information = np.eye(3) if information is None else information
    return Match(np.zeros(3), -0.5, inliers, conflicts, information, 0.0, np.array([1.0, 0.0]))


@pytest.mark.parametrize(
    ("inliers", "conflicts", "more", "enough"),
    [
        (0.6, 0.02, 0.0, True),
        (0.4, 0.0, 0.0, False),  # too little in common
        (0.6, 0.2, 0.0, False),  # walls where the place's map has floor
        (0.6, 0.02, VERY_CLEAR, False),
        (0.9, 0.0, VERY_CLEAR, True),
    ],
)
def test_a_match_needs_overlap_and_no_contradiction(
    inliers: float, conflicts: float, more: float, enough: bool
) -> None:
    assert fits(found(inliers, conflicts), more) == enough


def test_more_drift_brings_more_within_reach_up_to_a_bound() -> None:
    assert within_m(0.0) == NEAR_M < within_m(50.0) < within_m(1e6) == FAR_MOST_M


def test_an_edge_is_loose_where_no_wall_was_seen_and_never_surer_than_the_laser() -> None:
    blind = edge_information(found(0.9, 0.0, np.diag([0.0, 1e9, 1e9])))
    assert blind[0, 0] < 0.011 and blind[1, 1] == pytest.approx(EDGE_SIGMA[1] ** -2, rel=1e-2)
    twice = [edge_information(found(0.9, 0.0, n * np.diag([1e3, 1e3, 1e3])))[0, 0] for n in (1.0, 2.0)]
    assert twice[1] == pytest.approx(2.0 * twice[0], rel=0.01)  # far from the bounds it is proportional


@pytest.mark.parametrize(("along", "is_seen"), [(0.0, False), (100.0, False), (1e5, True)])
def test_a_corridor_does_not_show_how_far_the_robot_has_drifted_along_it(along: float, is_seen: bool) -> None:
    edge = edge_information(found(0.9, 0.0, np.diag([1e6, along, 1e6])))
    assert is_seen_all_round(edge) == is_seen
    assert is_seen_all_round(np.array([edge, 1e6 * np.eye(3)])).tolist() == [is_seen, True]


def compared(off: tuple[float, float, float], lost_m: float) -> tuple[Match, NDArray[np.float64]]:
    """Match the scan of one keyframe with the place of the others, expected ``off``; return it, and the true pose."""
    scans = [keyframe(np.zeros(3), T, np.random.default_rng(k)).beams.points for k, T in enumerate(KEYS)]
    others = [k for k in range(12) if k != NEW]
    place = Place(np.zeros((len(others), 2)), se2.between(KEYS[2], KEYS[others]), [scans[k] for k in others])
    true = se2.between(KEYS[2], KEYS[NEW])
    return PlaceMatcher(0.05, 0.03).match(place, scans[NEW], true + np.array(off), lost_m), true


@pytest.mark.parametrize(
    ("off", "lost_m"), [((0.05, -0.03, 0.01), 0.0), ((0.6, -0.5, 0.08), 0.0), ((-1.6, 1.2, 0.2), 60.0)]
)
def test_a_place_is_found_as_far_away_as_drift_may_have_put_it(off: tuple[float, float, float], lost_m: float) -> None:
    match, true = compared(off, lost_m)
    away_m, turned_rad = se2.difference(match.pose, true)
    assert fits(match) and away_m < 0.02 and turned_rad < 0.005


def test_nothing_is_searched_for_beyond_what_may_have_drifted() -> None:
    assert not fits(compared((-1.6, 1.2, 0.2), 0.0)[0])
