"""What the mapper makes of odometry."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.rbpf.front_end.odometry import has_been_set_back
from mrslam.rbpf.front_end.prediction import Predictor
from mrslam.spatial.matching.gauss_newton import Match


def seen(blind: float = 0.0) -> Match:
    return Match(np.zeros(3), 0.0, 1.0, 0.0, np.eye(3), blind, np.array([1.0, 0.0]))


def test_odometry_off_by_a_factor_is_put_right() -> None:
    predictor = Predictor(0.1)
    for found, told in (((0.0, 0.0, 0.05), (0.0, 0.0, 0.06)), ((0.1, 0.0, 0.0), (0.08, 0.0, 0.0))):
        for _ in range(400):
            predictor.learn(np.array(found), np.array(told), seen())
    motion, sigma_m, _, slip = predictor.predict(np.array([0.16, 0.0, 0.0]))
    assert motion[0] == pytest.approx(0.2, rel=0.03)
    assert predictor.odometry.gains[1] == pytest.approx(0.05 / 0.06, rel=0.03)
    assert slip < 0.06 and sigma_m < 0.05


@pytest.mark.parametrize("way_m", [0.1, -0.1])
def test_odometry_that_veers_off_is_put_right_whichever_way_it_drives(way_m: float) -> None:
    rng = np.random.default_rng(3)
    predictor = Predictor(0.1)
    for _ in range(600):
        veered = 0.06 * way_m + 0.01 * rng.standard_normal()
        predictor.learn(np.array([way_m, 0.0, 0.0]), np.array([way_m, 0.0, veered]), seen())
    motion = predictor.predict(np.array([0.2, 0.0, 0.012])).motion
    assert motion[2] == pytest.approx(0.0, abs=0.002)  # what wheels of another size feign goes with the way's sign
    back = predictor.predict(np.array([-0.2, 0.0, -0.012])).motion
    assert back[2] == pytest.approx(0.0, abs=0.002)
    assert predictor.odometry.gains[1] == 1.0
    again = Predictor(0.1)
    again.restore(predictor.state())
    assert (
        again.predict(np.array([0.2, 0.0, 0.0])).motion.tobytes()
        == predictor.predict(np.array([0.2, 0.0, 0.0])).motion.tobytes()
    )


def test_one_lie_of_the_wheels_is_no_veer() -> None:
    predictor = Predictor(0.1)
    for _ in range(60):
        predictor.learn(np.array([0.1, 0.0, 0.0]), np.array([0.1, 0.0, 0.0]), seen())
    predictor.learn(np.array([0.1, 0.0, 0.0]), np.array([0.1, 0.0, 1.2]), seen())
    for _ in range(20):
        predictor.learn(np.array([0.1, 0.0, 0.0]), np.array([0.1, 0.0, 0.0]), seen())
    assert abs(predictor.odometry.veer) < 1e-6


def test_a_slip_in_the_first_metre_is_no_veer_of_the_wheels() -> None:
    predictor = Predictor(0.1)
    predictor.learn(np.array([0.6, 0.0, 0.0]), np.array([0.6, 0.0, 0.45]), seen())  # what is learnt first weighs most
    assert predictor.predict(np.array([0.1, 0.0, 0.0])).motion == pytest.approx([0.1, 0.0, 0.0])


def test_turns_that_are_told_too_small_are_no_veer_on_the_straight() -> None:
    predictor = Predictor(0.1)
    for _ in range(60):  # in circles
        predictor.learn(np.array([0.12, 0.0, 0.12]), np.array([0.12, 0.0, 0.1]), seen())
    turned = predictor.odometry.corrected(np.array([0.0, 0.0, 0.1]))[2]
    assert turned > 0.11 and predictor.odometry.corrected(np.array([0.12, 0.0, 0.0]))[2] == 0.0


@pytest.mark.parametrize("told_rad", [-0.05, 0.0])
def test_wheels_that_turned_the_other_way_or_not_at_all_say_nothing_of_their_scale(told_rad: float) -> None:
    predictor, turned = Predictor(0.1), np.array([0.0, 0.0, 0.05])
    for _ in range(40):
        predictor.learn(turned, np.array([0.0, 0.0, told_rad]), seen())
    assert predictor.odometry.corrected(turned) == pytest.approx(turned)


@pytest.mark.parametrize("told_share", [0.1, 10.0])
def test_wheels_that_count_next_to_nothing_or_much_too_much_are_not_put_right_by_as_much(told_share: float) -> None:
    predictor, driven = Predictor(0.1), np.array([0.1, 0.0, 0.0])
    for _ in range(300):
        predictor.learn(driven, told_share * driven, seen())
    assert predictor.odometry.corrected(driven)[0] == pytest.approx(0.15 if told_share < 1.0 else 0.1 / 1.5, rel=0.02)


def test_nothing_is_learnt_along_a_direction_that_is_not_seen() -> None:
    predictor = Predictor(0.1)
    for _ in range(300):
        predictor.learn(np.array([0.01, 0.0, 0.0]), np.array([0.1, 0.0, 0.0]), seen(blind=1.0))
    motion, _, _, slip = predictor.predict(np.array([0.1, 0.0, 0.0]))
    assert motion[0] == pytest.approx(0.1) and slip == pytest.approx(0.1)
    for _ in range(300):
        predictor.learn(np.array([0.1, 0.0, 0.0]), np.array([0.08, 0.0, 0.0]), seen())
    assert predictor.predict(np.array([0.08, 0.0, 0.0])).motion[0] == pytest.approx(0.1, rel=0.03)  # it is again


def test_matches_that_nobody_believes_do_not_make_wheels_dead() -> None:
    predictor, stood = Predictor(0.1), np.zeros(3)
    for _ in range(20):  # a crowd walks past a robot that stands
        predictor.learn(np.array([0.1, 0.0, 0.0]), stood, seen()._replace(inliers=0.2))
    assert predictor.says_it_stands(stood)


def test_odometry_that_is_always_wrong_gives_way_to_steady_motion() -> None:
    predictor = Predictor(0.1)
    for _ in range(300):
        predictor.learn(np.array([0.1, 0.0, 0.0]), np.array([-0.1, 0.0, 0.0]), seen())
    motion, _, _, slip = predictor.predict(np.array([-0.1, 0.0, 0.0]))
    assert motion[0] == pytest.approx(0.1) and slip == 1.0


def test_a_jump_offers_the_motion_before_instead() -> None:
    predictor = Predictor(0.1)
    for _ in range(50):
        predictor.learn(np.array([0.1, 0.0, 0.0]), np.array([0.1, 0.0, 0.0]), seen())
    calm = np.array([0.12, 0.0, 0.0])
    assert predictor.alternatives(calm, predictor.predict(calm).motion) == []
    jump = np.array([1.0, 0.5, 0.0])
    [other] = predictor.alternatives(jump, predictor.predict(jump).motion)
    assert other.motion[0] == pytest.approx(0.1) and other.slip == 1.0
    assert predictor.alternatives(None, jump) == []
    far = np.array([50.0, 0.0, 0.0])
    assert predictor.predict(far).motion[0] == pytest.approx(0.1)


def test_a_jump_offers_the_motion_before_though_its_turn_was_not_believed_anyway() -> None:
    predictor = Predictor(0.1)
    for _ in range(50):  # wheels that tell the way well, and turns wrong
        predictor.learn(np.array([0.1, 0.0, -0.05]), np.array([0.1, 0.0, -0.01]), seen())
    jump = np.array([1.7, -1.4, -0.45])
    predicted = predictor.predict(jump).motion
    assert predicted[2] == pytest.approx(-0.05)
    told, steady = predictor.alternatives(jump, predicted)
    assert told.motion[2] < -0.4 and steady.motion == pytest.approx([0.1, 0.0, -0.05])


def test_wheels_that_stand_while_the_robot_drives_are_not_heard_until_they_turn() -> None:
    predictor, driven, stood = Predictor(0.1), np.array([0.1, 0.0, 0.0]), np.zeros(3)
    for _ in range(10):
        predictor.learn(driven, driven, seen())
    assert predictor.predict(stood).motion.tolist() == [0.0, 0.0, 0.0]  # it may have stopped
    assert predictor.alternatives(stood, stood)[-1].motion == pytest.approx(driven)  # or they did
    for _ in range(5):
        predictor.learn(driven, stood, seen())
    assert not predictor.says_it_stands(stood)
    assert predictor.predict(stood).motion == pytest.approx(driven) and predictor.alternatives(stood, stood) == []
    for _ in range(10):  # a rest tells nothing of wheels that do not count
        predictor.learn(stood, stood, seen())
    assert not predictor.says_it_stands(stood)
    restored = Predictor(0.1)
    restored.restore(predictor.state())
    assert not restored.says_it_stands(stood)
    predictor.learn(driven, driven, seen())
    assert predictor.says_it_stands(stood)


def test_after_a_pause_the_wheels_are_believed_as_far_as_a_robot_can_drive() -> None:
    predictor = Predictor(0.1)
    for _ in range(50):
        predictor.wait(0.1)
        predictor.learn(np.array([0.1, 0.0, 0.0]), np.array([0.1, 0.0, 0.0]), seen())
    far = np.array([12.0, 0.0, 2.0])
    assert predictor.predict(far).motion[0] == pytest.approx(0.1)  # a leap from one scan to the next
    predictor.wait(30.0)
    assert predictor.predict(far).motion == pytest.approx(far, rel=0.05)
    [other] = predictor.alternatives(far, far)
    assert not other.motion.any()  # or else it stood, and the wheels counted on
    assert predictor.predict(np.array([120.0, 0.0, 0.0])).motion.tolist() == [0.0, 0.0, 0.0]
    assert predictor.predict(None).motion.tolist() == [0.0, 0.0, 0.0]
    predictor.learn(far, far, seen())
    predictor.wait(0.1)
    assert np.hypot(*predictor.predict(None).motion[:2]) < 0.2  # what a pause brought is no speed


def test_a_slow_laser_makes_no_pauses() -> None:
    predictor = Predictor(0.1)
    for _ in range(5):
        predictor.wait(6.0)
        predictor.learn(np.array([0.5, 0.0, 0.0]), np.array([0.5, 0.0, 0.0]), seen())
    predictor.wait(7.0)
    assert predictor.predict(None).motion[0] == pytest.approx(0.5)


def test_odometry_that_excluded_where_a_scan_fits_is_believed_less() -> None:
    slips = []
    for refuted in (False, True):
        predictor = Predictor(0.1)
        for _ in range(5):
            predictor.learn(np.array([0.05, 0.0, 0.0]), np.array([0.05, 0.0, 0.0]), seen(), refuted=refuted)
        slips.append(predictor.odometry.slip)
    assert slips[1] > slips[0] + 0.2


def test_speed_is_not_known_between_scans_far_apart_nor_where_it_is_impossible() -> None:
    predictor = Predictor(0.1)
    predictor.velocity = np.array([0.2, 0.0, 0.1])
    assert predictor.speed(None, 0.1).tolist() == pytest.approx([2.0, 0.0, 1.0])
    for elapsed_s in (0.0, -0.1, 0.6, 0.01):
        assert not predictor.speed(None, elapsed_s).any()


def test_a_robot_that_resumes_after_a_pause_knows_of_it() -> None:
    predictor, again = Predictor(0.1), Predictor(0.1)
    for elapsed_s in (0.1, 0.1, 60.0):
        predictor.wait(elapsed_s)
    again.restore(predictor.state())
    far = np.array([9.0, 0.0, 0.2])  # no jump: it had a minute to get there
    assert predictor.dead_reckoned(far)[0] == again.dead_reckoned(far)[0] == 9.0


def test_a_pause_is_noticed_after_a_much_longer_one() -> None:
    predictor = Predictor(0.1)
    for elapsed_s in (*[0.1] * 50, 600.0, *[0.1] * 20):
        predictor.wait(elapsed_s)
    assert not predictor.is_after_pause
    predictor.wait(30.0)
    assert predictor.is_after_pause


def test_a_laser_that_becomes_slow_for_good_pauses_no_more() -> None:
    predictor = Predictor(0.1)
    for elapsed_s in (*[0.1] * 50, *[5.0] * 10):
        predictor.wait(elapsed_s)
    assert not predictor.is_after_pause


def test_a_pause_is_noticed_right_after_stamps_that_leapt_back() -> None:
    predictor = Predictor(0.1)
    for elapsed_s in (*[0.1] * 50, -600.0):
        predictor.wait(elapsed_s)
    assert not predictor.is_after_pause
    predictor.wait(30.0)
    assert predictor.is_after_pause


@pytest.mark.parametrize(
    ("before", "now", "is_set_back"),
    [
        ((9.0, 4.0, 2.0), (0.0, 0.0, 0.0), True), ((0.0, -3.5, 0.1), (0.3, -0.2, 0.2), True),
        ((9.0, 4.0, 2.0), (0.6, 0.0, 0.0), False), ((9.0, 4.0, 2.0), (0.0, 0.0, -0.4), False),
        ((1.0, 2.5, 2.0), (0.0, 0.0, 0.0), False), ((9.0, 4.0, 2.0), (9.2, 4.0, 2.0), False),
    ],
)  # fmt: skip
def test_odometry_that_was_far_from_its_origin_and_is_there_began_again(
    before: tuple[float, float, float], now: tuple[float, float, float], is_set_back: bool
) -> None:
    assert has_been_set_back(np.array(before), np.array(now)) == is_set_back
