"""The queue of arrivals: a robot that waits on it can be woken."""

from __future__ import annotations

import threading
import time

import pytest

from mrslam.comms import Incoming
from mrslam.comms.transport.base import PeerJoined
from mrslam.comms.transport.inbox import Inbox


def test_a_wake_ends_the_wait_under_way() -> None:
    inbox, ended = Inbox(), threading.Event()

    def wait() -> None:
        inbox.take(60.0)
        ended.set()

    threading.Thread(target=wait, daemon=True).start()
    inbox.wake()
    assert ended.wait(30.0)


def test_a_wake_before_the_wait_ends_that_one_alone() -> None:
    inbox = Inbox()
    inbox.wake()
    begin_s = time.monotonic()
    assert inbox.take(60.0) == []
    assert inbox.take(0.01) == []
    assert 0.01 <= time.monotonic() - begin_s < 60.0


def test_what_arrived_is_taken_with_the_wake() -> None:
    inbox = Inbox()
    inbox.put(Incoming(b"x", "r2", "control"))
    inbox.wake()
    assert [one.payload for one in inbox.take(0.0) if isinstance(one, Incoming)] == [b"x"]


def test_what_was_taken_makes_room_and_what_is_beyond_the_bound_is_counted_and_told(
    caplog: pytest.LogCaptureFixture,
) -> None:
    inbox = Inbox(max_bytes=10)
    for _ in range(5):
        inbox.put(Incoming(b"12345678", "r2", "bulk"))
        assert len(inbox.take(0.0)) == 1
    assert not inbox.refused
    for _ in range(2):
        inbox.put(Incoming(b"12345678", "r2", "bulk"))
    assert len(inbox.take(0.0)) == 1 and inbox.refused == {"bulk": 1}
    assert caplog.text.count("not taken") == 1 and "1 messages (bulk) were not taken" in caplog.text
    caplog.clear()
    inbox.put(Incoming(b"12345678", "r2", "bulk"))
    for _ in range(4):
        inbox.put(Incoming(b"12345678", "r2", "bulk"))
    assert inbox.refused == {"bulk": 5}
    assert [message.split()[0] for message in caplog.messages] == ["2", "4"]  # 3 and 5 are not told


def test_beacons_are_taken_after_all_else_and_the_oldest_make_room() -> None:
    inbox, joined = Inbox(max_beacons=2), PeerJoined("r2")
    for k in range(3):
        inbox.put(Incoming(bytes([k]), "r2", "beacon"))
    assert inbox.refused == {"beacon": 1}
    inbox.put(joined)
    inbox.put(Incoming(b"x", "r2", "bulk"))
    first, *rest = inbox.take(0.0)
    assert first is joined  # a peer whose beacon came first would be a stranger
    assert [one.payload for one in rest if isinstance(one, Incoming)] == [b"x", b"\x01", b"\x02"]
