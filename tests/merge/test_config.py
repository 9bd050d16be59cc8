import dataclasses

import pytest

from mrslam.merge import MergeConfig
from mrslam.spatial import InputError


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("fusion", "median", "one of log-odds, max, mean, got 'median'"),
        ("component", "luck", "one of count, area"),
        ("resolution_m", 0.0, "> 0 and < 10 m"),
        ("min_confidence", -0.1, ">= 0"),
        ("loop_tolerance_m", 0.0, "> 0"),
        ("loop_tolerance_share", 1.0, "in 0..1"),
        ("contradiction_share", 0.0, "in 0..1"),
        ("robust_sigmas", float("nan"), "> 0"),
        ("known_pose_sigma_m", float("inf"), "> 0"),
    ],
)
def test_values_out_of_range_name_setting_and_bound(field, value, message):
    with pytest.raises(InputError, match=rf"^merge\.{field} must be .*{message}"):
        MergeConfig(**{field: value})


def test_it_is_frozen_and_keyword_only():
    with pytest.raises(dataclasses.FrozenInstanceError):
        MergeConfig().fusion = "max"  # type: ignore[misc]
    with pytest.raises(TypeError):
        MergeConfig("max")  # type: ignore[misc]
