"""Keyframes from the first to a place seen again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.rbpf import MapperConfig
from mrslam.rbpf.filter.back_end import MOVED_M, WALLS_APART, BackEnd
from mrslam.rbpf.front_end.health import LOST
from mrslam.rbpf.outcome import Stopwatch
from mrslam.spatial import se2
from mrslam.spatial.matching.gauss_newton import Match
from mrslam.spatial.runtime.crew import Crew
from tests.rbpf.rooms import drive, keyframe

DRIFT = np.array([0.8, -0.5, 0.05])
"""Error of the way that was covered blind: more than matching from scan to scan can put right."""
ROUND = np.array([[0.0, 0.0, 0.0], *[[0.6, 0.0, 2.0 * np.pi / 24.0]] * 24])
"""Motions of a round outside of the room, 14 m, that lead back to where it began."""


def there_and_back(close_loops: bool) -> tuple[BackEnd, float, int]:
    """Drive in the room, around outside of it where nothing is seen, and in the room again.

    Return the back end, how far off it is at the end, and the number of keyframes that said a loop was closed.
    """
    back = BackEnd(MapperConfig(particles=4, threads=1, close_loops=close_loops), 1, Crew(1), Stopwatch())
    inside = drive(24)
    closed, before = 0, inside[0]
    for k, truth in enumerate(inside):
        closed += back.add(keyframe(se2.between(before, truth), truth, np.random.default_rng(k))).loop_closed
        before = truth
    for motion in ROUND[1:]:
        before = se2.compose(before, motion)
        closed += back.add(keyframe(motion, before, None, blind_m=0.3)).loop_closed
    for k, truth in enumerate(inside):
        motion = se2.between(before, truth) if k else se2.compose(se2.between(before, truth), DRIFT)
        closed += back.add(keyframe(motion, truth, np.random.default_rng(100 + k))).loop_closed
        before = truth
    off_m = float(np.hypot(*(back.filter.trajectory[-1] - inside[-1])[:2]))
    return back, off_m, closed


def test_a_place_seen_again_puts_the_trajectory_and_the_map_right() -> None:
    _, open_m, none = there_and_back(close_loops=False)
    assert none == 0 and open_m > 0.5
    back, closed_m, closed = there_and_back(close_loops=True)
    assert closed >= 1 and back.loops.edges >= 1
    assert closed_m < 0.1
    inside = drive(24)
    error = np.hypot(*(back.filter.trajectory[-24:] - inside)[:, :2].T)
    assert error.max() < 0.1  # what was driven before the loop closed was bent, too
    # One room, not two: beams of the last scans lie on the walls that the first ones drew.
    key = keyframe(np.zeros(3), inside[-1], np.random.default_rng(7))
    agreement = back.filter.move(key)
    assert agreement is not None
    assert agreement.inliers > 0.9


def test_a_loop_that_closed_does_away_with_doubt_about_blind_way() -> None:
    back, _, _ = there_and_back(close_loops=False)
    doubtful = back.add(keyframe(np.zeros(3), drive(24)[-1], np.random.default_rng(7))).health
    back, _, _ = there_and_back(close_loops=True)
    sure = back.add(keyframe(np.zeros(3), drive(24)[-1], np.random.default_rng(7))).health
    assert doubtful < 0.5 < sure


def test_fewer_particles_are_fewer_histories_too_and_stay_so_when_it_resumes() -> None:
    config = MapperConfig(particles=6, threads=1)
    back, again = (BackEnd(config, 1, Crew(1), Stopwatch()) for _ in range(2))
    assert back.loops.histories_most == 6
    back.use_particles(2)
    again.restore(back.state())
    for one in (back, again):
        assert (one.particles_most, one.loops.histories_most) == (2, 2)


def test_a_robot_that_lost_itself_trusts_only_places_seen_before_that(monkeypatch: pytest.MonkeyPatch) -> None:
    back, resumed = (BackEnd(MapperConfig(particles=1, threads=1), 1, Crew(1), Stopwatch()) for _ in range(2))
    seen_again: list[int] = []

    def look(robot: BackEnd, trajectory: np.ndarray) -> bool:
        for old in seen_again:
            there = se2.between(trajectory[old], trajectory[-1])
            robot.loops._add_edge(old, Match(there, 0.0, 1.0, 0.0, 1e4 * np.eye(3), 0.0, np.array([1.0, 0.0])))
        return False  # nothing to put right

    def health(robot: BackEnd, *places: int, blind_m: float = 0.0, is_unconfirmed: bool = False) -> float:
        seen_again[:] = places
        monkeypatch.setattr(robot.loops, "look", lambda trajectory, _: look(robot, trajectory))
        key = keyframe(np.array([blind_m, 0.0, 0.0]), np.zeros(3), np.random.default_rng(1), blind_m)
        return robot.add(replace(key, is_unconfirmed=is_unconfirmed)).health

    for _ in range(5):
        assert health(back) > 0.5
    assert health(back, is_unconfirmed=True) <= LOST and back.loops.scans.newest_start == 5  # the sixth
    assert health(back) <= LOST and health(back, 6) <= LOST and health(back, 5) <= LOST
    resumed.restore(back.state())
    for robot in (back, resumed):
        assert health(robot, 7) <= LOST and health(robot, 7, 4) > LOST
    lost_way = [health(back, blind_m=0.3) for _ in range(8)]
    assert lost_way[-1] < 0.5 and back._health.is_adrift
    health(back, 9)
    assert not back._health.is_adrift  # as before it was lost


def test_a_loop_along_a_corridor_does_away_with_no_doubt(monkeypatch: pytest.MonkeyPatch) -> None:
    back = BackEnd(MapperConfig(particles=1, threads=1), 1, Crew(1), Stopwatch())

    def add(*along: float) -> None:
        def look(trajectory: np.ndarray, _: np.ndarray) -> bool:
            for information in along:
                seen = np.diag([information, 1e4, 1e4])
                back.loops._add_edge(0, Match(np.zeros(3), 0.0, 1.0, 0.0, seen, 0.0, np.array([1.0, 0.0])))
            return False  # nothing to put right

        monkeypatch.setattr(back.loops, "look", look)
        back.add(keyframe(np.array([0.5, 0.0, 0.0]), np.zeros(3), np.random.default_rng(1), 0.5))

    add(), add(), add(), add()
    assert back._health.is_adrift
    add(0.0)
    assert back._health.is_adrift and not back.loops.anchors(0).size
    add(0.0, 1e4)
    assert not back._health.is_adrift and back.loops.anchors(0).tolist() == [0]
    add(), add(), add(), add()
    add(0.0)
    assert back._health.is_adrift and not back.loops.anchors(3).size


@pytest.mark.parametrize(
    ("bent_m", "is_drawn"),
    [(0.0, False), (0.5 * MOVED_M, False), (4.0 * MOVED_M, True)],
    ids=["turned", "hardly", "bent"],
)
def test_relaxation_that_turns_the_map_as_a_whole_draws_it_no_other_way(
    bent_m: float, is_drawn: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    back, _, _ = there_and_back(close_loops=True)
    before = back.filter.trajectory.copy()
    turned = se2.compose(np.array([0.3, -0.2, 0.1]), before)
    turned[len(turned) // 2, 1] += bent_m
    monkeypatch.setattr(back.loops, "relaxed", lambda *_: turned)
    assert back._relax() == is_drawn
    assert np.array_equal(back.filter.trajectory, turned if is_drawn else before)


def test_walls_are_believed_less_in_relaxation_for_their_errors_repeat(monkeypatch: pytest.MonkeyPatch) -> None:
    back, _, _ = there_and_back(close_loops=True)
    asked = []
    monkeypatch.setattr(back.loops, "relaxed", lambda poses, info, headings: asked.append(headings) or poses)
    back._relax()
    assert asked[0].variance.size and np.array_equal(asked[0].variance, WALLS_APART * back.filter.headings.variance)
