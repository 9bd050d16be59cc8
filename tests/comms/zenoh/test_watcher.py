"""Who watches a team is told who is there, and is nobody there."""

from __future__ import annotations

import time

import pytest

from mrslam.comms import PeerJoined, Send
from mrslam.comms.transport.base import Sighting
from mrslam.comms.zenoh import ZenohTransport, ZenohWatcher
from mrslam.comms.zenoh.config import watcher_settings
from tests.comms.processes import free_port

DEADLINE_S = 60.0
"""Longest wait for what must come, seconds: all runs in this process."""


def seen_by(watcher: ZenohWatcher) -> list[Sighting]:
    """Return what comes next."""
    seen: list[Sighting] = []
    end = time.monotonic() + DEADLINE_S
    while not seen and time.monotonic() < end:
        seen += watcher.poll()
        time.sleep(0.02)
    return seen


def test_a_robot_that_was_there_before_is_seen_with_what_it_says_until_it_leaves():
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    robot = ZenohTransport("a", "team", listen=[endpoint])
    watcher = ZenohWatcher(None, connect=[endpoint])
    try:
        assert seen_by(watcher) == [Sighting("team", "a", None, True)]
        robot.send(Send(None, b"well", "status"))
        assert seen_by(watcher) == [Sighting("team", "a", b"well")]
        assert not [item for item in robot.poll(0.0) if isinstance(item, PeerJoined)]
        robot.close()
        assert seen_by(watcher) == [Sighting("team", "a", None, False)]
    finally:
        robot.close()
        watcher.close()


@pytest.mark.parametrize("multicast", [True, False])
def test_a_watcher_opens_no_port_and_answers_no_scout_unless_asked_to(multicast):
    chosen = watcher_settings("team", [], ["tcp/127.0.0.1:7447"], multicast, None)
    assert chosen["listen/endpoints"] == [] and chosen["scouting/multicast/listen"] is False
    asked = watcher_settings("team", ["tcp/127.0.0.1:7448"], [], multicast, None)
    assert [endpoint.partition("#")[0] for endpoint in asked["listen/endpoints"]] == ["tcp/127.0.0.1:7448"]
