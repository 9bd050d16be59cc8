"""What a robot answers, repeats and takes up again in an exchange, message by message."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from mrslam.comms import CommsNode, ExchangeDone, ExchangeFailed, ExchangeStarted, MapUpdated, Send
from mrslam.comms.maps.store import MapStore
from mrslam.comms.wire.messages import (
    ALREADY_OVER,
    HOLD_ALL,
    Accept,
    Ask,
    Beacon,
    Done,
    Open,
    Refuse,
    decode,
    encode,
)
from tests.comms.puppet import BOOT, Puppet
from tests.comms.sealed import seal, team_keys
from tests.comms.team import QUICK, SECOND, big_map

PATIENT = replace(QUICK, peer_timeout_s=60.0)
"""Who says nothing is not taken for gone."""
EVER = 4 * round(QUICK.stall_timeout_s)
"""Seconds in which an exchange without progress ends."""


@pytest.fixture
def node() -> CommsNode:
    return CommsNode("a", "team", 7, PATIENT, seed=1)


def sent(node: CommsNode, effects: list[Any], *kinds: type) -> list[Any]:
    """Return the messages of these kinds among what a node does."""
    found = [decode(one.payload, node.team_tag, 1 << 24) for one in effects if isinstance(one, Send)]
    return [message for message in found if isinstance(message, kinds)]


def tell(node: CommsNode, message: Any, now_s: float) -> list[Any]:
    return node.on_message(encode(message, node.team_tag), round(now_s * SECOND), message.sender)


def ticks(node: CommsNode, first_s: float, last_s: float, *kinds: type) -> list[float]:
    """Return when a node that ticks ten times a second says something of these kinds, seconds."""
    times = [first_s + 0.1 * k for k in range(1, round((last_s - first_s) * 10) + 1)]
    return [round(t, 1) for t in times for _ in sent(node, node.on_tick(round(t * SECOND)), *kinds)]


def met(node: CommsNode, *digest: tuple[str, int, int]) -> Puppet:
    """Return a teammate b that has opened an exchange, as one that holds these versions."""
    puppet = Puppet(node, "b")
    puppet.meet(*digest)
    return puppet


def opened(node: CommsNode) -> tuple[Puppet, int]:
    """Return a teammate b that the node has opened an exchange with, and the exchange's number."""
    puppet = Puppet(node, "b")
    puppet.say(Beacon("b", BOOT, 1, 0, 500, 0, [], 0, None))
    node.set_link_quality("b", 1.0, 0)
    (message,) = sent(node, node.on_tick(0), Open)
    return puppet, message.xid


def test_an_open_that_comes_again_after_a_completed_exchange_begins_nothing(node):
    puppet = met(node)
    (done,) = puppet.say(Done("b", puppet.xid, HOLD_ALL))
    assert isinstance(done, ExchangeDone)
    assert puppet.say(Open("b", BOOT, puppet.xid, [], [])) == [Done("a", puppet.xid, ALREADY_OVER)]


def test_an_open_that_comes_again_after_a_failed_exchange_is_refused(node):
    puppet = met(node, ("b", BOOT, 3))
    (failed,) = (one for one in node.on_tick(EVER * SECOND) if isinstance(one, ExchangeFailed))
    assert failed.reason == "the peer fell silent"
    assert puppet.say(Open("b", BOOT, puppet.xid, [], [])) == [Refuse("a", puppet.xid, "that exchange is over")]


def test_a_peer_that_opens_again_and_again_is_not_silent(node):
    puppet = met(node, ("b", BOOT, 3))
    for second in range(1, 10):
        (answer,) = sent(node, tell(node, Open("b", BOOT, puppet.xid, [("b", BOOT, 3)], []), second), Accept)
        assert answer.xid == puppet.xid
        assert not [one for one in node.on_tick(second * SECOND) if isinstance(one, ExchangeFailed)]


def test_who_is_hardly_heard_is_refused(node):
    puppet = Puppet(node, "b")
    puppet.say(Beacon("b", BOOT, 1, 0, 500, 0, [], 0, None))
    assert puppet.say(Open("b", BOOT, 9, [], [])) == [Refuse("a", 9, "weak link")]
    node.set_link_quality("b", 1.0, 0)
    assert [type(one) for one in puppet.say(Open("b", BOOT, 10, [], []))] == [Accept, ExchangeStarted, Done]


def test_a_peer_that_was_refused_is_left_alone_for_a_while_and_nothing_has_failed(node):
    puppet, xid = opened(node)
    assert puppet.say(Refuse("b", xid, "busy")) == []
    (again,) = ticks(node, 0.0, 1.0, Open)
    assert 0.5 <= again <= 1.0


def test_a_refusal_in_the_middle_of_an_exchange_is_a_failure(node):
    puppet = met(node, ("b", BOOT, 3))
    (failed,) = puppet.say(Refuse("b", puppet.xid, "that exchange is over"))
    assert isinstance(failed, ExchangeFailed) and failed.reason == "that exchange is over"


def test_questions_are_repeated_after_longer_and_longer_silence(node):
    opened(node)
    assert ticks(node, 0.0, QUICK.stall_timeout_s, Open) == [0.6, 1.7, 3.8]


def test_the_peers_words_make_questions_quick_again(node):
    _, xid = opened(node)
    assert ticks(node, 0.0, 2.0, Open) == [0.6, 1.7]
    tell(node, Accept("b", BOOT, xid, [("b", BOOT, 3)], []), 2.0)
    assert ticks(node, 2.0, 3.0, Ask)[:1] == [2.6]


def test_a_proof_of_the_own_map_is_asked_for_again(node, tmp_path):
    node.seal_maps(seal(team_keys(tmp_path, "ab"), "a"))
    node.publish(big_map(200), 0)
    puppet = Puppet(node, "b")
    done = puppet.meet(("a", 10**6, 5))
    (asked,) = [one for one in done if isinstance(one, Ask)]
    assert (asked.robot, asked.epoch) == ("a", 10**6)
    assert len(ticks(node, 0.0, 2.0, Ask)) == 2


def test_an_accept_from_who_opened_changes_nothing(node):
    node.publish(big_map(200), 0)
    puppet = met(node, ("b", BOOT, 3))
    assert puppet.say(Accept("b", BOOT, puppet.xid, [], [])) == []
    assert node._exchanges.active["b"].theirs == {"b": (BOOT, 3)}


def test_who_has_said_that_it_holds_all_and_is_offered_more_says_so_again(node):
    puppet = Puppet(node, "b")
    assert Done("a", 1, HOLD_ALL) in puppet.meet()
    store = MapStore("b", BOOT, QUICK)
    store.publish(big_map(200))
    done = puppet.bring(store, "b")
    assert [type(one) for one in done if isinstance(one, MapUpdated | Done)] == [MapUpdated, Done]
