import numpy as np
import pytest

from mrslam.merge import LocalMatcher, Trail
from mrslam.merge.joint import local_match
from mrslam.merge.joint.local_match import FIRST_LOST_M
from mrslam.spatial import KeyScans, se2
from mrslam.spatial.matching.places import expected_sigmas
from tests.merge.joint.blocks import drive, scan

A, B = drive(0.0, 40.0, seed=1), drive(10.0, 30.0, seed=2)
TRUE = se2.between(A.truth[30], B.truth[12])


@pytest.mark.parametrize(
    ("off", "lost_m"), [((0.1, -0.1, 0.02), 1.0), ((0.5, 0.4, 0.05), 15.0), ((-0.8, 0.7, -0.1), 40.0)]
)
def test_a_stretch_is_found_where_drift_may_have_put_it(off, lost_m):
    fit = LocalMatcher().match(A.trail, 30, B.trail, 12, TRUE + np.array(off), lost_m)
    assert fit is not None
    away_m, turned_rad = se2.difference(fit.T_i_j, TRUE)
    assert away_m < 0.03 and turned_rad < 0.01


def test_its_error_is_within_its_covariance():
    errors = []
    for j in range(4, 50, 3):
        i = int(np.hypot(*(A.truth[:, :2] - B.truth[j, :2]).T).argmin())
        true = se2.between(A.truth[i], B.truth[j])
        fit = LocalMatcher().match(A.trail, i, B.trail, j, true, 1.0)
        assert fit is not None
        error = fit.T_i_j - true
        errors.append(error @ fit.information @ error)
    assert np.mean(errors) < 2 * 3  # 3 degrees of freedom


def test_two_places_do_not_fit():
    assert LocalMatcher().match(A.trail, 10, B.trail, 50, se2.IDENTITY, 5.0) is None


def test_a_stretch_with_hardly_any_points_is_not_compared():
    bare = drive(10.0, 30.0, seed=2)
    polar = bare.trail.scans.polar[:0]
    starts = np.zeros_like(bare.trail.scans.starts)
    empty = type(bare.trail)(bare.trail.T_map_key, type(bare.trail.scans)(starts, polar, bare.trail.scans.origins))
    assert LocalMatcher().match(A.trail, 30, empty, 12, TRUE, 5.0) is None


def test_nearly_the_same_question_is_answered_from_memory():
    matcher = LocalMatcher()
    one = matcher.match(A.trail, 30, B.trail, 12, TRUE, 5.0)
    two = matcher.match(A.trail, 30, B.trail, 12, TRUE + 1e-6, 4.5)
    assert matcher.matched == 1 and one is two
    matcher.match(A.trail, 30, B.trail, 13, TRUE, 5.0)
    assert matcher.matched == 2


@pytest.mark.parametrize(("moved", "lost_m"), [((0.02, -0.02, 0.0025), FIRST_LOST_M), ((0.0, 0.0, 0.0), 1.0)])
def test_what_a_solution_moved_by_less_than_is_searched_is_not_matched_again(moved, lost_m):
    matcher, near = LocalMatcher(), expected_sigmas(FIRST_LOST_M) * np.round(TRUE / expected_sigmas(FIRST_LOST_M))
    matcher.match(A.trail, 30, B.trail, 12, near, FIRST_LOST_M)
    matcher.match(A.trail, 30, B.trail, 12, near + np.array(moved), lost_m)
    assert matcher.matched == 1
    matcher.match(A.trail, 30, B.trail, 12, near, 2.0 * FIRST_LOST_M)
    assert matcher.matched == 2  # more may have drifted: more is searched


def test_a_place_is_searched_again_when_more_may_have_drifted_though_the_same_pose_is_expected() -> None:
    matcher = LocalMatcher()
    for lost_m in (FIRST_LOST_M, 4.0 * FIRST_LOST_M):
        matcher.match(A.trail, 30, B.trail, 12, se2.IDENTITY, lost_m)  # rounded it is the same
    assert matcher.matched == 2


def test_robots_of_one_process_share_what_they_matched():
    answers = local_match.Answers()
    one, two = LocalMatcher(answers), LocalMatcher(answers)
    assert one.match(A.trail, 30, B.trail, 12, TRUE, 5.0) is two.match(A.trail, 30, B.trail, 12, TRUE, 5.0)
    assert (one.matched, two.matched) == (1, 0)


def test_the_answers_asked_for_least_lately_are_forgotten(monkeypatch):
    monkeypatch.setattr(local_match, "REMEMBERED", 2)
    answers, fit = local_match.Answers(), LocalMatcher().match(A.trail, 30, B.trail, 12, TRUE, 5.0)
    answers.add(b"one", fit)
    answers.add(b"two", None)
    assert answers.get(b"one") == (True, fit)
    answers.add(b"three", None)
    assert [answers.get(asked)[0] for asked in (b"one", b"two", b"three")] == [True, False, True]


def test_scans_that_differ_only_in_where_the_laser_sat_are_matched_again():
    matcher, scans = LocalMatcher(), B.trail.scans
    matcher.match(A.trail, 30, B.trail, 12, TRUE, 5.0)
    ahead = Trail(B.trail.T_map_key, KeyScans(scans.starts, scans.polar, scans.origins + np.float32([0.5, 0.0])))
    matcher.match(A.trail, 30, ahead, 12, TRUE, 5.0)
    assert matcher.matched == 2


def beside_a_wall(side: float, begin_m: float, end_m: float) -> Trail:
    """A robot's way along one ``side`` (1, -1) of a wall 14 cm thick; it sees what stands across, too."""
    rng, wall = np.random.default_rng(3), 0.07 * side
    across = [(x_m, wall, x_m, wall + side) for x_m in (begin_m, end_m)]
    segments = np.array([(begin_m, wall, end_m, wall), *across])
    truth = np.column_stack([np.arange(1.0, 4.0, 0.5), np.full(6, wall + 0.4 * side), np.zeros(6)])
    scans = [scan(segments, pose, rng)[::6] for pose in truth]
    noisy = [points + rng.normal(0.0, 0.02, points.shape) for points in scans]  # so that few have a normal
    return Trail(truth, KeyScans.of_points(noisy, np.zeros((6, 2))))


def test_a_wall_is_not_taken_for_its_other_side() -> None:
    near, beyond = beside_a_wall(1.0, 0.0, 6.0), beside_a_wall(-1.0, -3.0, 9.0)
    fit = LocalMatcher().match(near, 3, near, 3, np.array([0.1, -0.1, 0.02]), 5.0)
    assert fit is not None and np.abs(fit.T_i_j).max() < 0.03
    assert LocalMatcher().match(near, 3, beyond, 3, se2.between(near.T_map_key[3], beyond.T_map_key[3]), 5.0) is None
