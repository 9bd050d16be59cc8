"""Candidates from SURF (Bay, Ess, Tuytelaars and Van Gool 2008)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.kernels.surf import COL, LAYER, RESPONSE, ROW, describe, extrema, hessian
from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.proposals.features import candidates_of, matches, picture
from mrslam.alignment.result import Candidate, Prior

SIZES = ((9, 15, 21, 27), (15, 27, 39, 51), (27, 51, 75, 99))
"""Edges of the box filters, pixels, per octave (section 3.3)."""
STEP = (1, 2, 4)
"""Pixels between samples, per octave."""
LEAST_RESPONSE = 1e-3
"""Determinant below which a blob is none, of an image of 0..1; a clean corner of walls has 0.05 and more."""
MOST_EXTREMA = 20_000
"""Bounds the memory of one layer's extrema."""

F64 = NDArray[np.float64]


class KeyPoints(NamedTuple):
    """SURF key points of one image, strongest first."""

    at: F64
    """``(N, 2)`` x, y of pixel centres, pixels."""
    scale: F64
    """``(N,)`` standard deviation of the Gaussian that the filter stands for, pixels."""
    response: F64
    """``(N,)`` determinant of the Hessian."""
    positive: NDArray[np.bool_]
    """``(N,)`` sign of the Laplacian: dark blobs on bright ground have a positive one."""
    descriptors: NDArray[np.float32]
    """``(N, 64)`` of unit length."""


def detect(image: NDArray[np.uint8], most: int) -> KeyPoints:
    """Return the ``most`` strongest key points of a grey image."""
    ii = np.zeros((image.shape[0] + 1, image.shape[1] + 1))
    ii[1:, 1:] = (image.astype(np.float64) / 255.0).cumsum(axis=0).cumsum(axis=1)
    found, signs = [], []
    for sizes, step in zip(SIZES, STEP, strict=True):
        layers = [hessian(ii, size, step) for size in sizes]
        for k in (1, 2):
            rows = np.empty((MOST_EXTREMA, 4))
            (below, _), (here, positive), (above, _) = layers[k - 1 : k + 2]
            rows = rows[: extrema(below, here, above, LEAST_RESPONSE, rows)]
            row, col = (np.round(rows[:, k]).astype(np.int64) for k in (ROW, COL))
            signs.append(positive[row, col])
            rows[:, [COL, ROW]] *= step
            rows[:, LAYER] = 1.2 / 9.0 * (sizes[k] + rows[:, LAYER] * (sizes[k] - sizes[k - 1]))
            found.append(rows)
    rows, positive = np.concatenate(found), np.concatenate(signs)
    best = np.argsort(-rows[:, RESPONSE], kind="stable")[:most]
    at, scale = np.ascontiguousarray(rows[best][:, [COL, ROW]]), rows[best, LAYER]
    descriptors = np.zeros((len(best), 64), dtype=np.float32)
    describe(ii, at, scale, descriptors)
    return KeyPoints(at, scale, rows[best, RESPONSE], positive[best], descriptors)


def surf(a: PreparedMap, b: PreparedMap, config: AlignmentConfig, prior: Prior | None) -> list[Candidate]:
    """Return transforms held by cross-checked SURF matches (Euclidean distance), best first.

    Only key points whose Laplacians have the same sign are compared (section 4.3).
    """
    import cv2

    sides = []
    for side in (a, b):
        image, pixel = picture(side)
        keys = detect(image, config.orb_features)
        sides.append(((keys.at + 0.5) * pixel + (side.x0, side.y0), keys))
    (at_a, keys_a), (at_b, keys_b) = sides
    pairs = []
    for sign in (False, True):
        of_a, of_b = np.flatnonzero(keys_a.positive == sign), np.flatnonzero(keys_b.positive == sign)
        i, j = matches(keys_a.descriptors[of_a], keys_b.descriptors[of_b], cv2.NORM_L2)
        pairs.append((of_a[i], of_b[j]))
    i, j = (np.concatenate(indices) for indices in zip(*pairs, strict=True))
    return candidates_of(at_a[i], at_b[j], config)
