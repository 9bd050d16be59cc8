"""A robot that only localises: once its place in a saved map is known it tracks its pose there, and maps no more."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.agent.effects import Event
from mrslam.rbpf import FixedMap, Localiser, MapperConfig, UpdateInfo, has_stood
from mrslam.spatial import Keyframes, OccupancyGrid, Scan, se2
from mrslam.spatial.runtime.spool import Spool
from mrslam.spatial.se2 import Transform

TRY_NS = 1_000_000_000
"""Least time between two tries to begin, nanoseconds: each is a search of some milliseconds."""
ROW = np.dtype([("stamp_ns", np.int64), ("number", np.int32), ("T_saved_base", np.float64, 3)])
"""A tracked scan: its stamp, the number of the own map at the time, and the pose in the saved map's frame."""


class Tracking:
    """Begins where the robot is localised, and ends where the saved map does not show what it sees any more.

    Meanwhile the own map stays as it is, and so does its place: poses are told in either frame.
    """

    def __init__(self, config: MapperConfig) -> None:
        """Start without a saved map to track in."""
        self.map_id: str | None = None
        """The saved map to track in; None where the robot maps on."""
        self.lost = ""
        """Why it lost its place last, since when it has not found it again."""
        self.scans = 0
        """Scans tracked so far."""
        self._config = config
        self._fixed: tuple[OccupancyGrid, FixedMap] | None = None
        self._localiser: Localiser | None = None
        self._T_own_saved: Transform = se2.IDENTITY
        self._left: dict[str, Any] | None = None
        self._rows = Spool(ROW)
        self._next_try_ns = -(10**12)

    @property
    def is_on(self) -> bool:
        """Whether the robot tracks, and does not map."""
        return self._localiser is not None

    @property
    def was_left(self) -> bool:
        """Whether the robot tracked when its checkpoint was written, and has had no scan since."""
        return self._left is not None

    @property
    def localiser(self) -> Localiser:
        """What tracks it; only while it :attr:`is_on`."""
        assert self._localiser is not None
        return self._localiser

    @property
    def T_saved_base(self) -> Transform:
        """``(3,)``: the pose in the saved map's frame."""
        return self.localiser.T_map_base

    @property
    def T_own_base(self) -> Transform:
        """``(3,)``: the pose in the own map's frame."""
        return se2.compose(self._T_own_saved, self.T_saved_base)

    @property
    def T_saved_own(self) -> Transform:
        """``(3,)``: maps points of the own map to the saved map."""
        return se2.inverse(self._T_own_saved)

    @property
    def places(self) -> dict[str, Transform]:
        """By saved map: ``T_own_saved (3,)``, of the one in which the robot tracks; empty where it does not."""
        return {} if self.map_id is None or not self.is_on else {self.map_id: self._T_own_saved}

    @property
    def covariance(self) -> NDArray[np.float64]:
        """``(3, 3)`` of the pose, in the own map's axes: m^2, rad^2."""
        return se2.turned_covariance(self.localiser.covariance, float(self._T_own_saved[2]))

    def is_due(self, now_ns: int) -> bool:
        """Return whether beginning may be tried, and take it as tried."""
        if self.map_id is None or self.is_on or now_ns < self._next_try_ns:
            return False
        self._next_try_ns = now_ns + TRY_NS
        return True

    def begin(
        self,
        grid: OccupancyGrid,
        scan: Scan,
        T_odom_base: Transform | None,
        T_saved_base: Transform,
        T_own_base: Transform,
        *,
        has_driven: bool = False,
    ) -> bool:
        """Begin where a scan was taken, ``(3,)`` in the saved map's frame and in the own map's, if it fits there.

        ``grid`` : the saved map. ``has_driven`` : whether the robot saw nothing on its way there.
        """
        if self._fixed is None or self._fixed[0] is not grid:
            self._fixed = (grid, FixedMap(grid, self._config.resolution_m))
        localiser = Localiser(self._fixed[1], self._config)
        if not localiser.begin(scan, T_odom_base, T_saved_base, has_driven=has_driven):
            return False
        self._localiser, self.lost = localiser, ""
        self._T_own_saved = se2.compose(T_own_base, se2.inverse(localiser.T_map_base))
        return True

    def update(self, scan: Scan, T_odom_base: Transform | None, number: int) -> UpdateInfo:
        """Track one scan; ``number`` : of the own map."""
        info = self.localiser.update(scan, T_odom_base)
        self.scans += 1
        if info.reason is None:
            self._rows.add((scan.stamp_ns, number, info.T_map_base))
        return info

    def watch(self, now_ns: int) -> Event | None:
        """End where the robot is lost; return the event then."""
        localiser = self.localiser
        if not (localiser.fit.is_lost or localiser.is_carried):
            return None
        self.lost = "it was carried off" if localiser.is_carried else localiser.fit.words
        x, y, theta = (round(float(value), 4) for value in localiser.T_map_base)
        self._localiser = None
        return Event(now_ns, "lost", {"map": self.map_id, "reason": self.lost, "x_m": x, "y_m": y, "theta_rad": theta})

    def stop(self) -> None:
        """The own map begins anew."""
        self._localiser = self._left = None

    def began(self, now_ns: int) -> Event:
        """Return the event that it has begun."""
        x, y, theta = (round(float(value), 4) for value in self.T_saved_base)
        fields = {"map": self.map_id, "x_m": x, "y_m": y, "theta_rad": theta, "fit": round(self.localiser.inliers, 3)}
        return Event(now_ns, "tracking", fields)

    def rows(self, number: int | None = None) -> Keyframes:
        """Return the tracked poses in the saved map's frame; those on the own map of a ``number``: in its frame."""
        rows = self._rows.rows
        if number is None:
            return Keyframes(rows["stamp_ns"].copy(), rows["T_saved_base"].copy())
        rows = rows[rows["number"] == number]
        return Keyframes(rows["stamp_ns"].copy(), se2.compose(self._T_own_saved, rows["T_saved_base"]))

    def state(self) -> dict[str, Any] | None:
        """Return where it was; None where it was not tracking."""
        if self._localiser is None:
            return self._left
        return {
            "map": self.map_id, "T_own_saved": self._T_own_saved, "T_saved_base": self.T_saved_base,
            "T_odom_base": self._localiser.T_odom_base,
        }  # fmt: skip

    def restore(self, state: dict[str, Any] | None) -> None:
        """Continue with the first scan from where it was, if that is in the same saved map."""
        self._left = state if state is not None and state["map"] == self.map_id else None

    def resume(self, grid: OccupancyGrid | None, scan: Scan, T_odom_base: Transform | None) -> bool:
        """Begin again where the robot was, moved by odometry since; return whether its first scan fits there."""
        left, self._left = self._left, None
        if left is None or grid is None:
            return False
        motion = se2.IDENTITY
        if T_odom_base is not None and left["T_odom_base"] is not None:
            motion = se2.between(left["T_odom_base"], T_odom_base)
        T_saved_base = se2.compose(left["T_saved_base"], motion)
        T_own_base = se2.compose(left["T_own_saved"], T_saved_base)
        return self.begin(grid, scan, T_odom_base, T_saved_base, T_own_base, has_driven=not has_stood(motion))
