from __future__ import annotations

import numpy as np
import pytest

from mrslam.comms import CommsConfig
from mrslam.comms.neighbours.link_quality import MIN_EXPECTED, BeaconWindow, HeardBeacon, LinkMonitor

MS = 1_000_000
PERIOD = 500 * MS
DEADLINE = 500 * MS


def drive(window: BeaconWindow, arrivals: list[tuple[int, int]]) -> int:
    """Feed (seq, delay in ms) pairs; return the time of the last arrival."""
    now = 0
    for seq, delay_ms in sorted(arrivals, key=lambda pair: pair[0] * PERIOD + pair[1] * MS):
        now = seq * PERIOD + delay_ms * MS
        window.hear(seq, seq * PERIOD, now, DEADLINE)
    return now


@pytest.mark.parametrize("loss", [0.0, 0.1, 0.3, 0.5, 0.9])
def test_lq_is_the_share_that_arrives(loss):
    rng = np.random.default_rng(3)
    window = BeaconWindow(1000)
    now = drive(window, [(k, 1) for k in range(1, 2001) if rng.random() >= loss])
    assert window.quality(now, PERIOD) == pytest.approx(1 - loss, abs=0.05)


def test_one_beacon_is_no_proof_of_a_good_link():
    window = BeaconWindow(64)
    assert window.quality(0, PERIOD) == 0.0
    now = drive(window, [(1, 1)])
    assert window.quality(now, PERIOD) == pytest.approx(1 / MIN_EXPECTED)


def test_silence_counts_as_loss_and_speech_after_a_pause_of_the_sender_does_not():
    window = BeaconWindow(10)
    now = drive(window, [(k, 1) for k in range(1, 11)])
    assert window.quality(now + PERIOD, PERIOD) == 1.0
    assert window.quality(now + 6 * PERIOD, PERIOD) == pytest.approx(0.5)
    assert window.quality(now + 100 * PERIOD, PERIOD) == 0.0
    window.hear(11, 0, now + 7 * PERIOD, 10**15)  # it had only stopped sending: no number is missing
    assert window.quality(now + 7 * PERIOD, PERIOD) == 1.0


def test_a_young_link_that_falls_silent_gets_worse_too():
    window = BeaconWindow(64)
    now = drive(window, [(k, 1) for k in range(1, 21)])
    assert window.quality(now, PERIOD) == 1.0
    assert window.quality(now + 21 * PERIOD, PERIOD) == pytest.approx(0.5)


def test_a_late_beacon_counts_as_lost_and_a_steady_delay_does_not():
    late = BeaconWindow(20)
    now = drive(late, [(k, 900 if k % 2 else 200) for k in range(1, 21)])
    assert late.quality(now, PERIOD) == pytest.approx(0.5, abs=0.05)
    steady = BeaconWindow(20)
    now = drive(steady, [(k, 5000) for k in range(1, 21)])
    assert steady.quality(now, PERIOD) == 1.0


def test_clocks_may_differ_and_drift():
    window = BeaconWindow(20)
    for k in range(1, 200):
        window.hear(k, 10**15 + round(k * PERIOD * 1.001), k * PERIOD, DEADLINE)
    assert window.quality(199 * PERIOD, PERIOD) == 1.0
    slow = BeaconWindow(20)
    for k in range(1, 2000):  # 0.1 % slower: one second behind in a thousand
        slow.hear(k, round(k * PERIOD * 0.999), k * PERIOD, DEADLINE)
    assert slow.quality(1999 * PERIOD, PERIOD) == 1.0


def test_doubled_and_swapped_beacons_count_once():
    window = BeaconWindow(16)
    for seq in (1, 3, 2, 2, 3, 5, 4, 4, 6, 8, 7, 7, 10, 9, 12, 11, 14, 13, 16, 15):
        window.hear(seq, 0, 0, DEADLINE)
    assert window.quality(0, PERIOD) == 1.0


def monitors(config: CommsConfig) -> tuple[LinkMonitor, LinkMonitor]:
    return LinkMonitor(config), LinkMonitor(config)


def test_quality_is_lq_times_nlq():
    config = CommsConfig(link_smoothing=1.0, beacon_window=40)
    a, b = monitors(config)
    for k in range(1, 101):
        now = k * PERIOD
        if k % 2:  # every other beacon of a is lost
            b.hear("a", HeardBeacon(k, now, PERIOD, dict(a.report(now)).get("b")), now)
        a.hear("b", HeardBeacon(k, now, PERIOD, dict(b.report(now)).get("a")), now)
        found = a.update(now), b.update(now)
    assert found[0]["b"] == pytest.approx(0.5, abs=0.05)
    assert found[1]["a"] == pytest.approx(0.5, abs=0.05)


def test_a_neighbour_that_does_not_hear_me_is_no_link():
    a, _ = monitors(CommsConfig(link_smoothing=1.0))
    for k in range(1, 30):
        a.hear("b", HeardBeacon(k, k * PERIOD, PERIOD, None), k * PERIOD)
    assert a.update(29 * PERIOD)["b"] == 0.0


def test_what_a_beacon_reports_is_bounded_and_all_get_their_turn():
    config = CommsConfig(beacon_neighbours=5)
    monitor = LinkMonitor(config)
    for k in range(23):
        monitor.hear(f"r{k}", HeardBeacon(1, 0, PERIOD, None), 0)
    told: set[str] = set()
    for turn in range(5):
        report = monitor.report(turn)
        assert len(report) == 5
        told |= {peer for peer, _ in report}
    assert len(told) == 23


def test_a_neighbour_that_says_no_more_what_it_hears_of_me_counts_as_deaf():
    config = CommsConfig(beacon_period_s=0.5, beacon_window=16, link_smoothing=1.0)
    monitor, qualities = LinkMonitor(config), []
    for k in range(200):
        nlq = 1.0 if k < 20 else None
        monitor.hear("b", HeardBeacon(k, k * PERIOD, PERIOD, nlq), k * PERIOD + MS)
        qualities.append(monitor.update(k * PERIOD + MS)["b"])
    assert qualities[20] == 1.0 and qualities[-1] == 0.0


@pytest.mark.parametrize(("nlq", "is_calm"), [(1.0, True), (0.5, False)])
def test_a_link_of_which_the_other_end_loses_beacons_is_not_calm_though_all_of_its_own_arrive(nlq, is_calm):
    monitor = LinkMonitor(CommsConfig())
    for k in range(30):
        monitor.hear("b", HeardBeacon(k, k * PERIOD, PERIOD, nlq), k * PERIOD)
    assert monitor.is_calm(29 * PERIOD) is is_calm


def test_numbers_far_apart_are_bounded_and_take_no_memory():
    window = BeaconWindow(16)
    now = drive(window, [(k, 1) for k in range(1, 17)])
    window.hear(2**62, now, now + PERIOD, 10**15)  # a neighbour may send any number
    assert window.quality(now + PERIOD, PERIOD) == pytest.approx(1 / 16)
    for seq in (0, 2**62 - 17, 2**61):
        window.hear(seq, now, now + PERIOD, 10**15)
    assert window.quality(now + PERIOD, PERIOD) == pytest.approx(1 / 16)  # older than all that was expected
    young = BeaconWindow(64)
    for seq in (10, 3):
        young.hear(seq, seq * PERIOD, seq * PERIOD, 10**15)
    assert young.quality(10 * PERIOD, PERIOD) == pytest.approx(1 / MIN_EXPECTED)  # from before it was heard


def test_silence_counts_from_the_newest_time_at_which_a_beacon_was_heard():
    window = BeaconWindow(10)
    now = drive(window, [(k, 1) for k in range(1, 11)])
    window.hear(10, 10 * PERIOD, now - 5 * PERIOD, 10**15)  # handed on out of order
    assert window.quality(now + PERIOD, PERIOD) == 1.0


def test_quality_is_smoothed():
    monitor = LinkMonitor(CommsConfig(link_smoothing=0.25))
    for k in range(30):
        monitor.hear("b", HeardBeacon(k, k * PERIOD, PERIOD, 1.0), k * PERIOD)
    steps = [monitor.update(29 * PERIOD)["b"] for _ in range(3)]
    assert steps == pytest.approx([0.25, 0.4375, 0.578125])


def test_a_link_is_not_calm_while_a_beacon_is_overdue_and_one_that_is_gone_disturbs_nobody():
    monitor = LinkMonitor(CommsConfig(beacon_window=16))
    assert monitor.is_calm(0)
    for k in range(30):
        monitor.hear("b", HeardBeacon(k, k * PERIOD, PERIOD, 1.0), k * PERIOD)
    calm = [monitor.is_calm((29 + periods) * PERIOD) for periods in (2, 3, 10, 40)]
    assert calm == [True, False, False, True]


def test_a_period_of_nothing_divides_nothing():
    monitor = LinkMonitor(CommsConfig())
    monitor.hear("b", HeardBeacon(1, 0, 0, 1.0), 0)
    assert monitor.lq("b", 10**9) == 0.0
