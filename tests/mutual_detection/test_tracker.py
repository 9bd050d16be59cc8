import subprocess
import sys

import numpy as np
import pytest

from mrslam.mutual_detection import MutualDetectionConfig, TeammateTracker, place_covariance
from mrslam.spatial import InputError, se2

S = 1_000_000_000


def drive(tracker, seconds, velocity=(0.4, -0.2), rate_hz=5, noise_m=0.02, seed=0):
    rng = np.random.default_rng(seed)
    for i in range(int(seconds * rate_hz) + 1):
        t = i / rate_hz
        tracker.observe("r1", round(t * S), np.array(velocity) * t + rng.normal(0, noise_m, 2), noise_m**2 * np.eye(2))
    return t


def test_predicts_ahead_by_the_velocity():
    tracker = TeammateTracker()
    t = drive(tracker, 4)
    centres, radii = tracker.predict(round((t + 0.5) * S))
    assert np.allclose(centres[0], np.array([0.4, -0.2]) * (t + 0.5), atol=0.1)
    assert 0.26 < radii[0] < 0.6


def test_circle_grows_with_age_up_to_its_limit_and_then_is_forgotten():
    config = MutualDetectionConfig(forget_after_s=3.0, max_radius_m=0.7)
    tracker = TeammateTracker(config)
    t = drive(tracker, 4)
    radii = [float(tracker.predict(round((t + age) * S))[1][0]) for age in (0.0, 0.2, 0.5, 1.0, 2.9)]
    assert radii == sorted(radii)
    assert radii[1] > radii[0]
    assert radii[-1] == 0.7
    assert len(tracker.predict(round((t + 3.1) * S))[0]) == 0


def test_predicting_changes_nothing():
    tracker = TeammateTracker()
    drive(tracker, 2)
    first = tracker.predict(3 * S)
    tracker.predict(2 * S)
    again = tracker.predict(3 * S)
    assert np.array_equal(first[0], again[0])
    assert np.array_equal(first[1], again[1])


def test_late_and_broken_reports_are_dropped():
    tracker, twin = TeammateTracker(), TeammateTracker()
    drive(tracker, 2)
    drive(twin, 2)
    tracker.observe("r1", 1 * S, [50.0, 50.0])
    tracker.observe("r1", 2 * S, [np.nan, 0.0])
    tracker.observe("r1", 2 * S, [0.0, 0.0], [[np.inf, 0], [0, 1]])
    tracker.observe("r1", 2 * S, [0.0, 0.0, 0.0])
    assert np.array_equal(tracker.predict(2 * S)[0], twin.predict(2 * S)[0])


def test_a_jump_starts_the_track_afresh():
    tracker = TeammateTracker()
    drive(tracker, 4)
    tracker.observe("r1", round(4.2 * S), [20.0, 5.0])
    assert np.allclose(tracker.predict(round(4.2 * S))[0][0], [20.0, 5.0])


def test_all_teammates_at_once_in_the_order_of_ids():
    tracker = TeammateTracker()
    for robot_id, x in (("b", 2.0), ("a", 1.0), ("c", 3.0)):
        tracker.observe(robot_id, 0, [x, 0.0])
    centres, radii = tracker.predict(0)
    assert centres[:, 0].tolist() == [1.0, 2.0, 3.0]
    assert radii.shape == (3,)
    tracker.forget("b")
    tracker.forget("nobody")
    assert tracker.predict(0)[0][:, 0].tolist() == [1.0, 3.0]


def test_a_poor_transform_widens_the_circle_and_none_is_taken_for_exact():
    tracker = TeammateTracker(MutualDetectionConfig(position_sigma_m=0.05))
    for robot_id, sigma_m in (("r1", None), ("r2", 0.12), ("r3", 0.0)):
        tracker.observe(robot_id, 0, [0, 0], None if sigma_m is None else sigma_m**2 * np.eye(2))
    radii = tracker.predict(0)[1]
    assert radii[0] == radii[2] == pytest.approx(0.18 + 0.08 + 2.0 * 0.05)
    assert radii[1] == pytest.approx(0.18 + 0.08 + 2.0 * 0.13)


def test_the_uncertainty_of_a_place_is_that_of_the_transform_with_its_lever():
    T, C = np.array([3.0, -1.0, 2.0]), np.array([[0.02, 0.003, 0.001], [0.003, 0.01, -0.002], [0.001, -0.002, 0.004]])
    local = np.array([4.0, 1.5])
    drawn = np.random.default_rng(0).multivariate_normal(T, C, 4000)
    places = np.array([se2.apply(one, local) for one in drawn])
    expected = place_covariance(T, C, se2.apply(T, local))
    np.testing.assert_allclose(np.cov(places.T), expected, rtol=0.15, atol=0.004)
    np.testing.assert_allclose(place_covariance(T, C, T[:2]), C[:2, :2])


def test_reports_are_forgotten_with_age_and_one_after_long_silence_starts_afresh():
    tracker = TeammateTracker(MutualDetectionConfig(forget_after_s=2.0, gate_sigmas=1e3))
    t = drive(tracker, 3)
    assert len(tracker.predict(round((t - 2.1) * S))[0]) == 0  # nor is it known where it was before
    tracker.observe("r1", round((t + 2.1) * S), [7.0, 7.0])
    centres, _ = tracker.predict(round((t + 2.6) * S))
    np.testing.assert_allclose(centres[0], [7.0, 7.0])  # with no speed left from before


def test_settings_are_checked():
    with pytest.raises(InputError, match=r"mutual_detection.forget_after_s must be in 0.01..1e\+06 s, got -1"):
        MutualDetectionConfig(forget_after_s=-1)


def test_the_foreseen_place_is_the_filters_prediction():
    tracker = TeammateTracker(MutualDetectionConfig(max_radius_m=9.0, forget_after_s=9.0))
    t = drive(tracker, 3)
    kalman = tracker._tracks["r1"].filter
    for dt in (-0.4, 0.0, 0.3, 2.0):
        F = np.eye(4)
        F[0, 1] = F[2, 3] = dt
        spread = (F @ kalman.P @ F.T)[np.ix_([0, 2], [0, 2])] + 0.25 * 0.6**2 * dt**4 * np.eye(2)
        centres, radii = tracker.predict(round((t + dt) * S))
        assert np.allclose(centres[0], (F @ kalman.x)[[0, 2]])
        assert np.isclose(radii[0], 0.18 + 0.08 + 2.0 * np.sqrt(np.linalg.eigvalsh(spread)[-1]))


def test_what_tracks_teammates_is_loaded_before_the_first_is_met_and_not_by_a_robot_alone() -> None:
    code = """
import sys, mutual_detection
print("filterpy" in sys.modules)
mutual_detection.warm_up()
print("filterpy" in sys.modules)
"""
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.split() == ["False", "True"]


def test_a_teammate_is_masked_at_once_where_the_own_clock_was_set_back():
    tracker = TeammateTracker()
    for t_s in (600.0, 600.2, 100.0, 100.2):
        tracker.observe("r2", round(t_s * S), (t_s % 10.0, 0.0))
    centres, _ = tracker.predict(round(100.2 * S))
    assert len(centres) == 1 and abs(centres[0, 0] - 0.2) < 0.1
