from __future__ import annotations

import os
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
import zenoh

from mrslam.comms import (
    CommsConfig,
    DuplicateId,
    ExchangeDone,
    Incoming,
    PeerGone,
    PeerJoined,
    PeerLeft,
    PeerSeen,
    Send,
    load_keys,
    make_team_keys,
)
from mrslam.comms.doctor import multicast
from mrslam.comms.transport.local_robots import local_robots
from mrslam.comms.zenoh import ZenohTransport, config
from mrslam.comms.zenoh.config import LEASE_MS, split_datagrams
from mrslam.comms.zenoh.session import warn_if_open
from mrslam.spatial import InputError
from tests.comms.processes import DEADLINE_S, Robot, free_port
from tests.comms.team import big_map

EAGER = CommsConfig(exchange_timeout_s=2.0, beacon_period_s=0.1, beacon_window=20)
PATIENT = CommsConfig(exchange_timeout_s=2.0, beacon_period_s=0.1, beacon_window=20, peer_timeout_s=10 * DEADLINE_S)
"""Silence alone makes no robot gone before the test has failed: only what the network says of it does."""


def collect(transport: ZenohTransport, count: int, deadline_s: float = DEADLINE_S) -> list:
    end, items = time.monotonic() + deadline_s, []
    while len(items) < count and time.monotonic() < end:
        items += transport.poll(0.1)
    return items


@pytest.fixture
def pair():
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    a = ZenohTransport("a", "team", listen=[endpoint])
    b = ZenohTransport("b", "team", connect=[endpoint])
    yield a, b
    a.close()
    b.close()


def test_all_lanes_arrive_with_their_sender(pair):
    a, b = pair
    assert collect(b, 1) == [PeerJoined("a")]
    assert collect(a, 1) == [PeerJoined("b")]
    a.send(Send("b", b"question", "control"))
    a.send(Send("b", b"map" * 5000, "bulk"))
    a.send(Send(None, b"here", "beacon"))
    a.send(Send(None, b"bye", "control"))
    got = collect(b, 4)
    assert {(i.lane, i.payload[:4], i.sender) for i in got} == {
        ("control", b"ques", "a"),
        ("bulk", b"mapm", "a"),
        ("beacon", b"here", "a"),
        ("control", b"bye", "a"),
    }
    assert a.links() == b.links() == 1
    assert a.poll(0.0) == []  # nobody hears himself


def test_what_is_for_another_is_not_delivered(pair):
    a, b = pair
    assert collect(a, 1) == [PeerJoined("b")]  # a sees b's token only after b's subscriptions
    collect(b, 1)
    a.send(Send("c", b"secret", "control"))
    a.send(Send("b", b"yours", "control"))
    assert [i.payload for i in collect(b, 1)] == [b"yours"]
    assert b.poll(0.0) == []


def test_a_clean_departure_is_seen(pair):
    a, b = pair
    collect(a, 1)
    b.close()
    assert collect(a, 1) == [PeerLeft("b")]
    b.close()
    b.send(Send("a", b"late", "control"))


def test_a_robot_is_gone_when_the_last_session_under_its_name_is_gone():
    """One that starts again is here before the network has noticed that its first process died."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    a, *twins = (ZenohTransport("a", "team", listen=[endpoint]),
                 *(ZenohTransport("b", "team", connect=[endpoint]) for _ in range(2)))  # fmt: skip
    try:
        for twin in twins:
            twin.send(Send("a", b"here", "control"))
        heard = collect(a, 3)
        assert sorted(type(item).__name__ for item in heard) == ["Incoming", "Incoming", "PeerJoined"]
        twins[0].close()
        time.sleep(0.5)
        twins[1].send(Send("a", b"still here", "control"))
        assert [item.payload for item in collect(a, 1)] == [b"still here"]
        twins[1].close()
        assert collect(a, 1) == [PeerLeft("b")]
    finally:
        for one in (a, *twins):
            one.close()


def test_sessions_that_are_gone_are_forgotten_and_one_that_was_never_here_does_not_leave(pair):
    a, b = pair
    assert collect(a, 1) == [PeerJoined("b")]
    assert collect(b, 1) == [PeerJoined("a")]
    for kind, session in ((zenoh.SampleKind.DELETE, "7"), (zenoh.SampleKind.PUT, "8"), (zenoh.SampleKind.DELETE, "9")):
        a._on_token(SimpleNamespace(key_expr=f"mrslam/team/c/alive/{session}", kind=kind))
    assert a.poll(0.0) == [PeerJoined("c")]
    a._on_token(SimpleNamespace(key_expr="mrslam/team/c/alive/8", kind=zenoh.SampleKind.DELETE))
    assert a.poll(0.0) == [PeerLeft("c")] and list(a._tokens) == ["b"]


def test_what_comes_on_no_lane_is_not_delivered(pair):
    a, b = pair
    assert collect(a, 1) == [PeerJoined("b")]
    collect(b, 1)
    a._session.put("mrslam/team/a/to/b/strange", b"x")
    a.send(Send("b", b"yours", "control"))
    assert [i.payload for i in collect(b, 1)] == [b"yours"]
    assert b.poll(0.5) == []


def test_another_team_on_the_same_network_is_invisible(pair):
    _, b = pair
    collect(b, 1)
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    stranger = ZenohTransport("a", "rivals", listen=[endpoint])
    friend = ZenohTransport("c", "rivals", connect=[endpoint])
    try:
        assert collect(stranger, 1) == [PeerJoined("c")]
        assert collect(friend, 1) == [PeerJoined("a")]
        stranger.send(Send("b", b"x", "control"))
        stranger.send(Send("c", b"y", "control"))
        assert [i.payload for i in collect(friend, 1)] == [b"y"]
        assert not [i for i in b.poll(0.0) if isinstance(i, Incoming)]
    finally:
        stranger.close()
        friend.close()


def test_clients_of_a_router_meet():
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    ends = [ZenohTransport("hub", "team", listen=[endpoint], mode="router")]
    ends += [ZenohTransport(name, "team", connect=[endpoint], mode="client") for name in "ab"]
    try:
        joined = {i.peer for i in collect(ends[2], 2)}
        assert joined == {"hub", "a"}
        assert {i.peer for i in collect(ends[1], 2)} == {"hub", "b"}
        ends[1].send(Send("b", b"through the hub", "bulk"))
        assert [i.payload for i in collect(ends[2], 1)] == [b"through the hub"]
        assert [end.links() for end in ends[1:]] == [1, 1]
    finally:
        for end in ends:
            end.close()


def test_a_client_does_not_start_without_its_router(monkeypatch):
    monkeypatch.setattr(config, "CLIENT_TIMEOUT_MS", 200)
    with pytest.raises(InputError, match="cannot be opened"):
        ZenohTransport("a", "team", connect=[f"tcp/127.0.0.1:{free_port()}"], mode="client")


def test_beacons_come_by_datagrams_where_there_are_endpoints_of_them():
    endpoint = f"udp/127.0.0.1:{free_port()}"
    a, b = ZenohTransport("a", "team", listen=[endpoint]), ZenohTransport("b", "team", connect=[endpoint])
    try:
        heard, end = [], time.monotonic() + DEADLINE_S
        while not heard and time.monotonic() < end:
            a.send(Send(None, b"here", "beacon"))
            heard = b.poll(0.1)
        assert heard[0] == Incoming(b"here", "a", "beacon")
    finally:
        a.close()
        b.close()


def test_only_what_may_lose_messages_carries_beacons_alone():
    endpoints = ["tcp/h:1", "udp/h:2", "quic/h:3", "quic/h:4?rel=0", "tls/h:5"]
    assert split_datagrams(endpoints) == (["tcp/h:1", "quic/h:3", "tls/h:5"], ["udp/h:2", "quic/h:4?rel=0"])


def test_who_left_is_no_robot_of_this_machine_any_more(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    a = ZenohTransport("a", "team", listen=[endpoint])
    try:
        assert [(robot.robot, robot.endpoints) for robot in local_robots()] == [("a", [endpoint])]
    finally:
        a.close()
    assert local_robots() == []


def test_fifty_opens_and_closes_leave_no_thread():
    def open_and_close(times: int) -> int:
        for _ in range(times):
            ZenohTransport("a", "team", listen=[f"tcp/127.0.0.1:{free_port()}"]).close()
        # Zenoh keeps one pool of its own for the whole process, so what counts is that nothing grows.
        assert not [t.name for t in threading.enumerate() if t.name.endswith(("-control", "-bulk"))]
        return threads()

    def threads() -> int:
        return len(list(Path("/proc/self/task").iterdir()))

    few = open_and_close(5)
    left, deadline = open_and_close(45), time.monotonic() + DEADLINE_S
    while left > few + 2 and time.monotonic() < deadline:  # on a busy machine the pool's last ones leave later
        time.sleep(0.5)
        left = threads()
    assert left <= few + 2


@pytest.mark.parametrize("endpoint", ["127.0.0.1:7447", "tcp/", "http/localhost:80", "tls/127.0.0.1:7447"])
def test_endpoints_that_cannot_work_say_why(endpoint):
    with pytest.raises(InputError, match="endpoint"):
        ZenohTransport("a", "team", listen=[endpoint])


def test_a_port_in_use_is_a_clear_error():
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    first = ZenohTransport("x", "team", listen=[endpoint])
    try:
        with pytest.raises(InputError, match="cannot be opened"):
            ZenohTransport("y", "team", listen=[endpoint])
    finally:
        first.close()


def test_an_open_team_is_warned_about(caplog):
    ZenohTransport("a", "team", listen=[f"tcp/127.0.0.1:{free_port()}"]).close()
    assert caplog.text == ""  # nobody else reaches this machine's own addresses
    ZenohTransport("a", "team", listen=[f"tcp/0.0.0.0:{free_port()}"]).close()
    assert "team team is open" in caplog.text


def test_whom_multicast_finds_is_warned_and_a_closed_team_is_not(tmp_path, caplog):
    make_team_keys(tmp_path, "team", ["a"])
    warn_if_open("team", ["tls/0.0.0.0:7447"], True, load_keys(tmp_path / "a", "a", "team"))
    assert "is open" not in caplog.text
    warn_if_open("team", [], True, None)
    assert "team team is open" in caplog.text


def test_a_silent_link_is_given_up_before_three_seconds():
    assert LEASE_MS < 1000 * CommsConfig().peer_timeout_s == 3000.0


def test_processes_exchange_and_the_network_says_who_was_killed():
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    a = Robot("a", config=EAGER, listen=[endpoint], local_map=big_map(300))
    b = Robot("b", config=PATIENT, connect=[endpoint])
    try:
        done = b.effect(ExchangeDone, peer="a")
        assert done[2].costs.tiles > 10
        b.wait(lambda report: report[0] == "digest" and "a" in report[2], "a's map")
        a.kill()
        assert "lost" in b.effect(PeerGone)[2].reason
        again = Robot("a", config=EAGER, listen=[endpoint], local_map=big_map(200, seed=2))
        try:
            heard = len(b.heard)
            b.wait(lambda r: r in b.heard[heard:] and r[0] == "effect" and isinstance(r[2], PeerSeen), "a's return")
            b.wait(lambda r: r in b.heard[heard:] and r[0] == "digest", "a's new map")
        finally:
            again.stop()
        left = len(b.heard)
        b.wait(lambda r: r in b.heard[left:] and r[0] == "effect" and isinstance(r[2], PeerGone), "a's departure")
    finally:
        a.stop()
        b.stop()


def gone(robot: Robot, since_s: float) -> str:
    """Wait for the news that a teammate is gone, and return why."""
    heard = robot.wait(lambda r: r[0] == "effect" and isinstance(r[2], PeerGone) and r[1] >= since_s, "a departure")
    return heard[2].reason


def test_the_network_says_who_hangs():
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    a = Robot("a", config=EAGER, listen=[endpoint])
    b = Robot("b", config=PATIENT, connect=[endpoint])
    try:
        a.effect(PeerSeen)
        b.effect(PeerSeen)
        assert "lost" in gone(b, a.freeze())
    finally:
        a.stop()
        b.stop()


def exchange_and_leave(a: Robot, b: Robot, *, by_router: bool = False) -> None:
    """Both hold a's map in the end; a's departure is seen."""
    b.effect(ExchangeDone, peer="a")
    b.wait(lambda report: report[0] == "digest" and "a" in report[2], "a's map")
    left_s = time.monotonic()
    a.stop()
    reason = gone(b, left_s)
    # On its way through a router the goodbye may be overtaken by the token's fall, which has the higher priority.
    assert reason == "left" or (by_router and "lost" in reason)


@pytest.mark.skipif(multicast().level != "ok", reason="no multicast here")
def test_robots_find_each_other_by_multicast():
    team = f"multicast-{os.getpid()}"
    a = Robot("a", team=team, config=EAGER, multicast=True, local_map=big_map(200))
    b = Robot("b", team=team, config=EAGER, multicast=True)
    try:
        exchange_and_leave(a, b)
    finally:
        a.stop()
        b.stop()


@pytest.mark.parametrize("mode", ["client", "peer"])
def test_robots_exchange_through_a_router(mode):
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    hub = Robot("hub", config=EAGER, listen=[endpoint], mode="router").up()
    # Clients are served by the router; peers only learn from it where the others listen.
    listen = [[f"tcp/127.0.0.1:{free_port()}"] if mode == "peer" else [] for _ in "ab"]
    a = Robot("a", config=EAGER, connect=[endpoint], listen=listen[0], mode=mode, local_map=big_map(200))
    b = Robot("b", config=EAGER, connect=[endpoint], listen=listen[1], mode=mode)
    try:
        exchange_and_leave(a, b, by_router=True)
    finally:
        for robot in (a, b, hub):
            robot.stop()


def test_two_processes_with_one_name_are_both_told():
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    first = Robot("a", config=EAGER, listen=[endpoint]).up()
    first.drain(0.5)
    second = Robot("a", config=EAGER, connect=[endpoint])
    try:
        assert second.effect(DuplicateId)[2].am_newcomer
        assert not first.effect(DuplicateId)[2].am_newcomer
    finally:
        first.stop()
        second.stop()
