"""What may happen thousands of times is told a dozen times."""

from __future__ import annotations

from mrslam.comms.milestones import is_milestone


def test_the_first_is_told_and_then_every_doubling() -> None:
    assert [count for count in range(1, 70) if is_milestone(count)] == [1, 2, 4, 8, 16, 32, 64]
