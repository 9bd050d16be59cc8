"""Goals near each other are one attempt, so that a robot that takes two in turns gives up in the end."""

import numpy as np
import pytest

from mrslam.sim_driver.drivers.attempts import ARRIVED_M, Attempts


def test_places_within_the_radius_of_one_are_that_one_and_the_first_of_two_counts():
    attempts = Attempts(0.5)
    first, second = attempts.at(np.array([0.0, 0.0])), attempts.at(np.array([0.8, 0.0]))
    assert first is not second
    assert attempts.at(np.array([0.3, 0.3])) is first and attempts.at(np.array([0.8, 0.45])) is second
    assert attempts.at(np.array([0.41, 0.0])) is first  # near both
    assert attempts.at(np.array([-0.5, 0.0])) not in (first, second)
    attempts.clear()
    assert attempts.at(np.array([0.0, 0.0])) is not first


def test_time_counts_while_nothing_comes_nearer_and_threefold_at_the_goal():
    attempt = Attempts(0.5).at(np.array([1.0, 2.0]))
    assert [attempt.spend(1.5, way_m) for way_m in (3.0, 2.9, 2.9, 2.7)] == [0.0, 1.5, 3.0, 0.0]
    assert attempt.spend(1.0, ARRIVED_M - 0.01) == 0.0 and attempt.spend(1.0, ARRIVED_M - 0.02) == pytest.approx(3.0)
