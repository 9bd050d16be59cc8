"""Which matches far from where odometry leads are believed."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.rbpf.front_end import local_matcher
from mrslam.rbpf.front_end.local_matcher import LocalMatcher
from mrslam.rbpf.front_end.prediction import DISBELIEVED, Guess
from mrslam.spatial.hits.views import Tiles
from mrslam.spatial.matching.correlative import Found
from mrslam.spatial.matching.gauss_newton import Match
from tests.rbpf.rooms import seen_room

START = np.zeros(3)


@pytest.mark.parametrize(
    ("off_m", "better", "slip", "is_taken"),
    [
        (0.31, 0.13, 0.05, False),  # half of the scan is another robot, and fits where that was before
        (0.31, 0.28, 0.05, True),  # odometry missed a jolt
        (0.31, 0.13, 2.0 * DISBELIEVED, True),  # nothing says that the robot is not there
        (0.02, 0.13, 0.05, True),  # hardly off: as odometry errs
    ],
)
def test_a_place_far_from_where_good_odometry_leads_must_fit_clearly_better(
    monkeypatch: pytest.MonkeyPatch, off_m: float, better: float, slip: float, is_taken: bool
) -> None:
    there = np.array([0.0, off_m, 0.0])

    def match(tiles: Tiles, points: np.ndarray, start: np.ndarray, *_: object) -> Match:
        is_there = start[1] == off_m
        score, inliers = (-0.27 + better, 0.9) if is_there else (-0.27, 0.93)
        return Match(start.copy(), score, inliers, 0.0, np.eye(3), 0.0, np.array([1.0, 0.0]))

    def search(tiles: Tiles, points: np.ndarray, centre: np.ndarray, lattice: object, crew: object) -> Found:
        is_far = getattr(lattice, "turn_step_rad") == local_matcher.FAR_STEP_RAD  # noqa: B009
        return Found(there if is_far else centre, 0.0, 0)

    monkeypatch.setattr(local_matcher, "match", match)
    monkeypatch.setattr(local_matcher, "search", search)
    store, points = seen_room()
    matcher = LocalMatcher(0.03)
    matcher.usual_score = -0.11
    guess = Guess(motion=np.array([0.05, 0.0, 0.0]), sigma_m=0.009, sigma_rad=0.01, slip=slip)
    found = matcher.match(store.tiles(0), points, START, guess)
    assert (found.pose[1] == off_m) == is_taken
