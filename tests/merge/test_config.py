import dataclasses

import pytest

from mrslam.merge import MergeConfig
from mrslam.spatial import InputError


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("fusion", "median", "one of log-odds, max, mean, got 'median'"),
        ("component", "luck", "one of count, area"),
        ("resolution_m", 0.0, r"in 0\.001\.\.10 m"),
        ("min_confidence", -0.1, r"in 0\.\.1000"),
        ("loop_tolerance_m", 0.0, r"in 0\.0001\.\.10000 m"),
        ("loop_tolerance_share", 1.0, r"in 0\.\.0\.99"),
        ("contradiction_share", 0.0, r"in 0\.001\.\.1"),
        ("robust_sigmas", float("nan"), r"in 0\.01\.\.1000"),
        ("known_pose_sigma_m", float("inf"), r"in 0\.0001\.\.10000 m"),
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
