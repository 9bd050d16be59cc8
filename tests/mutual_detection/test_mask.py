import numpy as np
import pytest

from mrslam.mutual_detection import mask_teammates, masked_beams
from mrslam.spatial import Scan, se2


def scan_of(ranges, mounting=(0.1, -0.05, 0.3)):
    ranges = np.asarray(ranges, dtype=np.float32)
    return Scan(
        stamp_ns=5,
        ranges_m=ranges,
        angle_min_rad=-np.pi,
        angle_increment_rad=2 * np.pi / ranges.size,
        range_max_m=10.0,
        T_base_laser=np.array(mounting),
    )


def naive(scan, T_map_base, centres, radii):
    hit = []
    for angle, length in zip(scan.angles_rad, scan.ranges_m, strict=True):
        inside = False
        if np.isfinite(length):
            end = se2.apply(
                se2.compose(T_map_base, scan.T_base_laser), length * np.array([np.cos(angle), np.sin(angle)])
            )
            inside = any(np.hypot(*(end - c)) <= r for c, r in zip(centres, radii, strict=True))
        hit.append(inside)
    return np.array(hit)


@pytest.mark.parametrize("seed", range(5))
def test_equals_the_obvious_loop(seed):
    rng = np.random.default_rng(seed)
    ranges = rng.uniform(0.2, 8.0, 360)
    ranges[rng.random(360) < 0.1] = np.nan
    ranges[rng.random(360) < 0.1] = np.inf
    scan, T_map_base = scan_of(ranges), np.array([3.0, -2.0, 1.2])
    centres, radii = rng.uniform(-5, 8, (6, 2)), rng.uniform(0.2, 2.0, 6)
    expected = naive(scan, T_map_base, centres, radii)
    assert 5 < expected.sum() < 300
    assert (masked_beams(scan, T_map_base, centres, radii) == expected).all()
    masked, count = mask_teammates(scan, T_map_base, centres, radii)
    assert count == expected.sum()
    assert np.isnan(masked.ranges_m[expected]).all()
    assert np.array_equal(masked.ranges_m[~expected], scan.ranges_m[~expected], equal_nan=True)


def test_beams_that_pass_through_or_stop_short_are_kept():
    scan = scan_of([1.0, 2.0, 3.0, np.inf], mounting=(0, 0, -np.pi))
    # All four beams turned into one direction: a circle at 2 m holds only the end of the second.
    scan = Scan(stamp_ns=0, ranges_m=scan.ranges_m, angle_min_rad=0.0, angle_increment_rad=0.0, range_max_m=10.0)
    beams = masked_beams(scan, np.zeros(3), np.array([[2.0, 0.0]]), np.array([0.3]))
    assert beams.tolist() == [False, True, False, False]


def test_without_teammates_the_scan_is_the_same_object():
    scan = scan_of(np.ones(8))
    same, count = mask_teammates(scan, np.zeros(3), np.empty((0, 2)), np.empty(0))
    assert same is scan
    assert count == 0
