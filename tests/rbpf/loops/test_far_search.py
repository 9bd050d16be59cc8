"""Places that are seen again far from where drift has put the robot."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.rbpf import MapperConfig
from mrslam.rbpf.front_end.motion import ARRIVAL_COLUMNS, chain_cov
from mrslam.rbpf.loops.drift import (
    LEVER,
    REACH_MOST_M,
    REACH_SIGMAS,
    TURN_MOST_RAD,
    TURN_SIGMAS,
    Drift,
    drift_from_newest,
    most,
)
from mrslam.rbpf.loops.far_search import FarSearch
from mrslam.rbpf.loops.guesses import Fit, Guess
from mrslam.rbpf.loops.loop_closer import LoopCloser
from mrslam.spatial import se2
from mrslam.spatial.matching.gauss_newton import Match
from tests.rbpf.rooms import drive, keyframe

ROUND = drive(24)
OUTSIDE = 40
"""Keyframes on the way outside, where nothing is seen."""
BLIND_M = 0.8
"""Error of each motion there."""


def tour(
    rooms: list[NDArray[np.float64]], keys: int, blind_m: tuple[float, ...]
) -> tuple[LoopCloser, NDArray[np.float64], list[int]]:
    """Drive through rooms that look the same, each at ``T_map_room (3,)`` by the trajectory.

    ``keys`` : number of keyframes in the last. ``blind_m`` : error of each motion outside, after the other rooms.

    Return the loop closer, the trajectory ``(K, 3)``, and the keyframes at which it found itself contradicted.
    """
    config = MapperConfig(threads=1)
    loops = LoopCloser(config)
    poses, arrivals, contradicted, before = [], [], [], np.zeros(3)
    for n, T_map_room in enumerate(rooms):
        inside = np.resize(ROUND, (keys if n == len(rooms) - 1 else len(ROUND), 3))
        outside = np.tile(inside[-1], (OUTSIDE if n < len(rooms) - 1 else 0, 1))
        for k, truth in enumerate(np.concatenate([inside, outside])):
            is_inside = k < len(inside)
            key = keyframe(np.zeros(3), truth, np.random.default_rng(100 * n + k) if is_inside else None)
            poses.append(se2.compose(poses[-1], se2.between(before, truth)) if k else se2.compose(T_map_room, truth))
            before = truth
            row = np.zeros(ARRIVAL_COLUMNS)
            row[0], row[3], row[4] = 0.6, 0.6, 0.0 if is_inside else blind_m[n]
            arrivals.append(row)
            loops.add_key(key.beams, 0.6)
            if loops.look(np.stack(poses), np.stack(arrivals)):
                contradicted.append(len(poses) - 1)
                trajectory = loops.relaxed(np.stack(poses), np.linalg.inv(chain_cov(config, np.stack(arrivals))))
                poses = list(trajectory)
    return loops, np.stack(poses), contradicted


@pytest.mark.parametrize("off", [(9.0, -6.0, 0.3), (-11.0, 2.0, -0.25)])
def test_a_place_is_found_again_beyond_what_is_near(off: tuple[float, float, float]) -> None:
    loops, trajectory, contradicted = tour([np.zeros(3), np.array(off)], 72, (BLIND_M,))
    assert len(contradicted) >= 1 and loops.edges >= 5
    away = np.hypot(*(trajectory[-24:] - ROUND)[:, :2].T)  # the last round lies on the first
    assert away.max() < 0.15


def test_of_two_rooms_that_look_the_same_neither_is_believed() -> None:
    rooms = [np.zeros(3), np.array([0.0, 16.0, 0.0]), np.array([9.0, 7.0, 0.2])]
    loops, _, contradicted = tour(rooms, 72, (0.0, BLIND_M))
    third = 2 * (len(ROUND) + OUTSIDE)
    old, new = loops.as_edges()[:2]
    assert contradicted == [] and not ((old < third) & (new >= third)).any()


def test_drift_is_what_adds_up_along_the_shortest_way() -> None:
    keys = 60
    cov = np.tile(np.diag([0.02**2, 0.03**2, 0.01**2]), (keys, 1, 1))
    way_m = 0.5 * np.arange(keys)
    for loops, steps in ((np.empty((0, 2), np.int64), np.arange(keys)[::-1]), (np.array([[10, 55]]), None)):
        reach_m, turn_rad = drift_from_newest(way_m, cov, loops)
        if steps is None:  # over the loop from keyframe 55 back to 10
            steps = np.minimum(np.arange(keys)[::-1], 4 + np.abs(np.arange(keys) - 10))
        assert np.allclose(turn_rad, TURN_SIGMAS * 0.01 * np.sqrt(steps), atol=1e-3)
        variance = steps * (0.02**2 + 0.03**2) + steps * 0.01**2 * (LEVER * 0.5 * steps) ** 2
        assert np.allclose(reach_m, REACH_SIGMAS * np.sqrt(variance), atol=1e-3)


def test_places_are_looked_for_no_farther_than_drift_takes_a_robot() -> None:
    drift = most(np.array([3.0, 1e4]), np.array([0.1, 3.0]))
    assert drift == (REACH_MOST_M, TURN_MOST_RAD) and not drift.is_unknown
    assert most(np.array([3.0, 1.0]), np.array([0.1, 0.2])) == (3.0, 0.2)


@pytest.mark.parametrize(
    ("fits", "span_m", "log_weight", "is_believed"),
    [(5, 6.0, 9.0, True), (4, 6.0, 9.0, False), (5, 4.0, 9.0, False), (5, 6.0, 1.0, False)],
)
def test_a_place_is_believed_on_five_fits_over_five_metres_that_leave_no_doubt(
    monkeypatch: pytest.MonkeyPatch, fits: int, span_m: float, log_weight: float, is_believed: bool
) -> None:
    monkeypatch.setattr(FarSearch, "_is_ambiguous", lambda *_: False)
    far = LoopCloser(MapperConfig(threads=1))._far
    T_map_key = np.zeros((fits, 3))
    T_map_key[:, 0] = np.linspace(0.0, span_m, fits)
    match = Match(np.zeros(3), -0.3, 1.0, 0.0, np.eye(3), 0.0, np.array([1.0, 0.0]))
    far.guesses = [Guess([Fit(0, k, match) for k in range(fits)], 0, log_weight)]
    believed = far._believed(T_map_key, np.array([0]), Drift(10.0, 0.3))
    assert len(believed) == (fits if is_believed else 0)


@pytest.mark.parametrize("agrees", [False, True])
def test_a_place_is_believed_along_a_corridor_where_what_is_seen_agrees(
    monkeypatch: pytest.MonkeyPatch, agrees: bool
) -> None:
    monkeypatch.setattr(FarSearch, "_is_ambiguous", lambda *_: False)
    far = LoopCloser(MapperConfig(threads=1))._far
    T_map_key = np.zeros((9, 3))
    T_map_key[:, 0] = np.arange(9.0)
    match = Match(np.zeros(3), -0.3, 1.0, 0.0, np.eye(3), 0.0, np.array([1.0, 0.0]))
    far.guesses = [Guess([Fit(0, k, match) for k in range(6)], 0, 9.0, agrees=agrees)]  # three were along a corridor
    believed = far._believed(T_map_key, np.array([0]), Drift(10.0, 0.3))
    assert [fit.new for fit in believed] == (list(range(6)) if agrees else [])


def test_two_histories_that_come_to_one_place_are_followed_as_one(monkeypatch: pytest.MonkeyPatch) -> None:
    loops, trajectory, _ = tour([np.zeros(3), np.array([9.0, -6.0, 0.3])], 20, (BLIND_M,))
    far, newest = loops._far, len(trajectory) - 1
    fit = Fit(3, newest - 8, Match(np.zeros(3), 0.0, 1.0, 0.0, np.eye(3), 0.0, np.array([1.0, 0.0])))
    one, two = Guess([fit], 0, 5.0), Guess([fit, fit], 0, 5.1)
    two.fits[-1] = fit._replace(found=fit.found._replace(pose=np.array([0.2, -0.1, 0.02])))
    far.guesses = [one, two]
    monkeypatch.setattr(far, "_believed", lambda *_: [])
    far.look(trajectory, np.arange(24), Drift(20.0, 0.5))
    assert far.guesses == [two]
