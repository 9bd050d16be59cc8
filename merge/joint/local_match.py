"""Matches a short stretch of one robot's way with the map that another robot's scans make of the same place.

The same steps as for loops within one robot's map: descend from where the stretch should be; where that does not fit,
search around it in a coarse map, then in the fine one, and descend again.
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
"""Keyframes to either side of the old one whose scans make the map."""
TAIL = 2
"""Keyframes to either side of the new one that are matched with it."""
POINTS_LEAST = 20
"""A stretch with fewer points is not compared: a wall and a corner have as many."""
FINE_M, COARSE_M = 0.05, 0.2
"""Cells of the maps that are matched with and searched in, metres."""
SIGMA_M = 0.03
"""Noise of a laser's ranges, metres (``rbpf.sigma_m``)."""
SKIP_M = 0.1
"""Beams clear the map up to this far before their end, metres."""
LOST_M, LOST_RAD, DRIFT, TURN_DRIFT = 0.05, 0.02, 0.02, 0.002
"""Standard deviation of where a stretch should be, and its growth with each metre of way from what is known to fit."""
FAR_MOST_M, TURN_MOST_RAD = 6.0, 0.35
"""Nothing is searched for farther away or more turned than this."""
OVERLAP_LEAST, AGREEING_LEAST = 0.5, 0.85
"""Share of beams that must lie on walls, and share of these among those on walls or known free space."""
SHARE = 0.02
"""Beams of several scans on one wall are far from independent: share of the matcher's information that counts."""
FLOOR = np.diag([0.01**2, 0.01**2, 0.003**2])
"""Covariance that no match is better than: the lattice of the scans' ranges, and a laser's own bias."""
ROUND_M, ROUND_RAD = 0.02, 0.005
"""Where a stretch should be is rounded to this: nearly the same question is not asked again."""
NEARBY = Lattice(0.045, 0.015, 0.3, 0.1, 120)
"""What is searched in the fine map around what the coarse one says."""
REMEMBERED = 20_000
"""Answers kept; at 0.3 kB each they fill some megabytes."""


class Fit(NamedTuple):
    """How one stretch lies to another."""

    T_i_j: Transform
    """``(3,)``: keyframe j of b in the frame of keyframe i of a."""
    information: NDArray[np.float64]
    """``(3, 3)``, its inverse covariance."""


class LocalMatcher:
    """Answers the same question the same way, and a question asked before at once."""

    def __init__(self) -> None:
        self._fine, self._coarse = TileStore(1, FINE_M), TileStore(1, COARSE_M)
        self._answers: OrderedDict[bytes, Fit | None] = OrderedDict()
        self.matched = 0
        """Stretches matched so far, those remembered not counted."""

    def match(self, a: Trail, i: int, b: Trail, j: int, T_i_j: Transform, lost_m: float) -> Fit | None:
        """Return how ``b``'s keyframe ``j`` lies to ``a``'s keyframe ``i``, or None where the two do not fit.

        ``T_i_j (3,)`` is where it should be; it may be off by what ``lost_m`` metres of way bring.
        """
        expected = np.round(T_i_j / (ROUND_M, ROUND_M, ROUND_RAD)) * (ROUND_M, ROUND_M, ROUND_RAD)
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
    return np.arange(max(0, k - count), min(k + count + 1, len(trail)))


def _relative(trail: Trail, centre: int, keys: NDArray[np.int64]) -> Transform:
    return se2.between(trail.T_map_key[centre], trail.T_map_key[keys])


def _stretch(trail: Trail, j: int, keys: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the points ``(N, 5)`` of several keyframes in the frame of one of them."""
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
    """Return a map of some keyframes' scans in the frame of ``i``, that holds wherever the source may be laid."""
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
    """Return whether enough beams match, and few contradict the map; what it never saw is neutral."""
    seen = found.inliers + found.conflicts
    return bool(found.inliers >= OVERLAP_LEAST + more and found.inliers >= (AGREEING_LEAST + 0.5 * more) * seen)
