"""A viewer beside this process: the one that is there, a new one, or a word why there is none."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest

from mrslam.sim_driver.view import files
from mrslam.spatial import InputError


@pytest.fixture
def port(monkeypatch: pytest.MonkeyPatch) -> Iterator[socket.socket]:
    """A port of this machine that the viewer's is for now; nobody listens there yet."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        monkeypatch.setattr(files, "PORT", taken.getsockname()[1])
        yield taken


def test_the_viewer_that_is_there_is_taken(port: socket.socket) -> None:
    port.listen()
    assert files.start_viewer() == f"rerun+http://127.0.0.1:{files.PORT}/proxy"


def test_where_there_is_no_screen_that_is_said(
    port: socket.socket, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    for screen in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(screen, raising=False)
    monkeypatch.setattr(files, "UP_WITHIN_S", 0.5)
    with pytest.raises(InputError, match="the viewer does not start, as where there is no screen; record with --rrd"):
        files.start_viewer()
    assert "disabled" not in capfd.readouterr().err
