"""When wheels contradict what a saved map shows."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.rbpf.front_end.prediction import Predictor
from mrslam.rbpf.localise.fit import Fit
from mrslam.rbpf.localise.localiser import Localiser
from mrslam.rbpf.localise.wheels import WheelsCheck
from mrslam.spatial.matching.gauss_newton import Match
from tests.rbpf.localise.test_localiser import begun, drive, house, way

ON = np.array([0.22, 0.0, 0.0])
TURN = np.array([0.0, 0.0, 0.11])
STOOD = np.zeros(3)


def fitting(inliers: float, conflicts: float) -> Match:
    return Match(np.zeros(3), -1.0, inliers, conflicts, np.eye(3), 0.0, np.zeros(2))


IN_PART = fitting(0.5, 0.45)


def told(
    matched: NDArray[np.float64],
    odom: NDArray[np.float64] | None,
    found: Match = IN_PART,
    predictor: Predictor | None = None,
    count: int = 10,
    check: WheelsCheck | None = None,
) -> list[int]:
    """Return after which of so many equal scans, half a second apart, the wheels were found to contradict."""
    check, predictor = check or WheelsCheck(), predictor or Predictor(0.1)
    return [k for k in range(1, count + 1) if check.follow(matched, odom, 0.5, found, predictor)]


def test_wheels_that_drive_on_while_the_match_stays_contradict_it_at_every_metre() -> None:
    assert told(STOOD, ON) == [5, 10]
    assert told(STOOD, TURN, count=14) == [6, 12]
    assert told(ON, STOOD) == [5, 10]  # and a match that runs away from wheels that stand


def test_matches_that_follow_the_wheels_by_half_are_none() -> None:
    assert told(0.5 * ON, ON) == told(0.5 * TURN, TURN) == told(ON, ON) == []


def test_where_a_scan_fits_well_the_wheels_are_wrong() -> None:
    assert told(STOOD, ON, fitting(0.8, 0.1)) == told(STOOD, ON, fitting(0.4, 0.1)) == []
    check = WheelsCheck()
    told(STOOD, ON, count=4, check=check)
    told(STOOD, ON, fitting(0.8, 0.1), count=1, check=check)
    assert told(STOOD, ON, check=check) == [5, 10]


def test_half_a_turn_is_one_whichever_way_it_is_told() -> None:
    check, left, right = WheelsCheck(), np.array([0.0, 0.0, 3.05]), np.array([0.0, 0.0, -3.1])
    assert not check.follow(right, left, 4.0, IN_PART, Predictor(0.1))
    assert check.follow(STOOD, left, 4.0, IN_PART, Predictor(0.1))


def slipping() -> Predictor:
    predictor = Predictor(0.1)
    predictor.odometry.slip = 0.7
    return predictor


def dead() -> Predictor:
    predictor = Predictor(0.1)
    predictor.odometry.dead_scans = 100
    return predictor


def after_pause() -> Predictor:
    predictor = Predictor(0.1)
    for elapsed_s in (0.1, 0.1, 10.0):
        predictor.wait(elapsed_s)
    return predictor


@pytest.mark.parametrize("predictor", [slipping(), dead(), after_pause()], ids=["slipping", "dead", "after a pause"])
def test_wheels_that_nobody_believes_contradict_nothing(predictor: Predictor) -> None:
    assert told(STOOD, ON, predictor=predictor) == []


def test_nor_does_a_leap_or_no_odometry() -> None:
    assert told(STOOD, np.array([4.0, 0.0, 0.0])) == told(STOOD, None) == []


def test_wheels_are_corrected_by_what_was_learnt_of_them() -> None:
    predictor = Predictor(0.1)
    predictor.odometry.gains[0] = 0.25
    assert told(0.25 * ON, ON, predictor=predictor, count=25) == []


def test_two_metres_of_contradiction_lose_a_robot_that_was_sure() -> None:
    fit = Fit()
    fit.contradict()
    assert not fit.is_lost
    fit.contradict()
    assert fit.is_lost


def test_the_localiser_asks_its_wheels(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def follow(_: WheelsCheck, matched: np.ndarray, odom_motion: np.ndarray, *rest: object) -> bool:
        asked.append((matched, odom_motion))
        return True

    monkeypatch.setattr(WheelsCheck, "follow", follow)
    localiser = driven()
    for matched, odom_motion in asked:
        assert matched == pytest.approx(odom_motion, abs=0.06)
    assert len(asked) >= 2 and localiser.fit.is_lost


def driven() -> Localiser:
    localiser = begun(house())
    drive(localiser, house(), way(12))
    return localiser
