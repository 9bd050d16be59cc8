import numpy as np
import pytest

from mrslam.alignment import Alignment, Evidence, StabilityCheck
from mrslam.spatial import InputError


def estimate(x: float = 0.0, y: float = 0.0, theta: float = 0.0, confidence: float = 0.7) -> Alignment:
    return Alignment(np.array([x, y, theta]), confidence, Evidence(), np.eye(3), "orb")


def test_first_estimate_is_not_believed_the_second_is():
    check = StabilityCheck()
    assert check.update(estimate()) is None
    second = estimate(0.1)
    assert check.update(second) is second


def test_jump_is_not_believed():
    check = StabilityCheck(max_dx_m=0.5)
    check.update(estimate())
    believed = check.update(estimate(0.1))
    assert check.update(estimate(5.0, confidence=0.99)) is believed


@pytest.mark.parametrize("far", [estimate(0.6), estimate(0.0, 0.6), estimate(0.0, 0.0, 0.2)])
def test_each_bound_counts(far):
    check = StabilityCheck(max_dx_m=0.5, max_dy_m=0.5, max_dtheta_rad=0.1)
    check.update(estimate())
    assert check.update(far) is None


def test_angle_bound_is_on_the_circle():
    check = StabilityCheck()
    check.update(estimate(theta=3.13))
    assert check.update(estimate(theta=-3.13)) is not None


def test_never_a_better_by_a_worse():
    check = StabilityCheck()
    check.update(estimate(confidence=0.8))
    best = check.update(estimate(0.01, confidence=0.8))
    assert check.update(estimate(0.02, confidence=0.6)) is best
    better = estimate(0.03, confidence=0.9)
    assert check.update(better) is better


def test_contradiction_revokes():
    check = StabilityCheck()
    check.update(estimate())
    check.update(estimate())
    check.contradicted()
    assert check.believed is None
    assert check.update(estimate()) is None, "one estimate is not enough after a revocation"


def test_bounds_must_be_positive():
    with pytest.raises(InputError, match=r"stability\.max_dx_m must be > 0"):
        StabilityCheck(max_dx_m=0.0)
