"""Which of several ways to have moved the front end takes."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.front_end.front_end import FrontEnd
from mrslam.rbpf.front_end.motion import GUESSED, MOTION, LocalMotion, chain_cov, motion_cov
from mrslam.rbpf.front_end.prediction import Guess
from mrslam.spatial.matching.gauss_newton import Match
from mrslam.spatial.poses import compose
from tests.rbpf.rooms import seen_room

STALLED, CAUGHT_UP, MOVED = np.zeros(3), np.array([0.66, 0.0, 0.0]), np.array([0.22, 0.0, 0.0])


class Scripted(FrontEnd):
    """A front end whose matches score as they are told to: steps of 0.22 m fit so well, any others so badly."""

    moved_score, other_score, moved_inliers, other_blind = -0.2, -0.7, 0.9, 0.0

    def _match(self, points: np.ndarray, guess: Guess) -> Match:
        fits = abs(guess.motion[0] - MOVED[0]) < 0.1
        score, inliers = (self.moved_score, self.moved_inliers) if fits else (self.other_score, 0.55)
        place = compose(self.T_local_base, MOVED if fits else guess.motion)
        blind = 0.0 if fits else self.other_blind
        return Match(place, score, inliers, 0.0, np.eye(3), blind, np.array([1.0, 0.0]))


def driven() -> tuple[Scripted, np.ndarray]:
    """A front end that took 40 scans of a room, and their points ``(N, 5)``."""
    _, points = seen_room()
    front_end = Scripted(MapperConfig(particles=1, threads=1))
    for k in range(40):
        front_end.step(points, points, None if k == 0 else MOVED, 0.2, np.zeros(2))
    return front_end, points


@pytest.mark.parametrize(
    ("score", "inliers", "blind", "taken_m"),
    [
        (-0.2, 0.9, 0.0, 0.22), (-0.5, 0.9, 0.0, 0.22), (-0.66, 0.9, 0.0, 0.66), (-0.5, 0.1, 0.0, 0.66),
        (-0.66, 0.9, 0.4, 0.22), (-0.74, 0.9, 0.4, 0.66),
    ],
    ids=[
        "as usual", "clearly better, in new surroundings", "hardly better", "better, for it lies where nothing is",
        "hardly better, and no wall shows how far the wheels leapt", "worse, though no wall shows it",
    ],
)  # fmt: skip
def test_where_the_wheels_leap_another_way_to_move_is_taken_if_it_fits_clearly_better(
    score: float, inliers: float, blind: float, taken_m: float
) -> None:
    front_end, points = driven()
    front_end._matcher.usual_score = -0.2
    front_end.step(points, points, STALLED, 0.2, np.zeros(2))
    front_end.moved_score, front_end.moved_inliers, front_end.other_blind = score, inliers, blind
    step = front_end.step(points, points, CAUGHT_UP, 0.2, np.zeros(2))
    assert step.T_before_base[0] == pytest.approx(taken_m, abs=0.05)


@pytest.mark.parametrize(
    ("shown_m", "score", "inliers", "begins_again"),
    [(0.22, -0.7, 0.8, False), (0.22, -0.7, 0.3, True), (0.9, -0.7, 0.8, True), (0.9, -0.2, 0.9, False)],
    ids=[
        "it fits there, if worse than usual", "nothing fits", "it fits elsewhere, worse than usual",
        "it fits elsewhere as usual",
    ],
)  # fmt: skip
def test_a_place_that_the_whole_map_shows_is_taken_where_the_rolling_map_does_not_reach_it(
    shown_m: float, score: float, inliers: float, begins_again: bool
) -> None:
    front_end, points = driven()
    before, shown = front_end.T_local_base.copy(), np.array([shown_m, 0.0, 0.0])
    front_end.moved_score, front_end.moved_inliers = score, inliers
    step = front_end.step(points, points, MOVED, 30.0, np.zeros(2), shown=shown)
    assert (front_end.newest is None) == begins_again and not step.is_carried
    taken = shown if begins_again else MOVED
    assert step.T_before_base == pytest.approx(taken) and front_end.T_local_base == pytest.approx(before + taken)
    assert len(front_end.state()["map"]["scans"]) == 1 or not begins_again


def test_a_robot_put_down_nobody_knows_where_begins_another_rolling_map_there() -> None:
    front_end, points = driven()
    step = front_end.put_down(points, 30.0, np.zeros(2))
    assert step.is_carried and not step.T_before_base.any() and front_end.predictor.is_after_pause
    assert len(front_end.state()["map"]["scans"]) == 1


@pytest.mark.parametrize(("inliers", "is_guessed"), [(0.9, False), (0.3, True)])
def test_a_motion_whose_scan_fits_nothing_is_as_uncertain_as_its_prediction(inliers: float, is_guessed: bool) -> None:
    _, points = seen_room()

    class Fits(FrontEnd):
        def _match(self, points: np.ndarray, guess: Guess) -> Match:
            place = compose(self.T_local_base, guess.motion)
            return Match(place, -0.2, inliers, 0.0, np.eye(3), 0.0, np.array([1.0, 0.0]))

    config = MapperConfig(particles=1, threads=1)
    front_end, motion = Fits(config), LocalMotion()
    for k in range(3):
        motion.add(front_end.step(points, points, None if k == 0 else MOVED, 0.2, np.zeros(2)))
    arrival = motion.restart(0)
    cov, seen = chain_cov(config, arrival[None])[0], motion_cov(config, arrival[MOTION], np.zeros(2))
    assert (np.diag(cov - seen) > np.square([0.02, 0.02, 0.01])).all() == is_guessed
    assert (cov == seen).all() == (not is_guessed)
    assert not motion.restart(0)[GUESSED].any()


def test_a_robot_carried_while_its_laser_was_off_is_not_carried_again_at_the_next_scan() -> None:
    front_end, here = driven()
    there = here.copy()
    there[:, :2] *= 0.5  # another room
    assert front_end.step(there, there, STALLED, 30.0, np.zeros(2)).is_carried
    front_end.step(there, there, STALLED, 0.2, np.zeros(2))  # hardly fits what little was seen there
    assert front_end.state()["elsewhere"] is None


@pytest.mark.parametrize(
    ("fits_often", "before", "replaced", "is_carried"),
    [(True, 60, 0.4, True), (False, 60, 0.4, False), (False, 60, 1.0, True), (False, 61, 1.0, False)],
    ids=[
        "a scan that fits badly is rare", "scans often fit badly", "they do, and nothing is where it was",
        "they do, and the last one before the pause did",
    ],
)  # fmt: skip
def test_a_scan_that_fits_badly_after_a_pause_says_less_where_many_do(
    fits_often: bool, before: int, replaced: float, is_carried: bool
) -> None:
    _, here = seen_room()
    changed = here.copy()
    changed[: round(replaced * len(here)), :2] *= 0.5  # something stands before the walls
    front_end = Scripted(MapperConfig(particles=1, threads=1))
    for k in range(before):
        fits = fits_often or k % 3 > 0
        front_end.moved_score, front_end.moved_inliers = (-0.2, 0.9) if fits else (-0.7, 0.55)
        front_end.step(here, here, None if k == 0 else MOVED, 0.2, np.zeros(2))
    resumed = Scripted(MapperConfig(particles=1, threads=1))
    resumed.restore(front_end.state())
    for one in (front_end, resumed):
        assert one.step(changed, changed, STALLED, 30.0, np.zeros(2)).is_carried == is_carried
