"""Rows of numbers that only grow and are read once, at the end: hours of them cost no memory."""

from __future__ import annotations

import tempfile

import numpy as np
from numpy.typing import NDArray

IN_MEMORY_BYTES = 2**20
"""What is no longer than this never touches the disk."""


class Spool:
    """A growing table of floats; a long one is kept in a temporary file that is gone with it."""

    def __init__(self, columns: int) -> None:
        """Start with no rows."""
        self._columns = columns
        self._file = tempfile.SpooledTemporaryFile(IN_MEMORY_BYTES, prefix="mrslam-")  # noqa: SIM115 - as long as the spool

    def add(self, row: NDArray[np.float64]) -> None:
        """Append one row."""
        self._file.write(row.astype(np.float64).tobytes())

    @property
    def rows(self) -> NDArray[np.float64]:
        """``(n, columns)``, a copy of what was added."""
        self._file.seek(0)
        return np.frombuffer(self._file.read(), dtype=np.float64).reshape(-1, self._columns)
