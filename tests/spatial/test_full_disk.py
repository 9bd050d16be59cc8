"""Files that a robot can do without."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest

from mrslam.spatial import InputError
from mrslam.spatial.files.full_disk import unwritten_is_logged


def test_a_full_disk_is_logged_in_one_line_and_nothing_else_is_hidden(caplog: pytest.LogCaptureFixture) -> None:
    with unwritten_is_logged("r1", Path("scans.npz")):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert caplog.messages == ["r1: scans.npz cannot be written (No space left on device)"]
    with pytest.raises(InputError, match="no pose"), unwritten_is_logged("r1", Path("scans.npz")):
        raise InputError("no pose")
