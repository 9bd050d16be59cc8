from __future__ import annotations

import numpy as np
import pytest

from mrslam.comms import CommsConfig
from mrslam.comms.exchange.rendezvous import STRONG, WEAK, Rendezvous

S = 1_000_000_000


def rendezvous(own: str = "a", **settings) -> Rendezvous:
    return Rendezvous(own, CommsConfig(**settings), np.random.default_rng(0))


def test_threshold_and_hysteresis():
    r = rendezvous(link_threshold=0.8, link_hysteresis=0.05)
    states = []
    for quality in (0.79, 0.80, 0.76, 0.75, 0.74, 0.79, 0.81):
        r.on_quality("b", quality, 0)
        states.append(r.peers["b"].state)
    assert states == [WEAK, STRONG, STRONG, STRONG, WEAK, WEAK, STRONG]


@pytest.mark.parametrize("threshold", [0.0, 0.3, 1.0])
def test_a_dead_link_is_never_strong_and_a_perfect_one_always(threshold):
    r = rendezvous(link_threshold=threshold, link_hysteresis=0.5)
    r.on_quality("b", 1.0, 0)
    assert r.peers["b"].state == STRONG
    r.on_quality("b", 0.0, 0)
    assert r.peers["b"].state == WEAK


def test_the_first_meeting_is_at_once_and_the_next_after_the_timeout():
    r = rendezvous(exchange_timeout_s=30)
    assert r.due(0) == []
    r.on_quality("b", 0.9, 5 * S)
    assert r.due(5 * S) == ["b"]
    r.started("b")
    assert r.due(6 * S) == []
    r.done("b", 8 * S)
    assert r.due(37 * S) == []
    assert r.next_exchange_s("b", 37 * S) == pytest.approx(1.0)
    assert r.due(38 * S) == ["b"]


def meet(r: Rendezvous, peer: str, now_ns: int) -> None:
    r.started(peer)
    r.done(peer, now_ns)


def test_of_many_peers_met_before_a_few_are_met_in_each_timeout_and_all_get_their_turn():
    peers = [f"r{k:02d}" for k in range(15)]
    r = rendezvous(exchange_timeout_s=30, exchanges_per_timeout=4)
    for peer in peers:
        r.on_quality(peer, 1.0, 0)
    met = []
    for t in range(600):
        for peer in r.due(t * S):
            meet(r, peer, t * S)
            met.append((t, peer))
    assert [peer for _, peer in met[:15]] == peers and met[14][0] < 10  # strangers do not wait
    again = [(t, peer) for t, peer in met if t >= 10]
    assert max(sum(begin <= t < begin + 30 for t, _ in again) for begin in range(570)) == 4
    assert len(again) > 0.9 * 4 * 570 / 30
    assert [peer for _, peer in again[:30]] == 2 * peers
    assert again[-10][0] < 570 and 0.0 < r.next_exchange_s(again[-10][1], 600 * S) < 30.0  # it is not its turn


def test_who_is_met_for_the_first_time_is_met_at_once_however_many_were_met():
    r = rendezvous(exchange_timeout_s=30, exchanges_per_timeout=2)
    for peer in ("b", "c"):
        r.on_quality(peer, 1.0, 0)
        meet(r, peer, 0)
    r.on_quality("d", 1.0, 1 * S)
    assert r.due(1 * S) == ["d"]
    meet(r, "d", 1 * S)
    assert r.due(29 * S) == [] and r.due(30 * S) == ["b"]
    meet(r, "b", 30 * S)
    assert r.due(30 * S) == [] and r.due(31 * S) == ["c"]  # d and b were met in the last 30 s
    at_once = rendezvous(exchange_timeout_s=0, exchanges_per_timeout=1)
    for peer in ("b", "c"):
        at_once.on_quality(peer, 1.0, 0)
        meet(at_once, peer, 0)
    assert at_once.due(0) == ["b"]
    meet(at_once, "b", 0)
    assert at_once.due(0) == ["c"]


def test_nothing_is_due_on_a_weak_link():
    r = rendezvous(exchange_timeout_s=0)
    r.on_quality("b", 0.79, 0)
    assert r.due(10**18) == []
    assert r.next_exchange_s("b", 0) == float("inf")
    assert r.next_exchange_s("nobody", 0) == float("inf")


def test_one_of_two_opens_first():
    low, high = rendezvous("a"), rendezvous("b")
    low.on_quality("b", 1.0, 0)
    high.on_quality("a", 1.0, 0)
    assert low.due(0) == ["b"]
    assert high.due(0) == []
    assert high.due(S) == ["a"]  # where the other does not begin


def test_one_of_two_opens_first_whenever_they_come_into_reach():
    high = rendezvous("b", exchange_timeout_s=30)
    high.on_quality("a", 1.0, 100 * S)
    assert high.due(100 * S) == [] and high.due(101 * S) == ["a"]
    high.done("a", 101 * S)
    high.on_quality("a", 0.0, 102 * S)
    high.on_quality("a", 1.0, 200 * S)  # the timeout has passed by then
    assert high.due(200 * S) == [] and high.due(201 * S) == ["a"]


def test_nobody_is_met_for_nothing():
    r = rendezvous(max_parallel_exchanges=1)
    for peer in ("b", "c"):
        r.on_quality(peer, 1.0, 0)
    assert r.due(S, lambda peer: peer != "b") == ["c"]
    assert r.due(S, lambda peer: False) == []


def test_pauses_differ_so_that_two_robots_do_not_begin_together_again_and_again():
    refused, failed = rendezvous(), rendezvous(backoff_s=2, backoff_max_s=2)
    pauses_s = []
    for _ in range(20):
        refused.refused("b", 0)
        failed.failed("b", 0)
        pauses_s.append([one.peers["b"].paused_until_ns / S for one in (refused, failed)])
    by_refusal, by_failure = np.array(pauses_s).T
    assert 0.5 <= by_refusal.min() < 0.6 and 0.9 < by_refusal.max() <= 1.0
    assert 2.0 <= by_failure.min() < 2.1 and 2.3 < by_failure.max() <= 2.4


def test_failures_back_off_up_to_a_bound_and_success_ends_that():
    r = rendezvous(backoff_s=2, backoff_max_s=20, exchange_timeout_s=0)
    r.on_quality("b", 1.0, 0)
    pauses = []
    now = 0
    for _ in range(6):
        r.started("b")
        r.failed("b", now)
        pauses.append(r.next_exchange_s("b", now))
        now += round(pauses[-1] * S) + 1
        assert r.due(now) == ["b"]
    for pause, least in zip(pauses, (2, 4, 8, 16, 20, 20), strict=True):
        assert least <= pause <= 1.2 * least
    r.started("b")
    r.done("b", now)
    assert r.due(now) == ["b"]


def test_whoever_waited_longest_goes_first_and_all_get_their_turn():
    r = rendezvous(exchange_timeout_s=0, max_parallel_exchanges=2)
    peers = [f"p{k}" for k in range(7)]
    for peer in peers:
        r.on_quality(peer, 1.0, 0)
    met = []
    for round_ in range(7):
        now = (1 + round_) * S
        chosen = r.due(now)
        assert len(chosen) == 2
        for peer in chosen:
            r.started(peer)
        assert r.due(now) == []  # as many as may run at once
        for peer in chosen:
            r.done(peer, now)
        met += chosen
    assert {met.count(peer) for peer in peers} == {2}


def test_being_refused_is_no_failure():
    r = rendezvous()
    r.on_quality("b", 1.0, 0)
    r.started("b")
    r.refused("b", 0)
    assert r.peers["b"].failures == 0
    assert 0.5 <= r.next_exchange_s("b", 0) <= 1.0


def test_who_may_be_answered():
    r = rendezvous(link_threshold=0.8, link_hysteresis=0.05, max_parallel_exchanges=1)
    assert r.may_answer("b") == "weak link"
    r.on_quality("b", 0.76, 0)  # the other side may see it a little better
    assert r.may_answer("b") is None
    r.on_quality("b", 0.74, 0)
    assert r.may_answer("b") == "weak link"
    for peer in ("c", "d", "e"):
        r.on_quality(peer, 1.0, 0)
    r.started("c")
    assert r.may_answer("e") is None
    r.started("d")
    assert r.may_answer("e") == "busy"


def test_a_restarted_peer_is_met_at_once():
    r = rendezvous(exchange_timeout_s=1000)
    r.on_quality("b", 1.0, 0)
    r.done("b", 0)
    r.on_restart("b")
    r.on_quality("b", 1.0, S)
    assert r.due(S) == ["b"]
    r.done("b", S)
    r.forget("b")  # only out of reach: the timeout still holds
    r.on_quality("b", 1.0, 2 * S)
    assert r.due(3 * S) == []


def test_robots_that_come_and_go_under_ever_new_names_are_forgotten_and_those_in_sight_are_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("mrslam.comms.exchange.rendezvous.MOST_PEERS", 8)
    r = rendezvous()
    r.on_quality("b", 1.0, 0)
    r.on_quality("busy", 0.0, 0)
    r.started("busy")
    for k in range(50):
        r.on_quality(f"x{k}", 1.0, 0)
        r.done(f"x{k}", 0)
        r.forget(f"x{k}")
    assert sorted(r.peers) == ["b", "busy", "x44", "x45", "x46", "x47", "x48", "x49"]


def test_after_thousands_of_failures_in_a_row_the_pause_is_the_longest() -> None:
    r = rendezvous(backoff_s=2, backoff_max_s=200, exchange_timeout_s=0)
    r.on_quality("b", 1.0, 0)
    for _ in range(2000):
        r.failed("b", 0)
    assert 200.0 <= r.next_exchange_s("b", 0) <= 240.0


def test_a_failure_after_a_success_pauses_as_shortly_as_the_first_one() -> None:
    r = rendezvous(backoff_s=2, backoff_max_s=200, exchange_timeout_s=0)
    r.on_quality("b", 1.0, 0)
    for _ in range(6):
        r.failed("b", 0)
    r.done("b", 0)
    r.failed("b", 0)
    assert 2.0 <= r.next_exchange_s("b", 0) <= 2.4
