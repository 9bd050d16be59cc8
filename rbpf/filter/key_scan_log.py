"""The scans of all keyframes, subsampled for those who match them later: teammates, and the joint pose graph."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.rows import Rows
from mrslam.spatial.key_scans import APART_M, POINTS_MOST, KeyScans
from mrslam.spatial.matching.scan_points import POINT_COLUMNS, spaced


class KeyScanLog:
    """A growing :class:`KeyScans`; the values handed out share its memory and stay as they are."""

    def __init__(self) -> None:
        self._ends, self._polar, self._origins = Rows(1, np.int32), Rows(2, np.uint16), Rows(2, np.float32)
        self._ends.add(0)
        self._subsample = np.zeros((POINTS_MOST, POINT_COLUMNS))

    def of_points(self, points: NDArray[np.float64], origin: NDArray[np.float64]) -> KeyScans:
        """Return a keyframe's points ``(N, 5)`` in beam order, base frame, seen from ``origin (2,)``, subsampled."""
        count = spaced(points, origin, APART_M, POINTS_MOST, self._subsample)
        return KeyScans.of_points([self._subsample[:count, :2]], origin)

    def add(self, scan: KeyScans) -> None:
        """Take the scan of one more keyframe."""
        self._polar.extend(scan.polar)
        self._ends.add(self._polar.size)
        self._origins.add(scan.origins[0])

    @property
    def scans(self) -> KeyScans:
        """All of them."""
        return KeyScans.of_checked(
            *(_frozen(rows) for rows in (self._ends.rows[:, 0], self._polar.rows, self._origins.rows))
        )

    def state(self) -> dict[str, Any]:
        """Return all of it."""
        return {"ends": self._ends.rows, "polar": self._polar.rows, "origins": self._origins.rows}

    @classmethod
    def of(cls, state: dict[str, Any]) -> KeyScanLog:
        """Return the log whose :meth:`state` this is."""
        log = cls()
        log._ends, log._polar, log._origins = (Rows.of(state[name]) for name in ("ends", "polar", "origins"))
        KeyScans(log._ends.rows[:, 0], log._polar.rows, log._origins.rows)  # checks them
        return log


def _frozen(rows: NDArray[Any]) -> NDArray[Any]:
    view = rows.view()
    view.flags.writeable = False
    return view
