"""Compares two places: the newest scans are matched to a map of the scans around an old keyframe."""

from __future__ import annotations

import numpy as np

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.loops.kept_scans import KeptScans
from mrslam.spatial import se2
from mrslam.spatial.hits.drawing import SKIP_M
from mrslam.spatial.hits.store import TileStore
from mrslam.spatial.hits.views import Tiles
from mrslam.spatial.matching.correlative import Lattice, search
from mrslam.spatial.matching.gauss_newton import Match, match
from mrslam.spatial.se2 import Transform

DRIFT_M_PER_M, DRIFT_RAD_PER_M = 0.02, 0.002
"""Expected error of position and heading for each metre of way since the trajectory was last seen to agree."""
SIGMA_M, SIGMA_RAD = 0.05, 0.02
"""Expected error where nothing has drifted yet, metres and radians: of a keyframe's pose."""
FAR_MOST_M = 6.0
"""Nothing is searched for farther away than this, metres: similar rooms are everywhere."""
GROUP = 12
"""Keyframes to either side of the old one that make its map: some 7 m of way."""
TAIL = 4
"""Keyframes before the newest one that are matched with it: one scan alone fits many places."""
OVERLAP_LEAST = 0.5
"""Share of beams that must lie on the old map's walls."""
AGREEING_LEAST = 0.85
"""Share of them among those that fall on walls or into space the old map knows to be free."""
CLEAR, VERY_CLEAR = 0.1, 0.25
"""How much more than ``OVERLAP_LEAST`` must fit for a descent to need no search, and for a fit to be very good."""
COARSE_CELLS = 4.0
"""Cells of the map that is searched first, as a multiple of the map's."""
TURN_RAD, TURN_MOST_RAD = 0.1, 0.35
"""The coarse search turns by this to either side, more the more may have drifted, and at most by the second."""
SHIFT_M = 0.7
"""The coarse search shifts by this to either side, and more the more may have drifted."""
COARSE_TURN_RAD, COARSE_SHIFT_M, COARSE_POINTS = 0.03, 0.35, 80
"""Steps of the coarse search, and the points that it uses."""
FINE = Lattice(half_turn_rad=0.045, turn_step_rad=0.015, half_shift_m=0.3, shift_step_m=0.1, points_most=120)
"""The search that follows the coarse one: it covers the coarse one's steps."""
ITERATIONS, ITERATIONS_SEARCHED = 12, 15
"""Most steps of a descent from the trajectory's own estimate, and from a searched one."""


def fits(found: Match, more: float = 0.0) -> bool:
    """Return whether enough beams match the old map, and hardly any contradict it; what it never saw is neutral.

    ``more`` : share of beams by which it must be better than just enough.
    """
    seen = found.inliers + found.conflicts
    return found.inliers >= OVERLAP_LEAST + more and found.inliers >= (AGREEING_LEAST + 0.5 * more) * seen


class PlaceMatcher:
    """Draws the map of an old place, and matches scans to it."""

    def __init__(self, config: MapperConfig, scans: KeptScans) -> None:
        self._sigma_m = config.sigma_m
        self._reach_m = config.usable_range_m + FAR_MOST_M
        self._scans = scans
        self._fine = TileStore(1, config.resolution_m)
        self._coarse = TileStore(1, COARSE_CELLS * config.resolution_m)

    def compare(self, T_map_key: Transform, old: int, lost_m: float) -> Match:
        """Return where the newest of the keyframes ``(K, 3)`` fits best, in the frame of an ``old`` one.

        ``lost_m`` : way since the trajectory was last seen to agree with an old place.
        """
        new = T_map_key.shape[0] - 1
        T_old_new = se2.between(T_map_key[old], T_map_key[new])
        group = range(max(0, old - GROUP), min(old + GROUP + 1, new - TAIL))
        points = self._scans.joined(T_map_key, range(max(0, new - TAIL), new + 1), new)
        fine = self._draw(self._fine, T_map_key, group, old, T_old_new)
        sigma_m, sigma_rad = SIGMA_M + DRIFT_M_PER_M * lost_m, SIGMA_RAD + DRIFT_RAD_PER_M * lost_m
        prior = np.diag([1.0 / sigma_m**2, 1.0 / sigma_m**2, 1.0 / sigma_rad**2])
        descended = match(fine, points, T_old_new, T_old_new, prior, self._sigma_m, ITERATIONS)
        if fits(descended, CLEAR):
            return descended
        coarse = self._draw(self._coarse, T_map_key, group, old, T_old_new)
        lattice = Lattice(
            min(TURN_RAD + DRIFT_RAD_PER_M * lost_m, TURN_MOST_RAD), COARSE_TURN_RAD,
            min(SHIFT_M + DRIFT_M_PER_M * lost_m, FAR_MOST_M), COARSE_SHIFT_M, COARSE_POINTS,
        )  # fmt: skip
        start = search(fine, points, search(coarse, points, T_old_new, lattice).pose, FINE).pose
        searched = match(fine, points, start, T_old_new, prior, self._sigma_m, ITERATIONS_SEARCHED)
        return searched if searched.score > descended.score else descended

    def _draw(self, store: TileStore, T_map_key: Transform, group: range, old: int, T_old_new: Transform) -> Tiles:
        """Return a map of the group's scans in the frame of ``old``, with room for the newest keyframe's."""
        store.clear(0)
        store.cover(T_old_new[:2] - self._reach_m, T_old_new[:2] + self._reach_m)
        T_old_key = se2.between(T_map_key[old], T_map_key[group.start : group.stop])
        store.cover(T_old_key[:, :2].min(axis=0) - self._reach_m, T_old_key[:, :2].max(axis=0) + self._reach_m)
        keys = [k for k in group if k in self._scans.points]
        poses = T_old_key[np.array(keys) - group.start]
        store.draw(0, self._scans.origins[keys], poses, [self._scans.points[k] for k in keys], SKIP_M)
        return store.tiles(0)
