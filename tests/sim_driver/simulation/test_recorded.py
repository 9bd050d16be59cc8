from __future__ import annotations

import numpy as np
import pytest

from mrslam.sim_driver.feeds import Reading
from mrslam.sim_driver.simulation.recorded import RecordedBody
from mrslam.spatial import InputError, Scan


def readings(stamps_s: list[float]) -> list[Reading]:
    return [
        Reading(
            Scan(
                stamp_ns=round(s * 1e9),
                ranges_m=np.array([1.0, 2.0], dtype=np.float32),
                angle_min_rad=0.0,
                angle_increment_rad=0.1,
                range_max_m=10.0,
            ),
            np.array([s, 0.0, 0.0]),
        )
        for s in stamps_s
    ]


def drain(body: RecordedBody, now_s: float) -> list[float]:
    found = []
    while (sensed := body.sense(round(now_s * 1e9))) is not None:
        found.append(sensed.scan.stamp_ns / 1e9)
    return found


def test_scans_come_due_by_their_stamps_from_mission_time_zero() -> None:
    body = RecordedBody(readings([100.0, 101.0, 103.0]))
    assert drain(body, 0.0) == [100.0]
    assert body.next_ns == 1_000_000_000
    assert drain(body, 2.9) == [101.0]
    assert not body.finished
    assert drain(body, 3.0) == [103.0]
    assert body.finished and body.next_ns is None
    assert body.duration_ns == 3_000_000_000


def test_backward_stamps_keep_file_order_and_lose_nothing() -> None:
    body = RecordedBody(readings([10.0, 12.0, 11.0, 13.0]))
    assert drain(body, 1.0) == [10.0]
    assert drain(body, 2.0) == [12.0, 11.0]
    assert drain(body, 3.0) == [13.0]


def test_shares_cut_by_count_and_empty_ones_raise() -> None:
    whole = readings([0.0, 1.0, 2.0, 3.0])
    assert drain(RecordedBody(whole, 0.5, 1.0), 9.0) == [2.0, 3.0]
    with pytest.raises(InputError, match="holds no scan"):
        RecordedBody(whole, 0.0, 0.01)


def test_a_log_goes_on_after_what_was_played_before_at_once() -> None:
    body = RecordedBody(readings([10.0, 12.0, 12.0, 15.0, 16.0]), start_ns=5_000_000_000)
    assert body.go_on_after(12_000_000_000) and drain(body, 5.0) == [15.0]
    assert drain(body, 5.9) == [] and drain(body, 6.0) == [16.0]
    ended = RecordedBody(readings([10.0, 12.0]))
    assert ended.go_on_after(12_000_000_000) and ended.finished


def test_another_log_is_played_from_its_beginning() -> None:
    body = RecordedBody(readings([10.0, 12.0]))
    assert not body.go_on_after(11_000_000_000)
    assert drain(body, 9.0) == [10.0, 12.0]
