"""When a robot in a saved map is lost."""

from __future__ import annotations

import pytest

from mrslam.rbpf.localise.fit import Fit


def way_until_lost(inliers: float, conflicts: float, step_m: float = 0.2, step_s: float = 0.0) -> float:
    """Return how far (m), or how long (s), it takes; 100 where it is never lost."""
    fit = Fit()
    for k in range(1, 1 + round(100.0 / max(step_m, step_s))):
        fit.follow(inliers, conflicts, step_m, step_s)
        if fit.is_lost:
            return k * max(step_m, step_s)
    return 100.0


@pytest.mark.parametrize(
    ("inliers", "conflicts", "least_m", "most_m"),
    [(0.2, 0.8, 2.0, 3.0), (0.0, 0.1, 8.0, 12.0), (0.6, 0.4, 100.0, 100.0), (0.3, 0.1, 100.0, 100.0)],
    ids=["elsewhere", "unseen", "furniture moved", "partly unseen"],
)
def test_who_is_elsewhere_is_lost_soon_and_who_is_beyond_the_map_later(
    inliers: float, conflicts: float, least_m: float, most_m: float
) -> None:
    assert least_m <= way_until_lost(inliers, conflicts) <= most_m


def test_people_around_a_robot_that_stands_are_waited_for() -> None:
    assert 15.0 < way_until_lost(0.1, 0.9, step_m=0.0, step_s=1.0) < 40.0


def test_stamps_that_go_back_are_no_time() -> None:
    fit = Fit(0.9)
    fit.follow(1.0, 0.0, 0.0, -1000.0)
    assert fit.value == 0.9


def test_a_long_way_between_two_scans_forgets_what_was_before_and_no_more() -> None:
    fit = Fit(0.5)
    fit.follow(1.0, 0.0, 40.0, 60.0)
    assert fit.value == fit.shown == 1.0


def test_words_say_what_is_wrong() -> None:
    fit = Fit()
    for _ in range(60):
        fit.follow(0.0, 0.05, 0.5, 0.5)
    assert fit.words.startswith("the saved map does not show what it sees")
    fit = Fit()
    for _ in range(20):
        fit.follow(0.1, 0.9, 0.5, 0.5)
    assert "does not fit the saved map" in fit.words
