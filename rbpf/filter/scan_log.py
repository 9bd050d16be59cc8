"""A row for every scan that was used: when it was taken, and its pose in the frame of the keyframe before it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial.runtime.spool import Spool
from mrslam.spatial.se2 import Transform

ROW = np.dtype(
    [
        ("stamp_ns", np.int64),
        ("key", np.int32),
        ("T_key_base", np.float32, 3),
        ("way_m", np.float32),
        ("T_online", np.float32, 3),
    ]
)
"""Index of the newest keyframe, local motion since and its way, and the pose ``T_map_base`` reported with the scan."""


class ScanLog:
    """A row for every accepted scan."""

    def __init__(self) -> None:
        self._rows = Spool(ROW)

    def add(self, stamp_ns: int, key: int, T_key_base: Transform, way_m: float, T_map_base: Transform) -> None:
        """Remember a scan."""
        self._rows.add((stamp_ns, key, T_key_base, way_m, T_map_base))

    @property
    def rows(self) -> NDArray[Any]:
        """``(S,)`` of dtype ``ROW``, a copy."""
        return self._rows.rows

    def state(self) -> dict[str, Any]:
        """Return all of it."""
        rows = self.rows
        return {str(name): rows[name] for name in ROW.names or ()}

    @classmethod
    def of(cls, state: dict[str, Any]) -> ScanLog:
        """Return the log whose :meth:`state` this is."""
        log, rows = cls(), np.empty(len(state["stamp_ns"]), ROW)
        for name in ROW.names or ():
            rows[name] = state[name]
        log._rows.extend(rows)
        return log
