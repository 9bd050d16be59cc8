"""The published pose follows the best particle without its jitter."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.rbpf.front_end.reported_pose import FOLLOW, JUMP_M, JUMP_RAD, ReportedPose
from mrslam.spatial import se2

T_MAP_KEY = se2.transform(3.0, -2.0, 2.5)


@pytest.mark.parametrize(
    ("missed", "share"),
    [
        ((0.1, -0.08, 0.04), FOLLOW),  # jitter
        ((0.9 * JUMP_M, 0.9 * JUMP_M, 0.0), 1.0),  # a loop closed
        ((0.0, 0.0, 1.1 * JUMP_RAD), 1.0),
        ((0.0, 0.0, -1.1 * JUMP_RAD), 1.0),
    ],
)
def test_a_small_difference_is_taken_over_in_part_and_a_large_one_at_once(
    missed: tuple[float, float, float], share: float
) -> None:
    reported = ReportedPose()
    reported.T_map_key = T_MAP_KEY.copy()
    best = se2.compose(T_MAP_KEY, np.array(missed))
    reported.follow(best)
    assert reported.T_map_key == pytest.approx(se2.compose(T_MAP_KEY, share * np.array(missed)))
    T_key_base = np.array([0.5, 0.1, -0.3])
    assert reported.at(T_key_base) == pytest.approx(se2.compose(reported.T_map_key, T_key_base))


def test_the_next_keyframe_begins_where_the_robot_was_published() -> None:
    reported = ReportedPose()
    reported.T_map_key = T_MAP_KEY.copy()
    before = reported.at(np.array([0.5, 0.1, -0.3]))
    reported.begin_key(np.array([0.5, 0.1, -0.3]))
    assert reported.at(np.zeros(3)) == pytest.approx(before)
