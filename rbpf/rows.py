"""Tables that grow row by row."""

from __future__ import annotations

from mmap import ACCESS_COPY, mmap
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Rows:
    """A growing ``(n, columns)`` table of numbers."""

    def __init__(self, columns: int, dtype: type = np.float64) -> None:
        self._data = _pages(64, columns, np.dtype(dtype))
        self.size = 0

    def add(self, row: Any) -> None:
        """Append one row."""
        if self.size == self._data.shape[0]:
            grown = _pages(2 * self.size, self._data.shape[1], self._data.dtype)
            grown[: self.size] = self._data
            self._data = grown
        self._data[self.size] = row
        self.size += 1

    def extend(self, rows: NDArray[Any]) -> None:
        """Append several rows ``(n, columns)``."""
        end = self.size + rows.shape[0]
        if end > self._data.shape[0]:
            grown = _pages(max(2 * self._data.shape[0], end), self._data.shape[1], self._data.dtype)
            grown[: self.size] = self.rows
            self._data = grown
        self._data[self.size : end] = rows
        self.size = end

    @classmethod
    def of(cls, rows: NDArray[Any]) -> Rows:
        """Return a table that holds these rows."""
        table = cls(rows.shape[1], rows.dtype.type)
        table.size = rows.shape[0]
        table._data = _pages(table.size + max(64, table.size), rows.shape[1], rows.dtype)
        table._data[: table.size] = rows
        return table

    @property
    def rows(self) -> NDArray[Any]:
        """``(n, columns)``, a view of the rows added so far."""
        return self._data[: self.size]


def _pages(count: int, columns: int, dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return a zeroed table on memory pages of its own: unused ones cost nothing, and all are freed with the table.

    The allocator would keep what a growing table leaves behind: a step in memory with every doubling.
    """
    own = mmap(-1, count * columns * dtype.itemsize, access=ACCESS_COPY)
    return np.frombuffer(own, dtype=dtype).reshape(count, columns)
