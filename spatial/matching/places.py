"""Whether a few scans see a place that other scans saw before, and from where: loops within a map and between maps.

Gauss-Newton matching from the expected pose to a map drawn of the place's scans; where that is not clear, correlative
search around it in a coarse map, then in the fine one, and Gauss-Newton from there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mrslam.spatial.hits.drawing import SKIP_M
from mrslam.spatial.hits.store import TileStore
from mrslam.spatial.hits.views import Tiles
from mrslam.spatial.matching.correlative import Lattice, search
from mrslam.spatial.matching.gauss_newton import Match, match
from mrslam.spatial.matching.sliding import Drift, slid
from mrslam.spatial.se2 import Transform

DRIFT_M_PER_M, DRIFT_RAD_PER_M = 0.02, 0.002
"""Standard deviation that position and heading grow by for each metre of path since the last match (1, rad/m)."""
SIGMA_M, SIGMA_RAD = 0.05, 0.02
"""Standard deviation of the expected pose where nothing has drifted yet, metres and radians: of a keyframe's pose."""
NEAR_M, FAR_MOST_M = 2.0, 6.0
"""Keyframes closer than the first are compared even where nothing has drifted; nothing is searched for beyond the
second, metres: similar rooms are everywhere."""
TURN_COST_M = 0.7
"""The nearest keyframe is compared; one radian of turn counts as this distance, m/rad: few lasers look all round."""
GROUP = 12
"""Keyframes to either side of a place's whose scans make its map: some 7 m of path."""
OVERLAP_LEAST = 0.5
"""Least share of beams on the place's walls."""
AGREEING_LEAST = 0.85
"""Least share of them among the beams that end on walls or in space the place's map knows to be free."""
CLEAR, VERY_CLEAR = 0.1, 0.25
"""How far ``OVERLAP_LEAST`` must be exceeded for a match to need no search, and for one to be very good."""
COARSE_CELLS = 4.0
"""Edge of the coarse map's cells, fine cells."""
TURN_RAD, TURN_MOST_RAD = 0.1, 0.35
"""The coarse search turns by the first to either side, plus what may have drifted, at most by the second."""
SHIFT_M = 0.7
"""The coarse search shifts by this to either side, plus what may have drifted, at most by ``FAR_MOST_M``."""
COARSE_TURN_RAD, COARSE_SHIFT_M, COARSE_POINTS = 0.03, 0.35, 80
"""Steps of the coarse search, and the points that it uses."""
FINE = Lattice(half_turn_rad=0.045, turn_step_rad=0.015, half_shift_m=0.3, shift_step_m=0.1, points_most=120)
"""The search that follows the coarse one: it covers the coarse one's steps."""
ITERATIONS, ITERATIONS_SEARCHED = 12, 15
"""Most steps of Gauss-Newton from the expected pose, and from a searched one."""
INDEPENDENT = 0.02
"""Share of the matcher's information that an edge gets: beams of several scans on one wall are far from independent."""
EDGE_SIGMA = np.array([0.01, 0.01, 0.003])
"""Least standard deviations of an edge, metres and radians: a fifth of a cell."""
SEEN_M = 0.25
"""Standard deviation of a position, metres, along a direction that was seen."""
FLAT = 1e-2
"""Added to an edge's information, which has no inverse where a place has no wall across one direction."""


class Place(NamedTuple):
    """Scans of n keyframes around one, in whose frame everything is compared."""

    origins: NDArray[np.float64]
    """``(n, 2)``: the laser in each keyframe's base frame, metres."""
    T_place_key: Transform
    """``(n, 3)``: the keyframes in the frame of the one in their midst."""
    scans: Sequence[NDArray[Any]]
    """n arrays ``(N, 5)`` of points in their keyframes' base frames (:mod:`mrslam.spatial.matching.scan_points`)."""


def within_m(lost_m: ArrayLike) -> NDArray[np.float64]:
    """Return how close two keyframes must be to be compared, when ``lost_m`` of path may have drifted, metres."""
    return np.minimum(NEAR_M + DRIFT_M_PER_M * np.asarray(lost_m, dtype=np.float64), FAR_MOST_M)


def expected_sigmas(lost_m: float) -> NDArray[np.float64]:
    """Return ``(3,)``, standard deviations of an expected pose when ``lost_m`` of path may have drifted: m, m, rad."""
    sigma_m = SIGMA_M + DRIFT_M_PER_M * lost_m
    return np.array([sigma_m, sigma_m, SIGMA_RAD + DRIFT_RAD_PER_M * lost_m])


def fits(found: Match, more: float = 0.0) -> bool:
    """Return whether enough beams match the place, and hardly any contradict it; what it never saw is neutral.

    ``more`` : share of beams by which it must be better than just enough.
    """
    return found.inliers >= OVERLAP_LEAST + more and not is_contradicted(found, AGREEING_LEAST + 0.5 * more)


def is_contradicted(found: Match, agreeing_least: float = AGREEING_LEAST) -> bool:
    """Return whether less than this share of the beams on known ground matches the place."""
    return found.inliers < agreeing_least * (found.inliers + found.conflicts)


def is_seen_all_round(information: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether edges of ``information (..., 3, 3)`` say where scans are in every direction, to ``SEEN_M``."""
    return np.asarray(np.linalg.eigvalsh(information[..., :2, :2])[..., 0] > SEEN_M**-2)


def edge_information(found: Match) -> NDArray[np.float64]:
    """Return the inverse covariance ``(3, 3)`` of a match as an edge of a pose graph: 1/m^2, 1/(m rad), 1/rad^2."""
    covariance = np.linalg.inv(INDEPENDENT * found.information + np.diag([FLAT] * 3)) + np.diag(EDGE_SIGMA**2)
    return np.linalg.inv(covariance)


class PlaceMatcher:
    """Draws the map of a place, and matches scans to it; for one thread at a time, as the maps' memory is reused."""

    def __init__(self, resolution_m: float, sigma_m: float) -> None:
        """``sigma_m`` : standard deviation of the laser's ranges, metres."""
        self._sigma_m = sigma_m
        self._fine = TileStore(1, resolution_m)
        self._coarse = TileStore(1, COARSE_CELLS * resolution_m)

    def match(self, place: Place, points: NDArray[np.float64], T_place_scan: Transform, lost_m: float) -> Match:
        """Return how ``points (N, 5)`` match a place best, as a pose in its frame; whether they fit says :func:`fits`.

        ``T_place_scan (3,)`` : the expected pose; its uncertainty is the drift over ``lost_m`` metres of path.
        """
        reach_m = FAR_MOST_M + max(np.hypot(*scan[:, :2].T).max(initial=0.0) for scan in (points, *place.scans))
        sigma_m, _, sigma_rad = expected_sigmas(lost_m).tolist()
        prior = np.diag([1.0 / sigma_m**2, 1.0 / sigma_m**2, 1.0 / sigma_rad**2])
        fine = _draw(self._fine, place, T_place_scan, reach_m)
        descended = match(fine, points, T_place_scan, T_place_scan, prior, self._sigma_m, ITERATIONS)
        drift = Drift(T_place_scan, sigma_m, prior, min(SHIFT_M + DRIFT_M_PER_M * lost_m, FAR_MOST_M))
        if fits(descended, CLEAR):
            return self._slid(fine, points, descended, drift)
        coarse = _draw(self._coarse, place, T_place_scan, reach_m)
        lattice = Lattice(
            min(TURN_RAD + DRIFT_RAD_PER_M * lost_m, TURN_MOST_RAD), COARSE_TURN_RAD,
            drift.half_m, COARSE_SHIFT_M, COARSE_POINTS,
        )  # fmt: skip
        start = search(fine, points, search(coarse, points, T_place_scan, lattice).pose, FINE).pose
        searched = match(fine, points, start, T_place_scan, prior, self._sigma_m, ITERATIONS_SEARCHED)
        found = searched if searched.score > descended.score else descended
        return self._slid(fine, points, found, drift)

    def _slid(self, tiles: Tiles, points: NDArray[np.float64], found: Match, drift: Drift) -> Match:
        """Return a match as it is along its corridor, if it is in one."""
        found, along = slid(tiles, points, found, drift, self._sigma_m)
        return found._replace(information=found.information + along / INDEPENDENT)


def _draw(store: TileStore, place: Place, T_place_scan: Transform, reach_m: float) -> Tiles:
    """Return the place's map, with room for points up to ``reach_m`` from its keyframes and from the expected pose."""
    centres = np.concatenate([place.T_place_key[:, :2], T_place_scan[None, :2]])
    store.clear(0)
    store.cover(centres.min(axis=0) - reach_m, centres.max(axis=0) + reach_m)
    store.draw(0, place.origins, place.T_place_key, place.scans, SKIP_M)
    return store.tiles(0)
