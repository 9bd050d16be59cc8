from __future__ import annotations

import errno
import tempfile
from pathlib import Path

import numpy as np
import pytest

from mrslam.spatial.runtime.spool import ROWS, Spool


def filled(count: int) -> Spool:
    spool = Spool((np.float64, 3))
    for k in range(count):
        spool.add(np.array([k, 0.1 * k, -k]))
    return spool


def expected(count: int) -> np.ndarray:
    k = np.arange(count)
    return np.stack([k, 0.1 * k, -k], axis=1)


@pytest.mark.parametrize("count", [0, 1, ROWS - 1, ROWS, ROWS + 1, 5 * ROWS + 7])
def test_rows_come_back_in_order_from_memory_and_from_disk(count: int) -> None:
    spool = filled(count)
    assert np.array_equal(spool.rows, expected(count))
    spool.extend(expected(count + 9)[count:])  # reading took nothing away
    assert np.array_equal(spool.rows, expected(count + 9))


def test_rows_may_have_fields() -> None:
    spool = Spool([("stamp_ns", np.int64), ("pose", np.float32, 3)])
    for k in range(ROWS + 2):
        spool.add((k, (0.5, k, 2 * k)))
    assert spool.rows["stamp_ns"].tolist() == list(range(ROWS + 2))
    assert spool.rows["pose"][-1].tolist() == [0.5, ROWS + 1, 2 * ROWS + 2]


def open_files() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def test_a_short_one_opens_no_file_and_a_long_one_closes_its_own() -> None:
    before = open_files()
    short, long = filled(ROWS - 1), filled(9 * ROWS)
    assert open_files() == before + 1
    del short, long
    assert open_files() == before


class FullDisk:
    """A file that takes so many bytes and then no more, until there is room again."""

    def __init__(self, room: int) -> None:
        self.room = room
        self._file = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115 - as long as this
        self.seek, self.read, self.close = self._file.seek, self._file.read, self._file.close

    def write(self, part: bytes) -> int:
        taken = part[: max(0, self.room)]
        if not taken:
            raise OSError(errno.ENOSPC, "No space left on device")
        self.room -= len(taken)
        return self._file.write(taken)


def test_a_disk_that_is_full_loses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    disk = FullDisk(room=ROWS * 24 * 3 // 2)  # the second part fits by half
    monkeypatch.setattr(tempfile, "TemporaryFile", lambda **_: disk)
    spool = filled(4 * ROWS + 5)
    assert np.array_equal(spool.rows, expected(4 * ROWS + 5))
    disk.room = 10**9
    spool.extend(expected(6 * ROWS)[4 * ROWS + 5 :])
    assert np.array_equal(spool.rows, expected(6 * ROWS))
    assert not spool._waiting  # all went to the disk that has room again


def test_without_a_place_for_files_all_stays_in_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    def nowhere(**_: object) -> None:
        raise FileNotFoundError(errno.ENOENT, "No usable temporary directory found")

    monkeypatch.setattr(tempfile, "TemporaryFile", nowhere)
    assert np.array_equal(filled(3 * ROWS).rows, expected(3 * ROWS))
