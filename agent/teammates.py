"""Where teammates are, by their reports and the transforms to their maps, and which beams hit them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mrslam.comms import TeammatePose
from mrslam.mutual_detection import MutualDetectionConfig, TeammateTracker, mask_teammates, place_covariance
from mrslam.spatial import Scan, se2
from mrslam.spatial.se2 import Transform

REPORT_VALID_NS = 10_000_000_000
"""A teammate that reported its place longer ago than this may be anywhere, nanoseconds: it may have driven off by some
metres at usual speeds."""


class Teammates:
    """The newest report of each teammate's place, and a tracker that follows those whose maps are placed."""

    def __init__(self, config: MutualDetectionConfig) -> None:
        """Start without teammates."""
        self._enabled = config.enabled
        self._tracker = TeammateTracker(config)
        self._reports: dict[str, TeammatePose] = {}

    def observe(
        self, report: TeammatePose, T_own_peer: Transform | None, covariance: NDArray[np.float64] | None = None
    ) -> None:
        """Take a teammate's reported pose in its own map.

        ``T_own_peer (3,)`` maps points of that map into this robot's, where that is known; ``covariance (3, 3)`` : its
        covariance, m^2 and rad^2, if known.
        """
        self._reports[report.peer] = report
        if T_own_peer is not None:
            place = se2.compose(T_own_peer, report.T_map_base)[:2]
            spread_m2 = None if covariance is None else place_covariance(T_own_peer, covariance, place)
            self._tracker.observe(report.peer, report.stamp_ns, place, spread_m2)

    def mask(
        self, scan: Scan, T_map_base: Transform, T_team_map: Mapping[str, Transform], now_ns: int
    ) -> tuple[Scan, int]:
        """Return the scan without the beams that end at teammates, and how many these were.

        ``T_map_base (3,)`` : where the robot is expected to be. Teammates not in ``T_team_map`` are not tracked.
        """
        if not self._enabled:
            return scan, 0
        for lost in self._reports.keys() - T_team_map.keys():
            self._tracker.forget(lost)
        return mask_teammates(scan, T_map_base, *self._tracker.predict(now_ns))

    def places(self, T_team_map: Mapping[str, Transform], now_ns: int) -> dict[str, Transform]:
        """Return ``T_team_base (3,)`` of the teammates whose map is placed and whose report is recent."""
        return {
            peer: se2.compose(T_team_map[peer], report.T_map_base)
            for peer, report in sorted(self._reports.items())
            if peer in T_team_map and now_ns - report.stamp_ns < REPORT_VALID_NS
        }
