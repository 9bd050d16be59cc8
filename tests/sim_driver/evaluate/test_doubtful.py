"""What a person is told of the scans at which a mapper doubted its pose."""

from __future__ import annotations

import numpy as np

from mrslam.sim_driver.evaluate.doubtful import find_doubts

STAMPS_NS = 7_000_000_000 + 500_000_000 * np.arange(200)


def test_nothing_is_told_where_nothing_was_doubtful() -> None:
    doubts = find_doubts(STAMPS_NS, np.full(200, 0.5), 0)
    assert (doubts.scans, doubts.share, doubts.stretches_s, doubts.text) == (0, 0.0, [], "")
    assert find_doubts(STAMPS_NS[:0], np.empty(0), 0).text == ""


def test_doubts_that_lie_close_together_are_one_stretch() -> None:
    health = np.ones(200)
    health[[20, 21, 30, 100]] = 0.4
    doubts = find_doubts(STAMPS_NS, health, STAMPS_NS[0])
    assert doubts.stretches_s == [[10.0, 15.0], [50.0, 50.0]]
    assert (doubts.scans, doubts.share) == (4, 0.02)
    assert "4 scans (2.0 %), in the log's seconds 10-15, 50-50: " in doubts.text


def test_many_stretches_are_counted_and_stamps_that_run_backward_are_in_order() -> None:
    health = np.ones(200)
    health[::20] = 0.0
    told = find_doubts(STAMPS_NS, health, STAMPS_NS[0]).text
    assert "seconds 0-0, 10-10, 20-20, 30-30, 40-40 and 5 stretches more: " in told
    stamps_ns = STAMPS_NS.copy()
    stamps_ns[[20, 21]] = stamps_ns[[21, 20]]
    health = np.ones(200)
    health[20:22] = 0.0
    assert find_doubts(stamps_ns, health, stamps_ns[0]).stretches_s == [[10.0, 10.5]]


def test_where_the_logs_time_leaps_back_a_stretch_ends() -> None:
    stamps_ns, health = STAMPS_NS.copy(), np.ones(200)
    stamps_ns[100:] -= 40_000_000_000
    health[98:102] = 0.0
    assert find_doubts(stamps_ns, health, stamps_ns[0]).stretches_s == [[49.0, 49.5], [10.0, 10.5]]


def test_seconds_count_from_the_logs_first_scan_though_it_was_not_used() -> None:
    assert find_doubts(STAMPS_NS, np.where(np.arange(200) == 20, 0.0, 1.0), 0).stretches_s == [[17.0, 17.0]]
