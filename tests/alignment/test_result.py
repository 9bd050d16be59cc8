"""What a prior may say."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.alignment import Prior
from mrslam.spatial import InputError, se2

TURNED = np.diag([0.1, 0.2, 0.3])
TURNED[0, 1] = 0.05


@pytest.mark.parametrize(
    ("T_a_b", "covariance", "message"),
    [
        (np.zeros(2), np.eye(3), "three finite numbers"),
        (np.array([0.0, np.nan, 0.0]), np.eye(3), "three finite numbers"),
        (se2.IDENTITY, np.eye(2), r"3 x 3 finite numbers, got shape \(2, 2\)"),
        (se2.IDENTITY, np.diag([1.0, np.inf, 1.0]), "3 x 3 finite numbers"),
        (se2.IDENTITY, TURNED, "symmetric and not negative"),
        (se2.IDENTITY, np.diag([1.0, -0.1, 1.0]), "symmetric and not negative"),
    ],
)
def test_a_prior_that_makes_no_sense_is_refused(T_a_b: np.ndarray, covariance: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Prior(T_a_b, covariance)


def test_a_prior_may_be_certain() -> None:
    assert not Prior(se2.IDENTITY, np.zeros((3, 3))).covariance.any()
