"""When a robot doubts its own pose: its mapper's health is low, or it was resumed elsewhere than it was saved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mrslam.spatial import OccupancyGrid, Scan, se2
from mrslam.spatial.se2 import Transform

CERTAIN = 0.1
"""Hysteresis: health must exceed ``agent.min_health`` by this much (of 0..1) until a lost robot has recovered."""
USUAL_MEMORY = 0.05
"""Weight of each scan in the usual match score: averages over about 20 scans."""
TORN = 0.5
"""Where a robot's first scan after it was resumed matches by less than this share of the usual, it may be elsewhere."""
PATIENCE = 10
"""How many times longer a map is kept that scans contradict though nobody carried the robot: loops may mend it, and
another map would not be better. Outdoors such stretches last up to 100 s."""
FITTING_LEAST = 5
"""Scans in a row that must fit the last published map: one may do so by chance."""
KNOWN_LEAST = 0.3
"""Least share of a scan's end points in known cells for the map to say anything about the scan."""
FITS = 0.7
"""Least share of those end points at walls for the scan to fit; the rest are people, doors and noise."""
SAVED = ("doubtful", "torn", "_usual", "_fitting", "_doubted_ns", "_is_for_now")
"""The fields a checkpoint keeps: the state without the limits."""


@dataclass
class SelfDoubt:
    """Detects that a robot's pose may be wrong; it then does not publish its map.

    Either the mapper's health falls, or the robot was carried, which a mapper does not see of one that was off. Later
    scans fit each other well then, and a house may look alike where it was put down: only the map published before
    can show whether its pose is right.
    """

    min_health: float
    give_up_ns: int
    doubtful: bool = False
    """Whether the robot doubts where it is."""
    torn: bool = False
    """Whether it doubts because it was carried, or resumed where it sees something else."""
    _usual: float | None = None
    _fitting: int = 0
    _doubted_ns: int = 0
    _looked_ns: int | None = None
    _is_for_now: bool = False
    """Whether it doubts only until the next scan that is used (:meth:`leave_out`)."""

    def leave_out(self, health: float) -> str | None:
        """Return "doubtful" at a scan that was not used where the state changes, else None.

        The next one that is used is looked at as if there had been no doubt.
        """
        if self.doubtful or health >= self.min_health:
            return None
        self.doubtful = self._is_for_now = True
        return "doubtful"

    def look(
        self,
        health: float,
        match_score: float,
        fits: Callable[[], bool | None],
        now_ns: int,
        *,
        is_lost: bool = False,
    ) -> str | None:
        """Return "doubtful", "recovered" or "given_up" at the scan where the state changes, else None.

        ``match_score`` : share of the scan that fits the scans before, 0..1. ``fits()`` returns whether it fits the map
        last published, None where that has too few known cells; it is called only of one that was carried or resumed.
        A resumed robot has driven on since it was saved, so its view may well have changed: its pose by odometry is
        doubted unless that map confirms it, for odometry may have been reset, or the robot carried.
        ``is_lost`` : whether the mapper knows that the robot is not where it was led; where it believes that it found
        the robot again, the published map must show that, too.
        """
        if self._is_for_now:
            self.doubtful = self._is_for_now = False
            return "recovered" if self.look(health, match_score, fits, now_ns, is_lost=is_lost) is None else None
        is_back = self._looked_ns is None and self._usual is not None
        waited_ns = 0 if self._looked_ns is None else max(now_ns - self._looked_ns, 0)
        self._looked_ns = now_ns
        if not self.doubtful:
            usual = 1.0 if self._usual is None else self._usual
            torn = is_lost or (is_back and match_score < TORN * usual and not fits())
            self._usual = usual + USUAL_MEMORY * (match_score - usual)
            if not torn and health >= self.min_health:
                return None
            self.doubtful, self.torn, self._fitting, self._doubted_ns = True, torn, 0, 0
            return "doubtful"
        self.torn |= is_lost
        self._doubted_ns += waited_ns if self.torn else waited_ns // PATIENCE
        if self._has_recovered(health, fits):
            self.doubtful = False
            return "recovered"
        if self._doubted_ns >= self.give_up_ns:
            self.doubtful = False
            return "given_up"
        return None

    def state(self) -> dict[str, Any]:
        """Return what a checkpoint keeps: a robot that is resumed in another place must notice it."""
        return {name: value for name, value in vars(self).items() if name in SAVED}

    def resumed(self, state: dict[str, Any]) -> SelfDoubt:
        """Return one with these limits that continues from ``state``; the time between does not count."""
        return replace(self, **{name: state[name] for name in SAVED}, _looked_ns=None)

    def _has_recovered(self, health: float, fits: Callable[[], bool | None]) -> bool:
        if self.torn:
            self._fitting = self._fitting + 1 if fits() else 0
            if self._fitting < FITTING_LEAST:
                return False
        return health >= self.min_health + CERTAIN


def fits_map(scan: Scan, T_map_base: Transform, grid: OccupancyGrid) -> bool | None:
    """Return whether a scan taken at ``T_map_base (3,)`` fits a map: most end points in known cells are at walls.

    None where too few of them are in known cells.
    """
    hit = np.isfinite(scan.ranges_m)
    angles = scan.angles_rad[hit]
    ends = scan.ranges_m[hit, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    points = se2.apply(se2.compose(T_map_base, scan.T_base_laser), ends.astype(np.float64))
    col, row = np.floor((points - np.asarray(grid.origin_m)) / grid.resolution_m).astype(np.int64).T
    height, width = grid.shape
    inside = (row >= 1) & (row < height - 1) & (col >= 1) & (col < width - 1)
    row, col = row[inside], col[inside]
    known = grid.cells[row, col] >= 0
    walls = np.zeros(row.size, dtype=np.bool_)
    for i in (-1, 0, 1):
        for j in (-1, 0, 1):
            walls |= grid.cells[row + i, col + j] >= 50
    known |= walls
    if known.sum() < KNOWN_LEAST * max(hit.sum(), 1):
        return None
    return bool(walls.sum() >= FITS * known.sum())
