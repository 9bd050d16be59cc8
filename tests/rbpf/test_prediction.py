"""What the mapper makes of odometry."""

from __future__ import annotations

import numpy as np
import pytest

from rbpf.matching import BLIND, INLIERS, RESULT_SIZE
from rbpf.prediction import Predictor


def seen(blind: float = 0.0) -> np.ndarray:
    match = np.zeros(RESULT_SIZE)
    match[INLIERS], match[BLIND] = 1.0, blind
    return match


def test_odometry_off_by_a_factor_is_put_right() -> None:
    predictor = Predictor(0.1)
    for found, told in (((0.0, 0.0, 0.05), (0.0, 0.0, 0.06)), ((0.1, 0.0, 0.0), (0.08, 0.0, 0.0))):
        for _ in range(400):
            predictor.learn(np.array(found), np.array(told), seen())
    motion, spread, slip = predictor.predict(np.array([0.16, 0.0, 0.0]))
    assert motion[0] == pytest.approx(0.2, rel=0.03)
    assert predictor.gains[1] == pytest.approx(0.05 / 0.06, rel=0.03)
    assert slip < 0.06 and spread[0] < 0.05


def test_nothing_is_learnt_along_a_direction_that_is_not_seen() -> None:
    predictor = Predictor(0.1)
    for _ in range(300):
        predictor.learn(np.array([0.01, 0.0, 0.0]), np.array([0.1, 0.0, 0.0]), seen(blind=1.0))
    motion, _, slip = predictor.predict(np.array([0.1, 0.0, 0.0]))
    assert motion[0] == pytest.approx(0.1) and slip == pytest.approx(0.1)


def test_odometry_that_is_always_wrong_gives_way_to_steady_motion() -> None:
    predictor = Predictor(0.1)
    for _ in range(300):
        predictor.learn(np.array([0.1, 0.0, 0.0]), np.array([-0.1, 0.0, 0.0]), seen())
    motion, _, slip = predictor.predict(np.array([-0.1, 0.0, 0.0]))
    assert motion[0] == pytest.approx(0.1) and slip == 1.0


def test_a_jump_offers_the_motion_before_instead() -> None:
    predictor = Predictor(0.1)
    for _ in range(50):
        predictor.learn(np.array([0.1, 0.0, 0.0]), np.array([0.1, 0.0, 0.0]), seen())
    calm = np.array([0.12, 0.0, 0.0])
    assert predictor.otherwise(calm, predictor.predict(calm)[0]) is None
    jump = np.array([1.0, 0.5, 0.0])
    other = predictor.otherwise(jump, predictor.predict(jump)[0])
    assert other is not None and other[0][0] == pytest.approx(0.1) and other[2] == 1.0
    assert predictor.otherwise(None, jump) is None
    far = np.array([50.0, 0.0, 0.0])
    assert predictor.predict(far)[0][0] == pytest.approx(0.1)
