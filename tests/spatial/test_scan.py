import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mrslam.spatial import InputError, Scan, se2

MAX, MIN = 10.0, 0.1


def scan_of(ranges, **changes) -> Scan:
    fields = {
        "stamp_ns": 0,
        "ranges_m": np.asarray(ranges, dtype=np.float32),
        "angle_min_rad": -0.5,
        "angle_increment_rad": 0.01,
        "range_max_m": MAX,
        "range_min_m": MIN,
    }
    return Scan(**(fields | changes))


@pytest.mark.parametrize(
    ("raw", "stored"),
    [
        (5.0, 5.0),
        (MAX, MAX),
        (MIN, np.float32(MIN)),
        (10.001, np.inf),
        (81.83, np.inf),
        (np.inf, np.inf),
        (np.nan, np.nan),
        (-np.inf, np.nan),
        (0.0, np.nan),
        (-0.0, np.nan),
        (-3.0, np.nan),
        (0.05, np.nan),
        (1e-45, np.nan),
    ],
)
def test_each_kind_of_beam(raw, stored):
    np.testing.assert_equal(scan_of([raw]).ranges_m[0], np.float32(stored))


@given(arrays(np.float32, st.integers(0, 40), elements=st.floats(width=32, allow_nan=True, allow_infinity=True)))
def test_any_beams_make_a_scan_of_returns_no_returns_and_dropped_beams(raw):
    scan = scan_of(raw)
    hit = scan.is_return
    assert ((scan.ranges_m[hit] >= np.float32(MIN)) & (scan.ranges_m[hit] <= MAX)).all()
    assert (np.isnan(scan.ranges_m[~hit]) | (scan.ranges_m[~hit] == np.inf)).all()
    assert scan.points_laser().shape == (hit.sum(), 2)
    again = scan.with_ranges(scan.ranges_m)
    np.testing.assert_array_equal(again.ranges_m, scan.ranges_m)


def test_the_callers_array_is_neither_changed_nor_shared():
    raw = np.array([1.0, 99.0, -1.0], dtype=np.float32)
    scan = scan_of(raw)
    np.testing.assert_array_equal(raw, [1.0, 99.0, -1.0])
    raw[0] = 7.0
    assert scan.ranges_m[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        scan.ranges_m[0] = 2.0


def test_points_are_where_the_beams_point():
    scan = scan_of([1.0, np.nan, 2.0], angle_min_rad=0.0, angle_increment_rad=math.pi / 4)
    np.testing.assert_allclose(scan.points_laser(), [[1.0, 0.0], [0.0, 2.0]], atol=1e-6)
    ahead = scan_of([1.0], angle_min_rad=0.0, T_base_laser=se2.transform(0.2, 0.1, math.pi / 2))
    np.testing.assert_allclose(ahead.points_base(), [[0.2, 1.1]], atol=1e-6)


def test_a_clockwise_laser_keeps_its_directions():
    scan = scan_of([1.0, 1.0], angle_min_rad=1.0, angle_increment_rad=-0.25)
    np.testing.assert_allclose(scan.angles_rad, [1.0, 0.75])


def test_with_ranges_keeps_everything_else():
    scan = scan_of([1.0, 2.0], stamp_ns=7, T_base_laser=se2.transform(1.0, 2.0, 3.0))
    masked = scan.with_ranges([np.nan, 2.0])
    assert masked.stamp_ns == 7
    assert masked.range_min_m == MIN
    np.testing.assert_array_equal(masked.T_base_laser, scan.T_base_laser)
    assert masked.is_return.tolist() == [False, True]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"ranges_m": np.zeros((2, 2))}, r"shape \(beams,\)"),
        ({"angle_min_rad": math.nan}, "angle_min_rad must be finite"),
        ({"angle_increment_rad": math.inf}, "angle_increment_rad must be finite"),
        ({"range_max_m": math.nan}, "range_max_m must be finite"),
        ({"range_max_m": 0.0, "range_min_m": 0.0}, "range_min_m < range_max_m"),
        ({"range_min_m": -1.0}, "0 <= range_min_m"),
        ({"range_min_m": 11.0}, "range_min_m < range_max_m"),
        ({"ranges_m": np.ones(700)}, "more than a full turn"),
        ({"ranges_m": np.ones(700), "angle_increment_rad": -0.01}, "more than a full turn"),
        ({"ranges_m": np.ones(100), "beam_interval_s": 0.1}, "no sweep of 0 to 1 s"),
        ({"beam_interval_s": -1e-4}, "no sweep of 0 to 1 s"),
        ({"beam_interval_s": np.nan}, "beam_interval_s must be finite"),
        ({"T_base_laser": np.zeros(2)}, "three finite numbers"),
        ({"T_base_laser": np.array([0.0, math.nan, 0.0])}, "three finite numbers"),
    ],
)
def test_a_geometry_without_sense_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        scan_of(changes.pop("ranges_m", [1.0]), **changes)


def test_a_full_turn_with_its_last_beam_on_the_first_is_allowed():
    assert scan_of(np.ones(361), angle_increment_rad=math.radians(1.0)).ranges_m.size == 361
