"""Poses of every scan, hung on the keyframes of a particle."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spatial import se2
from spatial.se2 import Transform


class Rows:
    """A growing ``(n, columns) float64`` or int64 table."""

    def __init__(self, columns: int, dtype: type = np.float64) -> None:
        self._data: NDArray[Any] = np.zeros((64, columns), dtype=dtype)
        self.size = 0

    def add(self, row: Any) -> None:
        """Append one row."""
        if self.size == self._data.shape[0]:
            self._data = np.concatenate([self._data, np.zeros_like(self._data)])
        self._data[self.size] = row
        self.size += 1

    @classmethod
    def of(cls, rows: NDArray[Any]) -> Rows:
        """Return a table that holds these rows."""
        table = cls(rows.shape[1], rows.dtype.type)
        table._data = np.concatenate([rows, np.zeros((max(64, rows.shape[0]), rows.shape[1]), dtype=rows.dtype)])
        table.size = rows.shape[0]
        return table

    @property
    def rows(self) -> NDArray[Any]:
        """View of what was added."""
        return self._data[: self.size]


def spread(
    T_map_key: NDArray[np.float64],
    key: NDArray[np.int64],
    T_key_base: NDArray[np.float64],
    way: NDArray[np.float64],
    arrival: NDArray[np.float64],
) -> Transform:
    """Return ``(S, 3)`` map poses of scans that were tracked locally from keyframe ``key[i]`` on.

    ``T_key_base (S, 3)`` is the local motion since that keyframe, ``way (S,)`` how much way was covered since, and
    ``arrival (K, 4)`` the local motion from each keyframe to the next and its way. What the local motion missed at the
    next keyframe is spread along the way, so that the scans in between join both.
    """
    poses = se2.compose(T_map_key[key], T_key_base)
    last = T_map_key.shape[0] - 1
    if last < 1:
        return poses
    nxt = np.minimum(key + 1, last)
    has_next = key < last
    # What has to be added, in the frame of the arriving base, for the local chain to end where the next keyframe is.
    ends = se2.compose(T_map_key[key], arrival[nxt, :3])
    missed = se2.between(ends, T_map_key[nxt])
    share = np.where(has_next, way / np.maximum(arrival[nxt, 3], 1e-9), 0.0)
    return se2.compose(poses, missed * np.clip(share, 0.0, 1.0)[:, None])
