"""Candidates from matched key points: ORB (Rublee et al. 2011); brute-force matching with cross-check, RANSAC.

Martins 2013, section 3.5; Hoerner 2016, chapter 2: confidence = inliers / (8 + 0.3 matches).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.proposals.ransac import rigid
from mrslam.alignment.result import Candidate, Prior

MODELS = 3
"""How many transforms are drawn from one set of matches, each from what the ones before left over."""
FEWEST_INLIERS = 5
"""A transform held by fewer matches is chance."""
MAX_PIXELS = 4_000_000
"""Pictures above this are halved before detection."""


def picture(side: PreparedMap) -> tuple[NDArray[np.uint8], float]:
    """Return the map as a blurred grey image (white free, black wall, grey unknown), and its pixel in metres."""
    import cv2

    grey: NDArray[Any] = np.array([127, 255, 0], dtype=np.uint8)[side.state]
    pixel = side.res
    while grey.size > MAX_PIXELS:
        grey = cv2.resize(grey, (grey.shape[1] // 2, grey.shape[0] // 2), interpolation=cv2.INTER_AREA)
        pixel *= 2.0
    return np.asarray(cv2.GaussianBlur(grey, (0, 0), 1.0), dtype=np.uint8), pixel


def orb(a: PreparedMap, b: PreparedMap, config: AlignmentConfig, prior: Prior | None) -> list[Candidate]:
    """Return transforms held by cross-checked ORB matches (Hamming distance), best first."""
    import cv2

    detector = cv2.ORB.create(nfeatures=config.orb_features, scaleFactor=1.2, nlevels=4, fastThreshold=10)
    sides = []
    for side in (a, b):
        image, pixel = picture(side)
        keys, descriptors = detector.detectAndCompute(image, None)
        at = np.array([k.pt for k in keys], dtype=np.float64).reshape(-1, 2)
        sides.append(((at + 0.5) * pixel + (side.x0, side.y0), descriptors))
    (at_a, descriptors_a), (at_b, descriptors_b) = sides
    if descriptors_a is None or descriptors_b is None:
        return []
    i, j = matches(descriptors_a, descriptors_b, cv2.NORM_HAMMING)
    return candidates_of(at_a[i], at_b[j], config)


def matches(one: NDArray[Any], other: NDArray[Any], norm: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the indices of descriptors ``(N, D)``, ``(M, D)`` that are each other's nearest under a norm of OpenCV."""
    import cv2

    if len(one) == 0 or len(other) == 0:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    found = cv2.BFMatcher(norm, crossCheck=True).match(one, other)
    indices = np.array([(m.queryIdx, m.trainIdx) for m in found], dtype=np.int64).reshape(-1, 2)
    return indices[:, 0], indices[:, 1]


def candidates_of(p_a: NDArray[np.float64], p_b: NDArray[np.float64], config: AlignmentConfig) -> list[Candidate]:
    """Return the transforms ``T_a_b`` held by matched points ``(N, 2)``, metres, those of most inliers first."""
    rng = np.random.default_rng(config.seed)
    candidates: list[Candidate] = []
    count = len(p_a)
    for _ in range(MODELS):
        fit = rigid(p_a, p_b, config.ransac_draws, config.ransac_inlier_m, rng)
        if fit is None or fit[1].sum() < FEWEST_INLIERS:
            break
        T_a_b, inlier = fit
        inliers = int(inlier.sum())
        confidence = inliers / (8.0 + 0.3 * count)
        numbers = {"matches": float(count), "inliers": float(inliers), "feature_confidence": confidence}
        candidates.append(Candidate(T_a_b, confidence, numbers))
        p_a, p_b = p_a[~inlier], p_b[~inlier]
    return candidates
