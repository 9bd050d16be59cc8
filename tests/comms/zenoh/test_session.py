"""Sessions that are closed while the machine is too busy for Zenoh."""

from __future__ import annotations

from typing import Any

import pytest
import zenoh

from mrslam.comms.zenoh import SensorPublisher, ZenohSensors, ZenohTransport, ZenohWatcher
from tests.comms.processes import free_port


class Slow:
    """A session that is closed later than Zenoh waits."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session

    def __getattr__(self, name: str) -> Any:
        return getattr(self._session, name)

    def close(self) -> None:
        self._session.close()  # type: ignore[no-untyped-call]
        raise zenoh.ZError("close operation timed out")


def transport(endpoint: str) -> ZenohTransport:
    return ZenohTransport("a", "team", listen=[endpoint])


def with_datagrams(endpoint: str) -> ZenohTransport:
    return ZenohTransport("a", "team", listen=[endpoint, f"udp/127.0.0.1:{free_port()}"])


def sensors(endpoint: str) -> ZenohSensors:
    return ZenohSensors("a", "team", endpoint, lambda *_: None, lambda *_: None)


def driver(endpoint: str) -> SensorPublisher:
    return SensorPublisher("a", "team", endpoint)


def watcher(endpoint: str) -> ZenohWatcher:
    return ZenohWatcher("team", connect=[endpoint])


@pytest.mark.parametrize("opened", [transport, with_datagrams, sensors, driver, watcher])
def test_a_session_that_is_closed_too_slowly_is_logged_and_all_are_closed(
    opened: Any, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    end = opened(f"tcp/127.0.0.1:{free_port()}")
    own = [name for name in ("_session", "_datagrams") if hasattr(end, name)]
    sessions = {getattr(end, name) for name in own}
    for name in own:
        monkeypatch.setattr(end, name, Slow(getattr(end, name)))
    end.close()
    are_closed = [session.is_closed() for session in sessions]
    for session in sessions:
        session.close()
    assert all(are_closed)
    assert caplog.text.count("close operation timed out") >= len(sessions)


class Stuck:
    """A subscriber that cannot be undeclared."""

    def undeclare(self) -> None:
        raise zenoh.ZError("undeclaring timed out")


def test_a_subscriber_that_cannot_be_undeclared_keeps_no_session_open(caplog: pytest.LogCaptureFixture) -> None:
    end = transport(f"tcp/127.0.0.1:{free_port()}")
    session = end._session
    end._subscribers.insert(0, Stuck())
    end.close()
    is_closed = session.is_closed()
    session.close()  # type: ignore[no-untyped-call]
    assert is_closed and "undeclaring timed out" in caplog.text
