"""Places seen again after a long way, when nobody knows any more where they should be.

The newest stretch of way is looked for in the whole map within what may have drifted. One fit is a guess; it is
followed along the way, and believed when enough stretches have agreed with it, none of them along a corridor, and no
other place fits them as well.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.loops.drift import Drift
from mrslam.rbpf.loops.kept_scans import KeptScans
from mrslam.spatial import se2
from mrslam.spatial.matching import places
from mrslam.spatial.matching.gauss_newton import Match
from mrslam.spatial.matching.global_search import CELL_M, Spot, WallGrid, find, wall_grid
from mrslam.spatial.se2 import Transform

EVERY_M = 8.0
"""The map is searched after this much way."""
EVERY_POINT = 3
"""One in this number of an old scan's points is drawn: cells are larger than the distance between them."""
STRETCH = 10
"""Keyframes that are looked for together: 6 m of way or more."""
POINTS_MOST = 120
"""Points of them that are used."""
POINTS_LEAST = 40
"""Fewer are not looked for."""
SHARE_LEAST = 0.45
"""Least share of the score of a perfect fit that is worth a closer look."""
CONFIRM_M = 2.0
"""A guess is asked for again after this much way."""
FOUND_WITHIN_M, FOUND_WITHIN_RAD = 0.5, 0.08
"""Later stretches must fit within this of where the guess puts them, metres and radians."""
NEAR_M = 4.0
"""They say nothing where no old keyframe was nearer, metres."""
LOST_M = 5.0
"""Way that drifts between two questions, metres: what is searched around the guess."""
AGREE_LEAST, DISAGREE_MOST = 5, 2
"""Stretches that must fit, and stretches that may not."""
EXTENT_LEAST_M = 5.0
"""They span at least this, metres, along one axis: a place, not a spot."""
QUIET_MOST_M = 25.0
"""A guess is given up where nothing spoke for it on this much way."""
RIVAL = 0.9
"""Another place that fits this share of what the guess does makes it ambiguous."""


class Compare(Protocol):
    """Matches the newest keyframes to the place of an old one."""

    def __call__(self, T_map_key: Transform, old: int, T_old_new: Transform, lost_m: float) -> Match:
        """Return where the newest keyframe lies in the frame of the ``old`` one."""


class Fit(NamedTuple):
    """A keyframe that saw the place of an old one."""

    old: int
    new: int
    found: Match
    """Its pose is of ``new`` in the frame of ``old``."""


class FarSearch:
    """One guess at a time of where the robot really is."""

    def __init__(self, scans: KeptScans, compare: Compare) -> None:
        self._scans, self._compare = scans, compare
        self._searched_m = 0.0  # way at the newest search
        self._fits: list[Fit] = []  # that agree on the guess
        self._disagreed = 0
        self._asked_m = 0.0  # way at the newest question

    def drop(self) -> None:
        """Give the guess up."""
        self._fits, self._disagreed = [], 0

    def rest(self) -> None:
        """Ask again after ``EVERY_M``: nothing can be far off now."""
        self.drop()
        self._searched_m = float(self._scans.way_m[-1])

    @property
    def is_due(self) -> bool:
        """Whether there is something to ask at the newest keyframe."""
        way_m = float(self._scans.way_m[-1])
        return way_m - self._asked_m >= CONFIRM_M if self._fits else way_m - self._searched_m >= EVERY_M

    def look(self, T_map_key: Transform, old: NDArray[np.int64], drift: Drift) -> list[Fit]:
        """Ask the newest of the keyframes ``(K, 3)``; return the fits that are believed, or none.

        ``old (n,)`` : keyframes that may have seen its place, whose scans are kept. ``drift`` : how far off the newest
        may be.
        """
        way_m = float(self._scans.way_m[-1])
        self._asked_m = way_m
        if self._fits:
            self._follow(T_map_key, old)
            return self._believed(T_map_key, old, drift)
        self._searched_m = way_m
        spot = self._search(T_map_key, old, drift, STRETCH, None)
        if spot is not None:
            fit = self._verified(T_map_key, old, spot.T_map_scan)
            self._fits = [fit] if fit is not None and places.fits(fit.found) and fit.found.blind == 0.0 else []
            self._disagreed = 0
        return []

    def _follow(self, T_map_key: Transform, old: NDArray[np.int64]) -> None:
        """Ask the newest keyframe whether it agrees with the guess."""
        last = self._fits[-1]
        if self._scans.way_m[-1] - self._scans.way_m[last.new] > QUIET_MOST_M:
            self.drop()
            return
        T_map_last = se2.compose(T_map_key[last.old], last.found.pose)
        expected = se2.compose(T_map_last, se2.between(T_map_key[last.new], T_map_key[-1]))
        fit = self._verified(T_map_key, old, expected)
        if fit is None or fit.found.blind > 0.0:
            return
        away_m, turned = se2.difference(se2.compose(T_map_key[fit.old], fit.found.pose), expected)
        drifted = places.DRIFT_M_PER_M * (self._scans.way_m[-1] - self._scans.way_m[last.new])
        if places.fits(fit.found) and away_m <= FOUND_WITHIN_M + drifted and turned <= FOUND_WITHIN_RAD:
            self._fits.append(fit)
        else:
            self._disagreed += 1
            if self._disagreed > max(DISAGREE_MOST, len(self._fits) // 2):
                self.drop()

    def _verified(self, T_map_key: Transform, old: NDArray[np.int64], T_map_new: Transform) -> Fit | None:
        """Match the newest keyframe where it may be, ``(3,)``; None where nothing old is near."""
        away_m = np.hypot(*(T_map_key[old, :2] - T_map_new[:2]).T)
        turned = np.abs(se2.wrap(T_map_key[old, 2] - T_map_new[2]))
        k = int(np.argmin(away_m + places.TURN_COST_M * turned))
        if away_m[k] > NEAR_M:
            return None
        nearest = int(old[k])
        found = self._compare(T_map_key, nearest, se2.between(T_map_key[nearest], T_map_new), LOST_M)
        return Fit(nearest, T_map_key.shape[0] - 1, found)

    def _believed(self, T_map_key: Transform, old: NDArray[np.int64], drift: Drift) -> list[Fit]:
        """Return the fits once they are enough and no other place explains what they saw."""
        fits = self._fits
        if len(fits) < AGREE_LEAST or self._disagreed > len(fits) // 2:
            return []
        if np.ptp(T_map_key[[fit.new for fit in fits], :2], axis=0).max() < EXTENT_LEAST_M:
            return []
        if fits[-1].new != T_map_key.shape[0] - 1 or self._is_ambiguous(T_map_key, old, drift):
            return []
        self.drop()
        return fits

    def _is_ambiguous(self, T_map_key: Transform, old: NDArray[np.int64], drift: Drift) -> bool:
        """Return whether all that was seen since the first fit would be seen elsewhere, too."""
        first, last = self._fits[0], self._fits[-1]
        T_map_new = se2.compose(T_map_key[last.old], last.found.pose)
        count = last.new - first.new + STRETCH
        here = self._search(T_map_key, old, Drift(2.0 * CELL_M, 0.06), count, None, T_map_new)
        share = SHARE_LEAST if here is None else here.share
        rival = self._search(T_map_key, old, drift, count, T_map_new, share_least=RIVAL * share)
        return rival is not None

    def _search(
        self,
        T_map_key: Transform,
        old: NDArray[np.int64],
        drift: Drift,
        count: int,
        other_than: Transform | None,
        centre: Transform | None = None,
        share_least: float = SHARE_LEAST,
    ) -> Spot | None:
        """Return where the newest ``count`` keyframes fit what the ``old`` ones ``(n,)`` saw best."""
        newest = T_map_key.shape[0] - 1
        centre = T_map_key[-1] if centre is None else centre
        points = self._scans.joined(T_map_key, range(max(newest - count + 1, 0), newest + 1), newest)
        if points.shape[0] < POINTS_LEAST:
            return None
        grid = self._walls(T_map_key, old, centre, drift.reach_m + float(np.hypot(*points[:, :2].T).max()))
        if grid is None:
            return None
        points = points[:: max(1, points.shape[0] // POINTS_MOST)]
        return find(grid, points, centre, drift.reach_m, drift.turn_rad, share_least, other_than)

    def _walls(
        self, T_map_key: Transform, old: NDArray[np.int64], centre: Transform, reach_m: float
    ) -> WallGrid | None:
        """Return what the ``old`` keyframes ``(n,)`` saw, as far as it can be within ``reach_m`` of the centre."""
        kept = old[np.abs(T_map_key[old, :2] - centre[:2]).max(axis=1) <= reach_m]
        scans = [self._scans.points[int(k)][::EVERY_POINT, :2] for k in kept]
        points = np.concatenate([np.empty((0, 2)), *scans])
        if not len(points):
            return None
        x, y, theta = np.repeat(T_map_key[kept], [len(scan) for scan in scans], axis=0).T
        c, s = np.cos(theta), np.sin(theta)
        placed = [x + c * points[:, 0] - s * points[:, 1], y + s * points[:, 0] + c * points[:, 1]]
        return wall_grid(np.stack(placed, axis=1))

    def state(self) -> list[Any]:
        """Return everything that a resumed search needs."""
        fits = [[fit.old, fit.new, list(fit.found)] for fit in self._fits]
        return [self._searched_m, self._asked_m, self._disagreed, fits]

    def restore(self, state: list[Any]) -> None:
        """Continue from what :meth:`state` returned."""
        self._searched_m, self._asked_m, self._disagreed = state[:3]
        self._fits = [Fit(old, new, Match(*found)) for old, new, found in state[3]]
