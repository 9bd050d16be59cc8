"""Places seen again: the last few scans against the map of an old stretch of the way, and what follows from a fit.

A fit is an edge between two keyframes. Where the trajectory already agrees with it, it only holds the trajectory there;
where it does not, a second fit has to say the same before it is believed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.loops.graph import relax
from mrslam.rbpf.match.correlative import Lattice, search
from mrslam.rbpf.match.gauss_newton import Match, match
from mrslam.rbpf.match.scan_points import POINT_COLUMNS, spaced
from mrslam.rbpf.rows import Rows
from mrslam.rbpf.tiles.store import TileStore
from mrslam.rbpf.tiles.views import Beams, Tiles
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

OLD_WAY_M = 12.0
"""A place is old when at least this much way lies between."""
NEAR_M = 2.0
"""A keyframe closer than this is looked at even where the way there is known without error."""
DRIFT = 0.02
"""Expected error of position for each metre of way."""
FAR_MOST_M = 6.0
"""Nothing is searched for farther away than this."""
TURN_MOST_RAD = 0.35
GROUP = 12
"""Keyframes to either side of the old one that make its map."""
TAIL = 4
"""Keyframes before the newest one that are matched with it."""
POINTS_OF_KEY, POINTS_APART_M = 90, 0.05
CONSISTENT_M, CONSISTENT_RAD = 0.12, 0.03
"""A fit within this of the trajectory is believed at once."""
AGREE_M, AGREE_RAD = 0.25, 0.05
"""Two fits that say the same correct the trajectory alike within this."""
AT_ONCE_M = 0.6
"""A very good fit that is no farther from the trajectory than this needs no second one."""
OVERLAP_LEAST = 0.5
"""Share of beams that must lie on the old map's walls."""
AGREEING_LEAST = 0.85
"""Share of them among those that fall on walls or into space the old map knows to be free."""
SKIP_M = 0.1
"""Beams clear the map up to this far before their end, metres."""
EDGE_WAY_M = 2.5
"""Places that agreed are compared again after this much way."""
MOVED_M = 0.05
"""The map is made anew when relaxation moves a keyframe by more than this."""
SEEN_MOST, SEEN_M, SEEN_RAD = 12, 0.7, 0.5
"""Of scans taken within this of each other so many are kept, the newest: memory grows with the area, not with time."""
SHARE = 0.02
"""Beams of many scans on one wall are far from independent: share of the matcher's information that an edge gets."""


class LoopCloser:
    """Keyframe scans, edges between keyframes, and the search for more of them."""

    def __init__(self, config: MapperConfig) -> None:
        self.config = config
        self.scans: dict[int, NDArray[np.float32]] = {}
        """By keyframe, in the order of time: points ``(N, 5)`` in its base frame; not of all, see :meth:`forget`."""
        self._origins = Rows(2)
        self._way = Rows(1)
        self._edges = Rows(2, np.int64)  # an old keyframe, and the one that saw it again
        self._found = Rows(3 + 9)  # where the second is in the frame of the first, and the information of that
        self._pending: tuple[int, Transform] | None = None
        self._last_fit_m, self._anchored_m = -1e9, 0.0
        self._stores = (TileStore(1, config.resolution_m), TileStore(1, 4.0 * config.resolution_m))

    def add_key(self, beams: Beams, way_m: float) -> None:
        """Remember a keyframe's scan, taken ``way_m`` after the keyframe before."""
        self._origins.add(beams.origin)
        self.scans[self._way.size] = beams.points.astype(np.float32)
        self._way.add(way_m + (self.way[-1] if self._way.size else 0.0))

    @property
    def origins(self) -> NDArray[np.float64]:
        """``(K, 2)``, where the laser was on the base."""
        return self._origins.rows

    @property
    def way(self) -> NDArray[np.float64]:
        """``(K,)``, way since the start, metres."""
        return self._way.rows[:, 0]

    @property
    def edges(self) -> int:
        """How many places were found to have been seen before."""
        return self._edges.size

    def forget(self, T_map_key: Transform) -> None:
        """Let the oldest scan go that was taken where the newest was, if there are enough newer ones."""
        kept, away, turned = self._from_newest(T_map_key)
        here = kept[(away < SEEN_M) & (turned < SEEN_RAD)]
        if here.size > SEEN_MOST:
            del self.scans[int(here[0])]

    def _from_newest(self, T_map_key: Transform) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Return the keyframes whose scans are kept, and how far from the newest and turned against it each is."""
        kept = np.fromiter(self.scans, np.int64, len(self.scans))
        away = np.hypot(*(T_map_key[kept, :2] - T_map_key[-1, :2]).T)
        return kept, away, np.abs(se2.wrap(T_map_key[kept, 2] - T_map_key[-1, 2]))

    def look(self, T_map_key: Transform) -> bool:
        """Compare the newest place with old ones near it; return whether a new edge contradicts the trajectory."""
        now = self._way.size - 1
        way = self.way[now]
        lost_m = way - self._anchored_m  # way since the trajectory was last seen to agree with an old place
        if way - self._last_fit_m < EDGE_WAY_M:
            return False
        old = self._candidate(T_map_key, now, lost_m)
        if old is None:
            return False
        return self._compare(T_map_key, old, now, lost_m)

    def _candidate(self, T_map_key: Transform, now: int, lost_m: float) -> int | None:
        """Return the old keyframe that most likely saw what the newest sees."""
        kept, away, turned = self._from_newest(T_map_key)
        since = self.way[now] - self.way[kept]
        is_old = (since > OLD_WAY_M) & (kept < now - TAIL)
        fits = is_old & (away < min(NEAR_M + DRIFT * lost_m, FAR_MOST_M))
        if not fits.any():
            return None
        cost = np.where(fits, away + 0.7 * turned, np.inf)
        return int(kept[np.argmin(cost)])

    def _compare(self, T_map_key: Transform, old: int, now: int, lost_m: float) -> bool:
        T_old_now = se2.between(T_map_key[old], T_map_key[now])
        group = range(max(0, old - GROUP), min(old + GROUP + 1, now - TAIL))
        source = self._points_of(T_map_key, range(max(0, now - TAIL), now + 1), now)
        fine = self._draw(0, T_map_key, group, old, T_old_now)
        spread_m, spread_rad = 0.05 + DRIFT * lost_m, 0.02 + 0.002 * lost_m
        prior = np.diag([1.0 / spread_m**2, 1.0 / spread_m**2, 1.0 / spread_rad**2])
        sigma_m = self.config.sigma_m
        fitted = match(fine, source, T_old_now, T_old_now, prior, sigma_m, 12)
        if not _fits(fitted, 0.1):
            coarse = self._draw(1, T_map_key, group, old, T_old_now)
            half_turn_rad = min(0.1 + 0.002 * lost_m, TURN_MOST_RAD)
            half_shift_m = min(0.7 + DRIFT * lost_m, FAR_MOST_M)
            start = search(coarse, source, T_old_now, Lattice(half_turn_rad, 0.03, half_shift_m, 0.35, 80)).pose
            start = search(fine, source, start, Lattice(0.045, 0.015, 0.3, 0.1, 120)).pose
            searched = match(fine, source, start, T_old_now, prior, sigma_m, 15)
            if searched.score > fitted.score:
                fitted = searched
        if not _fits(fitted):
            return False
        return self._believe(T_map_key, old, now, fitted, T_old_now)

    def _believe(self, T_map_key: Transform, old: int, now: int, fitted: Match, T_old_now: Transform) -> bool:
        T_fit = fitted.pose
        away, turned = se2.difference(T_fit, T_old_now)
        consistent = away < CONSISTENT_M and turned < CONSISTENT_RAD
        if not consistent and not (away < AT_ONCE_M and _fits(fitted, 0.25)):
            # What the fit says about the map frame where it is now; another fit must say the same.
            T_map_fit = se2.compose(T_map_key[old], T_fit)
            pending = self._pending
            self._pending = (now, se2.compose(T_map_fit, se2.inverse(T_map_key[now])))
            if pending is None or self.way[now] - self.way[pending[0]] > 5.0:
                return False
            apart, twisted = se2.difference(se2.compose(pending[1], T_map_key[now]), T_map_fit)
            if apart > AGREE_M or twisted > AGREE_RAD:
                return False
        self._last_fit_m = self._anchored_m = float(self.way[now])
        self._pending = None
        floor = np.diag([0.01**2, 0.01**2, 0.003**2])
        covariance = np.linalg.inv(SHARE * fitted.information + np.diag([1e-2, 1e-2, 1e-2])) + floor
        self._edges.add((old, now))
        self._found.add((*T_fit, *np.linalg.inv(covariance).flat))
        return not consistent

    def relaxed(self, T_map_key: Transform, motion_cov: NDArray[np.float64]) -> Transform:
        """Return the trajectory bent the least that fits all edges; ``motion_cov (K, 3, 3)`` of each arrival."""
        count = T_map_key.shape[0]
        if not self.edges:
            return T_map_key.copy()
        chain = np.arange(count - 1)
        first, second = np.concatenate([np.stack([chain, chain + 1], axis=1), self._edges.rows]).T
        T = np.concatenate([se2.between(T_map_key[:-1], T_map_key[1:]), self._found.rows[:, :3]])
        info = np.concatenate([np.linalg.inv(motion_cov[1:]), self._found.rows[:, 3:].reshape(-1, 3, 3)])
        robust = np.arange(first.size) >= count - 1
        return relax(T_map_key, first, second, T, info, robust)

    def _draw(self, level: int, T_map_key: Transform, group: range, old: int, T_old_now: Transform) -> Tiles:
        """Return a map of the group's scans in the frame of ``old``."""
        store, reach = self._stores[level], self.config.usable_range_m + FAR_MOST_M
        store.clear(0)
        store.cover(T_old_now[:2] - reach, T_old_now[:2] + reach)
        T_old_key = se2.between(T_map_key[old], T_map_key[group.start : group.stop])
        store.cover(T_old_key[:, :2].min(axis=0) - reach, T_old_key[:, :2].max(axis=0) + reach)
        keys = [k for k in group if k in self.scans]
        poses = T_old_key[np.array(keys) - group.start]
        store.draw(0, self.origins[keys], poses, [self.scans[k] for k in keys], SKIP_M)
        return store.tiles(0)

    def _points_of(self, T_map_key: Transform, keys: range, frame: int) -> NDArray[np.float64]:
        """Return some points of several keyframes in the frame of one of them."""
        parts = []
        for k in (k for k in keys if k in self.scans):
            points = self.scans[k].astype(np.float64)
            few = np.empty((points.shape[0], POINT_COLUMNS))
            points = few[: spaced(points, self.origins[k], POINTS_APART_M, POINTS_OF_KEY, few)]
            T = se2.between(T_map_key[frame], T_map_key[k])
            cos, sin = np.cos(T[2]), np.sin(T[2])
            x, y, nx, ny, q = points.T
            moved = [T[0] + cos * x - sin * y, T[1] + sin * x + cos * y]
            parts.append(np.stack([*moved, cos * nx - sin * ny, sin * nx + cos * ny, q]))
        return np.ascontiguousarray(np.concatenate(parts, axis=1).T)

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed search needs."""
        return {
            "kept": list(self.scans), "scans": list(self.scans.values()), "origins": self.origins,
            "way": self._way.rows, "edges": self._edges.rows, "found": self._found.rows,
            "pending": None if self._pending is None else [self._pending[0], self._pending[1]],
            "last": [self._last_fit_m, self._anchored_m],
        }  # fmt: skip

    def restore(self, state: dict[str, Any]) -> None:
        """Become the search that was saved."""
        self.scans = dict(zip(state["kept"], state["scans"], strict=True))
        self._origins, self._way = Rows.of(state["origins"]), Rows.of(state["way"])
        self._edges, self._found = Rows.of(state["edges"]), Rows.of(state["found"])
        self._pending = None if state["pending"] is None else (state["pending"][0], state["pending"][1])
        self._last_fit_m, self._anchored_m = state["last"]


def _fits(found: Match, more: float = 0.0) -> bool:
    """Return whether enough beams match, and few contradict the old map; what it never saw is neutral."""
    seen = found.inliers + found.conflicts
    return found.inliers >= OVERLAP_LEAST + more and found.inliers >= (AGREEING_LEAST + 0.5 * more) * seen
