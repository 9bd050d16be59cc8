"""Several lasers as one sweep."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.sim_driver.ros.lasers import FRESH_NS, JoinedLasers, sweep
from mrslam.spatial import Scan, se2


def laser(ranges: list[float], stamp_ns: int = 0, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Scan:
    return Scan(
        stamp_ns=stamp_ns, ranges_m=np.array(ranges, dtype=np.float32), angle_min_rad=0.0, angle_increment_rad=0.01,
        range_max_m=10.0, T_base_laser=np.array(at),
    )  # fmt: skip


def test_the_nearest_return_of_a_direction_wins_over_others_and_over_none() -> None:
    one = sweep(laser([3.0]), [(laser([3.0, math.inf, math.nan]), se2.IDENTITY), (laser([2.0]), se2.IDENTITY)])
    assert one.ranges_m[one.is_return].tolist() == [2.0]
    assert np.isinf(one.ranges_m).sum() == 1  # seen through
    assert np.isnan(one.ranges_m).sum() == one.ranges_m.size - 2  # nobody looks there
    again = sweep(laser([3.0]), [(laser([math.inf]), se2.IDENTITY), (laser([3.0]), se2.IDENTITY)])
    assert again.ranges_m[again.is_return].tolist() == [3.0] and not np.isinf(again.ranges_m).any()


def test_points_stay_where_they_are_within_a_beam() -> None:
    seen = laser([5.0] * 300, at=(0.3, -0.2, 2.5))
    one = sweep(seen, [(seen, se2.IDENTITY)])
    away = np.abs(one.points_base()[:, None] - seen.points_base()[None]).sum(axis=-1).min(axis=1)
    assert one.is_return.sum() > 250 and away.max() < 0.03 and not one.T_base_laser.any()


def test_scans_of_others_are_moved_to_where_the_robot_is_now() -> None:
    lasers = JoinedLasers("a")
    T_then, T_now = np.array([1.0, 0.0, 0.0]), np.array([1.5, 0.0, 0.0])
    assert lasers.add("a", laser([9.0]), T_then) is not None
    assert lasers.add("b", laser([4.0], 1), T_then) is None
    one = lasers.add("a", laser([math.nan], 2), T_now)
    assert one is not None and one.stamp_ns == 2
    np.testing.assert_allclose(one.points_base(), [[3.5, 0.0]], atol=0.02)


@pytest.mark.parametrize(("age_ns", "is_used"), [(FRESH_NS, True), (FRESH_NS + 1, False)])
def test_old_scans_are_left_out(age_ns: int, is_used: bool) -> None:
    lasers = JoinedLasers("a")
    lasers.add("b", laser([4.0]), None)
    one = lasers.add("a", laser([math.nan], age_ns), None)
    assert one is not None and bool(one.is_return.any()) == is_used


def test_another_takes_the_lead_where_the_first_is_silent() -> None:
    lasers = JoinedLasers("a")
    assert lasers.add("b", laser([4.0]), None) is not None
    assert lasers.add("a", laser([4.0], 1), None) is not None
    assert lasers.add("b", laser([4.0], 2), None) is None
    assert lasers.add("b", laser([4.0], 2 + FRESH_NS), None) is not None


def test_free_directions_of_others_turn_with_the_robot() -> None:
    one = sweep(laser([math.nan]), [(laser([math.inf], at=(0.0, 0.0, 0.2)), se2.transform(0.0, 0.0, 0.5))])
    assert one.angles_rad[np.isinf(one.ranges_m)] == pytest.approx([0.7], abs=0.01)
