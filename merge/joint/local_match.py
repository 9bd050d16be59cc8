"""Matches a few keyframes' scans of one robot with a place of another robot's, as loops within one map are matched."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.joint.stretch import Stretch
from mrslam.merge.joint.trail import Trail
from mrslam.spatial.matching.cloud import transformed
from mrslam.spatial.matching.places import GROUP, Place, PlaceMatcher, edge_information, expected_sigmas, fits
from mrslam.spatial.se2 import Transform

TAIL = 2
"""Keyframes to either side of b's keyframe j that are matched with it: the stretch."""
POINTS_LEAST = 20
"""A stretch with fewer points is not compared: a wall and a corner have as many."""
FINE_M = 0.05
"""Cells of the map of the place, metres."""
SIGMA_M = 0.03
"""Noise of a laser's ranges, metres (``rbpf.sigma_m``)."""
FIRST_LOST_M = 20.0
"""``lost_m`` before any match is believed, metres: rigid placement is off by about the drift over this path."""
ROUND_SIGMAS = 0.6
"""The expected pose is rounded to this many of its standard deviations: a place is matched once, and not again because
a solution has moved it by some centimetres. Of a rigid placement they are 0.27 m and 2 degrees, of which matching finds
its way back. Measured: with 0.1 two robots on 1.9 km of corridors match a fifth more places, for the same errors."""
REMEMBERED = 20_000
"""Most matches cached; at 0.3 kB each 6 MB."""


class Fit(NamedTuple):
    """Where a stretch of b lies in the local map of a."""

    T_i_j: Transform
    """``(3,)``: keyframe j of b in the frame of keyframe i of a."""
    information: NDArray[np.float64]
    """``(3, 3)``, its inverse covariance: 1/m^2, 1/(m rad), 1/rad^2."""


class Answers:
    """Fits by the content of what was asked, the last ones; robots of one process may share it, from any thread."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._fits: OrderedDict[bytes, Fit | None] = OrderedDict()

    def get(self, question: bytes) -> tuple[bool, Fit | None]:
        """Return whether a question was answered, and the answer."""
        with self._lock:
            if question not in self._fits:
                return False, None
            self._fits.move_to_end(question)
            return True, self._fits[question]

    def add(self, question: bytes, fit: Fit | None) -> None:
        """Keep an answer; the one that was asked for least lately goes where there are too many."""
        with self._lock:
            self._fits[question] = fit
            if len(self._fits) > REMEMBERED:
                self._fits.popitem(last=False)


class LocalMatcher:
    """Matches stretches, and caches the results by content; for one thread at a time, as the maps' memory is reused."""

    def __init__(self, answers: Answers | None = None) -> None:
        """``answers`` : those of other matchers as well; by content, so that they are the ones found here."""
        self._matcher = PlaceMatcher(FINE_M, SIGMA_M)
        self._answers = answers or Answers()
        self.matched = 0
        """Stretches matched so far, without those answered from the cache."""

    def match(self, a: Trail, i: int, b: Trail, j: int, T_i_j: Transform, lost_m: float) -> Fit | None:
        """Return the pose of ``b``'s keyframe ``j`` in the frame of ``a``'s keyframe ``i``, None where they do not fit.

        ``T_i_j (3,)`` is the expected pose; its uncertainty is the drift over ``lost_m`` metres of path, or over those
        of a rigid placement (``FIRST_LOST_M``) where these are more: so it is the same question before and after a
        solution. A match's information is that of its beams alone; more room for drift makes it no surer.
        """
        # In steps of a factor, so that a path that grows finds the cached match again.
        lost_m = FIRST_LOST_M * 2.0 ** np.ceil(np.log2(max(lost_m / FIRST_LOST_M, 1.0)))
        step = ROUND_SIGMAS * expected_sigmas(lost_m)
        expected = np.round(T_i_j / step) * step + 0.0  # which makes 0 of -0: they have other bytes
        asked = expected.tobytes() + np.float64(lost_m).tobytes() + a.content(i, GROUP) + b.content(j, TAIL)
        key = hashlib.blake2b(asked, digest_size=16).digest()
        is_known, answer = self._answers.get(key)
        if not is_known:
            self.matched += 1
            answer = self._search(a, a.stretch(i, GROUP), _points(b, b.stretch(j, TAIL)), expected, lost_m)
            self._answers.add(key, answer)
        return answer

    def _search(
        self,
        a: Trail,
        group: Stretch,
        source: NDArray[np.float64],
        expected: Transform,
        lost_m: float,
    ) -> Fit | None:
        """Return how ``source (N, 5)``, points in the frame of b's keyframe, fits the place of a's ``group``."""
        if source.shape[0] < POINTS_LEAST:
            return None
        origins = a.scans.origins[group.keys].astype(np.float64)
        place = Place(origins, group.T_key_keys, [a.points(int(k)) for k in group.keys])
        found = self._matcher.match(place, source, expected, lost_m)
        return Fit(found.pose, edge_information(found)) if fits(found) else None


def _points(trail: Trail, stretch: Stretch) -> NDArray[np.float64]:
    """Return the points ``(N, 5)`` of a stretch in the frame of its keyframe, without unsure ones (quality < 0)."""
    parts = []
    for T, k in zip(stretch.T_key_keys, stretch.keys, strict=True):
        points = trail.points(int(k))
        parts.append(transformed(points[points[:, 4] >= 0.0], T))
    return np.ascontiguousarray(np.concatenate(parts))
