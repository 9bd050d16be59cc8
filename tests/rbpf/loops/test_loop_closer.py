"""Places seen again: what is believed, and what has to be said twice."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.rbpf import MapperConfig
from mrslam.rbpf.front_end.motion import ARRIVAL_COLUMNS, CARRIED_M
from mrslam.rbpf.loops.guesses import Fit, Guess
from mrslam.rbpf.loops.headings import NO_HEADINGS, Headings
from mrslam.rbpf.loops.loop_closer import LoopCloser
from mrslam.spatial import se2
from mrslam.spatial.matching.gauss_newton import Match
from tests.rbpf.rooms import drive, keyframe

BLIND_KEYS = 24
"""Keyframes between the two rounds that see nothing: more than 12 m of way."""


def two_rounds(off: NDArray[np.float64]) -> tuple[LoopCloser, NDArray[np.float64], int]:
    """A loop closer with all scans of two rounds but for the last keyframes, whose poses are all there, the second off.

    Return it, the trajectory ``(K, 3)``, and the number of keyframes that it has.
    """
    inside, loops = drive(24), LoopCloser(MapperConfig(threads=1))
    blind = np.tile(inside[-1], (BLIND_KEYS, 1))
    truth = np.concatenate([inside, blind, inside])
    trajectory = np.concatenate([inside, blind, se2.compose(off, inside)])
    first = 24 + BLIND_KEYS
    for k in range(first + 5):
        sees = None if 24 <= k < first else np.random.default_rng(k)
        loops.add_key(keyframe(np.zeros(3), truth[k], sees).beams, 0.6)
    return loops, trajectory, first + 5


def look(loops: LoopCloser, trajectory: NDArray[np.float64], keys: int) -> tuple[bool, int]:
    """Show it the first ``keys`` keyframes; return whether they are contradicted, and the number of edges."""
    arrivals = np.zeros((keys, ARRIVAL_COLUMNS))
    return loops.look(trajectory[:keys], arrivals), loops.edges


def test_a_fit_that_agrees_with_the_trajectory_is_an_edge_at_once() -> None:
    loops, trajectory, keys = two_rounds(np.array([0.03, -0.02, 0.005]))
    assert look(loops, trajectory, keys) == (False, 1)
    relaxed = loops.relaxed(trajectory[:keys], np.tile(100.0 * np.eye(3), (keys, 1, 1)))
    assert np.hypot(*relaxed[-1, :2] - drive(24)[4, :2]) < 0.02


@pytest.mark.parametrize(("again_off_m", "believed"), [(0.0, True), (-0.4, False)])
def test_a_fit_that_contradicts_the_trajectory_has_to_be_said_twice(again_off_m: float, believed: bool) -> None:
    loops, trajectory, keys = two_rounds(np.array([0.8, -0.5, 0.05]))
    assert look(loops, trajectory, keys) == (False, 0)
    for k, truth in enumerate(drive(24)[5:10]):  # as many as are matched together
        loops.add_key(keyframe(np.zeros(3), truth, np.random.default_rng(k)).beams, 0.6)
    trajectory[keys:, 1] += again_off_m  # then the second fit means another correction
    assert look(loops, trajectory, keys + 5) == (believed, int(believed))


def test_a_robot_that_was_carried_is_put_back_where_it_was_found() -> None:
    loops = LoopCloser(MapperConfig(threads=1))
    for k in range(6):
        loops.add_key(keyframe(np.zeros(3), np.zeros(3), None).beams, 0.6, is_carried=k == 3)
    T_map_key = np.array([[0.6 * k, 0.1 * k, 0.3 * k] for k in range(6)])
    T_old_new = np.array([5.0, -2.0, 3.0])
    for old, new in ((1, 4), (3, 5), (0, 2)):  # only the first leads from after it was carried to before
        loops._edges.add((old, new))
        loops._edge_values.add((*T_old_new, *np.eye(3).flat))
        poses = loops._put_back(T_map_key)
        if old != 1:
            assert np.array_equal(poses, T_map_key)
            continue
        assert np.array_equal(poses[:3], T_map_key[:3])
        assert np.allclose(poses[4], se2.compose(T_map_key[1], T_old_new))
        assert np.allclose(se2.between(poses[3], poses[5]), se2.between(T_map_key[3], T_map_key[5]))


def test_walls_do_not_hold_a_robot_that_was_carried_at_the_heading_it_thought_it_had() -> None:
    """Which of the four right angles a wall means is known only once the robot is put back where it was found."""
    loops, keys, begin = LoopCloser(MapperConfig(threads=1)), 12, 6
    for k in range(keys):
        loops.add_key(keyframe(np.zeros(3), np.zeros(3), None).beams, 0.6, is_carried=k == begin)
    thought = np.array([[0.6 * k, 0.1 * k, 0.05 * k] for k in range(keys)])
    truth = thought.copy()
    truth[begin:] = se2.compose(np.array([20.0, -9.0, 3.0]), se2.between(thought[begin], thought[begin:]))
    for old, new in ((1, 7), (2, 8), (3, 9), (3, 10), (4, 11)):
        loops._edges.add((old, new))
        loops._edge_values.add((*se2.between(truth[old], truth[new]), *np.diag([400.0, 400.0, 4e3]).flat))
    loops._is_far = True
    chain = np.tile(np.diag([400.0, 400.0, 4e3]), (keys, 1, 1))
    chain[begin] = 1e-6 * np.eye(3)
    seen = se2.wrap(-truth[:, 2])
    walls = Headings(np.zeros(1), np.arange(keys), np.zeros(keys, np.int64), seen, np.full(keys, 1e-4))
    assert np.allclose(loops.relaxed(thought, chain, walls), truth, atol=0.01) and loops.edges == 5


def test_a_robot_carried_twice_in_a_row_is_compared_with_where_it_was_put_first() -> None:
    loops, way = LoopCloser(MapperConfig(threads=1)), drive(24)
    for k in range(6):
        seen = keyframe(np.zeros(3), way[k], np.random.default_rng(k))
        loops.add_key(seen.beams, 0.6, is_carried=k in (3, 4))
    found = loops._compare(way[:6], 3, se2.between(way[3], way[5]), 1.0)
    assert found.inliers > 0.8


def test_walls_keep_headings_where_a_loop_would_bend_them() -> None:
    loops, trajectory, keys = two_rounds(np.array([0.03, -0.02, 0.005]))
    look(loops, trajectory, keys)
    chain, middle = np.tile(np.diag([100.0, 100.0, 1e3]), (keys, 1, 1)), keys // 2
    trajectory[:keys, 2] += np.linspace(0.0, 0.2, keys)  # the loop turns all that back, and the rest with it
    every = np.arange(keys)
    seen = -trajectory[:keys, 2]  # all saw walls along 0
    walls = Headings(np.zeros(1), every, np.zeros(keys, np.int64), seen, np.full(keys, 1e-3))
    turned = [
        np.abs(se2.wrap(loops.relaxed(trajectory[:keys], chain, seen_walls)[middle, 2] - trajectory[middle, 2]))
        for seen_walls in (NO_HEADINGS, walls)
    ]
    assert turned[1] < 0.2 * turned[0] and turned[0] > 0.02


def drive_on(loops: LoopCloser, first: int, last: int) -> None:
    for k, truth in enumerate(drive(24)[first:last]):
        loops.add_key(keyframe(np.zeros(3), truth, np.random.default_rng(k)).beams, 0.6)


def saved(loops: LoopCloser) -> LoopCloser:
    """Return what goes on from its state."""
    again = LoopCloser(MapperConfig(threads=1))
    again.restore(loops.state())
    return again


@pytest.mark.parametrize("is_saved", [False, True])
def test_a_place_that_agreed_is_compared_again_after_some_way_only(is_saved: bool) -> None:
    loops, trajectory, keys = two_rounds(np.array([0.03, -0.02, 0.005]))
    assert look(loops, trajectory, keys) == (False, 1)
    loops = saved(loops) if is_saved else loops
    for k, edges in ((1, 1), (2, 1), (5, 2)):  # 0.6 m, 1.2 m, 3 m
        drive_on(loops, loops.scans.way_m.size - keys + 5, k + 5)
        assert look(loops, trajectory, keys + k)[1] == edges


def test_a_fit_that_waits_to_be_said_again_is_saved() -> None:
    loops, trajectory, keys = two_rounds(np.array([0.8, -0.5, 0.05]))
    assert look(loops, trajectory, keys) == (False, 0)
    again = saved(loops)
    drive_on(again, 5, 10)
    assert look(again, trajectory, keys + 5) == (True, 1)


def test_fits_far_apart_do_not_confirm_each_other() -> None:
    loops, trajectory, keys = two_rounds(np.array([0.8, -0.5, 0.05]))
    assert look(loops, trajectory, keys) == (False, 0)
    drive_on(loops, 5, 15)  # 6 m
    assert look(loops, trajectory, keys + 10) == (False, 0)


def test_a_robot_that_was_carried_is_not_looked_for_where_it_thinks_it_is() -> None:
    loops, trajectory, keys = two_rounds(np.array([0.03, -0.02, 0.005]))
    loops.add_key(keyframe(np.zeros(3), drive(24)[5], np.random.default_rng(5)).beams, 0.6, is_carried=True)
    for one in (saved(loops), loops):
        assert one.is_carried and one.scans.newest_start == keys
        assert look(one, trajectory, keys + 1) == (False, 0)


@pytest.mark.parametrize("is_unconfirmed", [False, True])
def test_what_was_seen_before_wheels_alone_led_on_does_not_confirm_where_they_led(is_unconfirmed: bool) -> None:
    """The robot is on the other side of its round, where it sees something else than where its wheels have it."""
    loops, trajectory, keys = two_rounds(np.zeros(3))
    seen = keyframe(np.zeros(3), drive(24)[17], np.random.default_rng(5))
    loops.add_key(seen.beams, 3.0, is_unconfirmed=is_unconfirmed)
    assert np.array_equal(trajectory[keys], drive(24)[5])
    _, edges = look(loops, trajectory, keys + 1)
    assert edges == (not is_unconfirmed)


@pytest.mark.parametrize("is_found", [False, True])
def test_a_robot_that_was_carried_is_so_until_it_is_found(is_found: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    loops, trajectory, keys = two_rounds(np.zeros(3))
    loops.add_key(keyframe(np.zeros(3), drive(24)[5], np.random.default_rng(5)).beams, 0.6, is_carried=True)
    lost = np.full(keys + 1, 5.0 * CARRIED_M)
    monkeypatch.setattr("mrslam.rbpf.loops.loop_closer.drift_from_newest", lambda *_: (lost, lost))
    monkeypatch.setattr(loops._far, "is_due", lambda is_carried: is_carried)
    found = Match(np.zeros(3), -0.5, 0.9, 0.0, np.eye(3), 0.0, np.array([1.0, 0.0]))
    fits = [Fit(1, keys, found)] if is_found else []
    monkeypatch.setattr(loops._far, "look", lambda *_: fits)
    assert look(loops, trajectory, keys + 1) == (is_found, len(fits))
    assert loops.is_carried is not is_found


@pytest.mark.parametrize("is_far", [False, True])
def test_one_wrong_edge_among_true_ones_does_not_bend_the_trajectory(is_far: bool) -> None:
    loops, count = LoopCloser(MapperConfig(threads=1)), 41
    there_m = 0.5 * np.minimum(np.arange(count), np.arange(count)[::-1])
    truth = np.stack([there_m, 0.3 * there_m, np.zeros(count)], axis=1)
    for k in range(count):
        loops.add_key(keyframe(np.zeros(3), truth[k], None).beams, 0.5)
    true = [(k, count - 1 - k, np.zeros(3)) for k in range(0, 15, 2)]
    for old, new, T_old_new in (*true[:4], (3, 30, np.array([-4.0, 5.0, 1.0])), *true[4:]):
        loops._edges.add((old, new))
        loops._edge_values.add((*T_old_new, *(1e4 * np.eye(3)).flat))
    loops._is_far = is_far  # then wrong edges are taken out, else they only count for less
    relaxed = loops.relaxed(truth, np.tile(1e4 * np.eye(3), (count, 1, 1)))
    assert np.hypot(*(relaxed - truth)[:, :2].T).max() < 0.1
    left = np.stack(loops.as_edges()[:2], axis=-1).tolist()
    assert len(left) == len(true) + (not is_far) and ([3, 30] in left) is not is_far


def test_where_else_a_robot_may_be_means_nothing_once_it_was_carried() -> None:
    loops = LoopCloser(MapperConfig(threads=1))
    loops._far.guesses = [Guess([], 0, 1.0)]
    for is_carried in (False, True):
        loops.add_key(keyframe(np.zeros(3), np.zeros(3), None).beams, 0.6, is_carried=is_carried)
        assert len(loops.histories) == (not is_carried)


def test_of_old_keyframes_one_that_looked_the_same_way_is_compared_before_a_nearer_one_that_looked_back() -> None:
    loops, T_map_key = LoopCloser(MapperConfig(threads=1)), np.array([[0.6 * k, 50.0, 0.0] for k in range(40)])
    for _ in range(40):
        loops.add_key(keyframe(np.zeros(3), np.zeros(3), None).beams, 0.6)
    T_map_key[[2, 5, 39]] = (0.5, 0.0, 0.1), (0.1, 0.0, 3.1), (0.0, 0.0, 0.0)
    assert loops._candidate(T_map_key, 20.0) == 2
    T_map_key[2, 2] = 3.1  # both looked back
    assert loops._candidate(T_map_key, 20.0) == 5


@pytest.mark.parametrize(("along", "lost_m"), [(1e6, 0.0), (1.0, 6.0)])
def test_a_fit_in_a_corridor_does_not_end_what_the_trajectory_may_have_drifted(along: float, lost_m: float) -> None:
    loops = LoopCloser(MapperConfig(threads=1))
    for _ in range(10):
        loops.add_key(keyframe(np.zeros(3), np.zeros(3), None).beams, 0.6)
    information = np.diag([along, 1e6, 1e6])
    loops._add_edge(0, Match(np.zeros(3), -0.5, 0.9, 0.0, information, 0.0, np.array([1.0, 0.0])))
    last_fit_m, anchored_m = loops.state()["way_m"]
    assert last_fit_m == pytest.approx(6.0) and last_fit_m - anchored_m == pytest.approx(lost_m)
