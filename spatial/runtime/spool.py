"""Rows of numbers that only grow and are seldom read: hours of them cost no memory."""

from __future__ import annotations

import tempfile
import weakref
from contextlib import suppress
from typing import IO, Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

ROWS = 1024
"""Number of the newest rows that are in memory; a table that never gets longer never touches the disk."""


class Spool:
    """A growing table, kept in a temporary file that is gone with it; in memory for as long as no file can be had."""

    def __init__(self, row: DTypeLike) -> None:
        """Start with no rows; ``row`` is one's dtype, such as ``(np.float64, 7)`` or one with fields."""
        self._dtype = np.dtype(row)
        self._newest = np.zeros(ROWS, self._dtype)
        self._count = 0  # rows of `_newest` that are in use
        self._waiting: list[bytes] = []  # full blocks of rows that are not in the file yet
        self._stored = 0  # bytes in the file
        self._file: IO[bytes] | None = None

    def add(self, row: Any) -> None:
        """Append one row."""
        self._newest[self._count] = row
        self._count += 1
        if self._count == ROWS:
            self._put_away()

    def _put_away(self) -> None:
        self._waiting.append(self._newest.tobytes())
        self._count = 0
        with suppress(OSError):  # a full disk: what is left waits in memory, and is tried again with the next
            while self._waiting:
                self._write(self._waiting[0])
                self._waiting.pop(0)

    def _write(self, part: bytes) -> None:
        """Append to the file; a part that a full disk cut short is written again as a whole."""
        if self._file is None:
            self._file = tempfile.TemporaryFile(prefix="mrslam-", buffering=0)  # noqa: SIM115 - as long as the spool
            weakref.finalize(self, self._file.close)
        self._file.seek(self._stored)
        if self._file.write(part) < len(part):
            raise OSError("the disk is full")
        self._stored += len(part)

    @property
    def rows(self) -> NDArray[Any]:
        """``(n, ...)``, a copy of what was added."""
        parts = [*self._waiting, self._newest[: self._count].tobytes()]
        if self._file is not None:
            self._file.seek(0)
            parts.insert(0, self._file.read(self._stored))
        return np.frombuffer(b"".join(parts), self._dtype)

    def extend(self, rows: NDArray[Any]) -> None:
        """Append several rows."""
        for row in rows:
            self.add(row)
