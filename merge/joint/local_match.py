"""Matches a few keyframes' scans of one robot with a local map drawn from another robot's scans of the same place.

The same steps as for loops within one robot's map: Gauss-Newton from the expected pose; where that does not fit,
correlative search around it in a coarse map, then in the fine one, and Gauss-Newton again.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.joint.trail import Trail
from mrslam.spatial import se2
from mrslam.spatial.hits.store import TileStore
from mrslam.spatial.hits.views import Tiles
from mrslam.spatial.matching.correlative import Lattice, search
from mrslam.spatial.matching.gauss_newton import Match, match
from mrslam.spatial.se2 import Transform

GROUP = 12
"""Keyframes to either side of a's keyframe i whose scans make the local map."""
TAIL = 2
"""Keyframes to either side of b's keyframe j that are matched with it: the stretch."""
POINTS_LEAST = 20
"""A stretch with fewer points is not compared: a wall and a corner have as many."""
FINE_M, COARSE_M = 0.05, 0.2
"""Cells of the maps that are matched with and searched in, metres."""
SIGMA_M = 0.03
"""Noise of a laser's ranges, metres (``rbpf.sigma_m``)."""
SKIP_M = 0.1
"""Beams clear the map up to this far before their end, metres."""
LOST_M, LOST_RAD, DRIFT, TURN_DRIFT = 0.05, 0.02, 0.02, 0.002
"""Standard deviation of the expected pose (m, rad), and its growth per metre of path since a match (1, rad/m)."""
FAR_MOST_M, TURN_MOST_RAD = 6.0, 0.35
"""Most that is searched to either side of the expected pose, metres and radians."""
OVERLAP_LEAST, AGREEING_LEAST = 0.5, 0.85
"""Least share of beams on walls, and least share of these among the beams that end on walls or in known free space."""
SHARE = 0.02
"""Factor of the matcher's information: beams of several scans on one wall are far from independent."""
FLOOR = np.diag([0.01**2, 0.01**2, 0.003**2])
"""Covariance added to every match's, m^2 and rad^2: rounding of the scans' ranges, and the lasers' bias."""
ROUND_M, ROUND_RAD = 0.02, 0.005
"""The expected pose is rounded to this, so that a slightly different guess finds the cached match."""
NEARBY = Lattice(0.045, 0.015, 0.3, 0.1, 120)
"""Poses searched in the fine map around the best one in the coarse map."""
REMEMBERED = 20_000
"""Most matches cached; at 0.3 kB each 6 MB."""


class Fit(NamedTuple):
    """Where a stretch of b lies in the local map of a."""

    T_i_j: Transform
    """``(3,)``: keyframe j of b in the frame of keyframe i of a."""
    information: NDArray[np.float64]
    """``(3, 3)``, its inverse covariance: 1/m^2, 1/(m rad), 1/rad^2."""


class LocalMatcher:
    """Matches stretches, and caches the results by content; for one thread at a time, as it reuses its tile stores."""

    def __init__(self) -> None:
        self._fine, self._coarse = TileStore(1, FINE_M), TileStore(1, COARSE_M)
        self._answers: OrderedDict[bytes, Fit | None] = OrderedDict()
        self.matched = 0
        """Stretches matched so far, without those answered from the cache."""

    def match(self, a: Trail, i: int, b: Trail, j: int, T_i_j: Transform, lost_m: float) -> Fit | None:
        """Return the pose of ``b``'s keyframe ``j`` in the frame of ``a``'s keyframe ``i``, None where they do not fit.

        ``T_i_j (3,)`` is the expected pose; its uncertainty is the drift over ``lost_m`` metres of path.
        """
        expected = np.round(T_i_j / (ROUND_M, ROUND_M, ROUND_RAD)) * (ROUND_M, ROUND_M, ROUND_RAD)
        # Powers of two, so that a growing path finds the cached match again.
        lost_m = 2.0 ** np.ceil(np.log2(max(lost_m, 1.0)))
        group, tail = _around(a, i, GROUP), _around(b, j, TAIL)
        question = hashlib.blake2b(expected.tobytes() + np.float64(lost_m).tobytes(), digest_size=16)
        for trail, centre, keys in ((a, i, group), (b, j, tail)):
            question.update(_relative(trail, centre, keys).tobytes())
            question.update(trail.scans.part(keys[0], keys[-1] + 1).polar.tobytes())
        key = question.digest()
        if key in self._answers:
            self._answers.move_to_end(key)
            return self._answers[key]
        self.matched += 1
        answer = self._answers[key] = self._search(a, i, group, _stretch(b, j, tail), expected, lost_m)
        if len(self._answers) > REMEMBERED:
            self._answers.popitem(last=False)
        return answer

    def _search(
        self,
        a: Trail,
        i: int,
        group: NDArray[np.int64],
        source: NDArray[np.float64],
        expected: Transform,
        lost_m: float,
    ) -> Fit | None:
        """Return how ``source (N, 5)``, points in the frame of b's keyframe, fits the map of a's ``group``."""
        if source.shape[0] < POINTS_LEAST:
            return None
        spread = np.array([LOST_M + DRIFT * lost_m] * 2 + [LOST_RAD + TURN_DRIFT * lost_m])
        prior = np.diag(spread**-2)
        fine = _draw(self._fine, a, i, group, source, expected)
        best = match(fine, source, expected, expected, prior, SIGMA_M, 12)
        if not _fits(best, 0.1):
            coarse = _draw(self._coarse, a, i, group, source, expected)
            reach_rad, reach_m = min(0.1 + TURN_DRIFT * lost_m, TURN_MOST_RAD), min(0.7 + DRIFT * lost_m, FAR_MOST_M)
            start = search(coarse, source, expected, Lattice(reach_rad, 0.03, reach_m, 0.35, 80)).pose
            start = search(fine, source, start, NEARBY).pose
            best = max(best, match(fine, source, start, expected, prior, SIGMA_M, 15), key=lambda found: found.score)
        if not _fits(best):
            return None
        covariance = np.linalg.inv(SHARE * best.information + 1e-2 * np.eye(3)) + FLOOR
        return Fit(best.pose, np.linalg.inv(covariance))


def _around(trail: Trail, k: int, count: int) -> NDArray[np.int64]:
    """Return the indices of keyframe ``k`` and up to ``count`` to either side."""
    return np.arange(max(0, k - count), min(k + count + 1, len(trail)))


def _relative(trail: Trail, centre: int, keys: NDArray[np.int64]) -> Transform:
    """Return poses ``(len(keys), 3)`` in the frame of the keyframe ``centre``."""
    return se2.between(trail.T_map_key[centre], trail.T_map_key[keys])


def _stretch(trail: Trail, j: int, keys: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the points ``(N, 5)`` of several keyframes in the frame of ``j``, without unsure ones (quality < 0)."""
    parts = []
    for T, k in zip(_relative(trail, j, keys), keys, strict=True):
        points = trail.points(int(k))
        points = points[points[:, 4] >= 0.0]
        normals = se2.apply(np.array([0.0, 0.0, T[2]]), points[:, 2:4])
        parts.append(np.concatenate([se2.apply(T, points[:, :2]), normals, points[:, 4:]], axis=1))
    return np.ascontiguousarray(np.concatenate(parts))


def _draw(
    store: TileStore, trail: Trail, i: int, keys: NDArray[np.int64], source: NDArray[np.float64], expected: Transform
) -> Tiles:
    """Return a map of some keyframes' scans in the frame of ``i``, large enough for every pose that is searched."""
    poses = _relative(trail, i, keys)
    scans = [trail.points(int(k)) for k in keys]
    origins = trail.scans.origins[keys].astype(np.float64)
    reach = max(float(np.hypot(*points[:, :2].T).max(initial=0.0)) for points in [source, *scans]) + FAR_MOST_M
    places = np.concatenate([poses[:, :2], expected[None, :2]])
    store.clear(0)
    store.cover(places.min(axis=0) - reach, places.max(axis=0) + reach)
    store.draw(0, origins, poses, scans, SKIP_M)
    return store.tiles(0)


def _fits(found: Match, more: float = 0.0) -> bool:
    """Return whether enough beams match, and few contradict the map; beams in unknown cells count as neither.

    ``more`` raises both limits: a fit without a search must be clearer.
    """
    seen = found.inliers + found.conflicts
    return bool(found.inliers >= OVERLAP_LEAST + more and found.inliers >= (AGREEING_LEAST + 0.5 * more) * seen)
