"""What a mapper keeps for its whole run: a row for every scan, and stamp and scan of every keyframe."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrslam.rbpf.filter.back_end import BackEnd
from mrslam.rbpf.filter.key_scan_log import KeyScanLog
from mrslam.rbpf.filter.known_places import is_known
from mrslam.rbpf.filter.scan_log import ScanLog
from mrslam.rbpf.filter.trajectory import spread
from mrslam.rbpf.rows import Rows
from mrslam.spatial import Keyframes, KeyScans
from mrslam.spatial.hits.views import Beams
from mrslam.spatial.se2 import Transform


class History:
    """Grows with every scan; poses of the past are put together from it and the best particle's keyframes."""

    def __init__(self) -> None:
        self._scans = ScanLog()
        self._key_stamps = Rows(1, np.int64)
        self._key_scans = KeyScanLog()

    @property
    def keys(self) -> int:
        """Number of keyframes."""
        return self._key_stamps.size

    @property
    def key_scans(self) -> KeyScans:
        """Scans of all keyframes, subsampled."""
        return self._key_scans.scans

    def add_key(self, stamp_ns: int, beams: Beams, T_map_key: Transform, T_new: Transform, *, is_sure: bool) -> bool:
        """Remember a keyframe at ``T_new (3,)``, and its scan where earlier ones do not show what it saw.

        ``T_map_key (K, 3)`` : where the best particle has those; ``is_sure`` : whether the new one's place is not in
        doubt. Return whether the scan was kept.
        """
        scan = self._key_scans.of_points(beams.points, beams.origin)
        is_kept = not (is_sure and is_known(T_map_key, self.key_scans, T_new, scan))
        self._key_stamps.add(stamp_ns)
        self._key_scans.add(scan if is_kept else KeyScans.blank(1))
        return is_kept

    def add_scan(self, stamp_ns: int, T_key_base: Transform, way_m: float, T_map_base: Transform) -> None:
        """Remember a scan: local motion ``(3,)`` and way since the newest keyframe, and the pose ``(3,)`` reported."""
        self._scans.add(stamp_ns, self.keys - 1, T_key_base, way_m, T_map_base)

    def keyframes(self, back: BackEnd) -> Keyframes:
        """Return the keyframes as the best particle has them now."""
        return Keyframes(self._key_stamps.rows[:, 0].copy(), back.filter.trajectory.copy())

    def trajectory(self, back: BackEnd) -> Keyframes:
        """Return stamp and pose of every scan, not of keyframes only, as the best particle has them now."""
        log = self._scans.rows
        motion, way = log["T_key_base"].astype(np.float64), log["way_m"].astype(np.float64)
        return Keyframes(log["stamp_ns"].copy(), spread(back.smoothed(), log["key"], motion, way, back.arrivals))

    def online_trajectory(self) -> Keyframes:
        """Return stamp and pose of every scan, not of keyframes only, as they were reported when the scan came."""
        log = self._scans.rows
        return Keyframes(log["stamp_ns"].copy(), log["T_online"].astype(np.float64))

    def state(self) -> dict[str, Any]:
        """Return all of it."""
        return {
            "scans": self._scans.state(), "key_stamps": self._key_stamps.rows, "key_scans": self._key_scans.state()
        }  # fmt: skip

    @classmethod
    def of(cls, state: dict[str, Any]) -> History:
        """Return the history whose :meth:`state` this is."""
        history = cls()
        history._scans, history._key_stamps = ScanLog.of(state["scans"]), Rows.of(state["key_stamps"])
        history._key_scans = KeyScanLog.of(state["key_scans"])
        return history
