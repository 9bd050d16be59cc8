"""Messages on their way out: the sender never waits, and what is sent makes room."""

from __future__ import annotations

import queue
import threading

import pytest

from mrslam.comms.transport.outbox import Outbox

DEADLINE_S = 60.0


def test_what_was_sent_makes_room() -> None:
    sent: queue.Queue[bytes] = queue.Queue()
    outbox = Outbox("test", lambda key, payload: sent.put(payload), max_bytes=10)
    for k in range(5):
        outbox.send("key", payload := bytes([k]) * 6)
        assert sent.get(timeout=DEADLINE_S) == payload
    assert outbox.refused == 0
    outbox.close()


def test_what_does_not_fit_is_refused_while_the_link_blocks_and_the_rest_goes_out_in_order(
    caplog: pytest.LogCaptureFixture,
) -> None:
    sent: queue.Queue[tuple[str, bytes]] = queue.Queue()
    begun, is_open = threading.Event(), threading.Event()

    def put(key: str, payload: bytes) -> None:
        begun.set()
        assert is_open.wait(DEADLINE_S)
        sent.put((key, payload))

    outbox = Outbox("test", put, max_bytes=10)
    outbox.send("a", b"111111")
    assert begun.wait(DEADLINE_S)
    for key, size in (("b", 6), ("c", 6), ("c", 6), ("e", 6), ("d", 4)):
        outbox.send(key, b"2" * size)
    assert outbox.refused == 3
    assert caplog.messages == [f"test: {count} messages were not sent, the last to c" for count in (1, 2)]
    is_open.set()
    outbox.close(DEADLINE_S)
    assert [sent.get_nowait()[0] for _ in range(3)] == ["a", "b", "d"] and sent.empty()
    outbox.send("f", b"")
    assert outbox.refused == 4  # it is closed


def test_a_message_that_fails_takes_no_other_with_it(caplog: pytest.LogCaptureFixture) -> None:
    sent = []

    def put(key: str, payload: bytes) -> None:
        if key == "bad":
            raise OSError("no route")
        sent.append(key)

    outbox = Outbox("test", put)
    for key in ("a", "bad", "b"):
        outbox.send(key, b"x")
    outbox.close(DEADLINE_S)
    assert sent == ["a", "b"] and "bad was not sent: no route" in caplog.text
