"""How far the pose can be believed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.rbpf.front_end.health import DOUBTFUL, LOST, Health
from mrslam.rbpf.front_end.motion import CARRIED, Agreement, Keyframe
from mrslam.spatial.hits.views import NO_ENDS, Beams


def key(unseen_m: float = 0.0, inliers: float = 1.0) -> Keyframe:
    arrival = np.array([0.5, 0.0, 0.0, 0.5, unseen_m, 0.0, 0.0])
    return Keyframe(beams=Beams(np.zeros(2), np.zeros((0, 5)), NO_ENDS), arrival=arrival, inliers=inliers)


def agreement(inliers: float, conflicts: float) -> Agreement:
    return Agreement(inliers=inliers, conflicts=conflicts)


def test_falls_while_scans_contradict_the_map_and_recovers() -> None:
    health = Health()
    for _ in range(10):
        health.follow(agreement(0.2, 0.8), key())
    assert health.value < 0.2
    for _ in range(10):
        health.follow(agreement(0.9, 0.05), key())
    assert health.value > 0.8


@pytest.mark.parametrize(("inliers", "least", "most"), [(0.9, 1.0, 1.0), (0.3, 0.0, 0.2)])
def test_where_the_map_knows_nothing_the_local_map_is_asked(inliers: float, least: float, most: float) -> None:
    health = Health()
    for _ in range(10):
        health.follow(agreement(0.0, 0.1), key(inliers=inliers))
    assert least - 1e-9 <= health.value <= most + 1e-9


def test_it_knows_which_share_of_beams_fits_the_map_usually() -> None:
    health = Health()
    for _ in range(30):
        health.follow(agreement(0.45, 0.45), key(unseen_m=0.5))
        health.follow(agreement(0.1, 0.05), key(inliers=0.9))  # new ground says nothing
    assert health.usual_fit == pytest.approx(0.5, abs=0.01)
    other = Health()
    other.restore(health.state())
    assert other.usual_fit == health.usual_fit


def test_way_covered_unseen_is_remembered_until_a_place_is_seen_again() -> None:
    health = Health()
    for _ in range(3):
        health.follow(agreement(1.0, 0.0), key(unseen_m=0.5))
    for _ in range(25):
        health.follow(agreement(1.0, 0.0), key())
    assert health.value == DOUBTFUL < 0.5  # all fits again, and still the robot may be 1.5 m off
    other = Health()
    other.restore(health.state())
    assert other.value == health.value
    health.anchor()
    assert health.value > 0.9


def test_a_little_unseen_of_a_long_way_is_no_doubt() -> None:
    health = Health()
    for _ in range(200):
        health.follow(agreement(1.0, 0.0), key(unseen_m=0.015))
    assert health.value > 0.9


@pytest.mark.parametrize("is_unconfirmed", [True, False])
def test_a_robot_that_was_carried_or_that_its_map_contradicts_is_lost_until_it_is_back(is_unconfirmed: bool) -> None:
    health, begin = Health(), replace(key(), is_unconfirmed=is_unconfirmed)
    begin.arrival[CARRIED] = not is_unconfirmed
    for there in [begin] + 50 * [key()]:
        health.follow(agreement(1.0, 0.0), there)
        assert health.value == LOST
    other = Health()
    other.restore(health.state())
    assert other.value == LOST
    health.anchor()
    health.follow(agreement(1.0, 0.0), key())
    assert health.value > 0.9
