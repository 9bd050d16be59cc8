"""Bodies of robot size in one scan: round things that stand before what is behind them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import Scan, se2

GAP_M = 0.15
"""Ends of neighbouring beams farther apart than this are on two things, metres; on a disc of 0.18 m seen by beams 8 cm
apart, only those that graze it are."""
BEFORE_M = 0.2
"""What is beside a body is farther off than its edge by this, metres: else it is part of a wall, or covered in part."""
ROUND_M, ROUND_SHARE = 0.03, 0.012
"""Root mean square distance of a body's beam ends from its circle, metres, and by which share of the range it may be
larger: range noise of common lasers. A flat front as wide as a robot has 0.06 m."""
WIDTH_M = 0.08
"""A body may look narrower or wider by this, metres: grazing beams are dropped, and noise."""
BEAMS_LEAST = 3
"""Beams on a body: fewer show no shape."""
FARTHEST_M = 8.0
"""Bodies beyond are not looked for, metres: a laser with 0.9 degree steps has two beams on a small robot there."""


def find_bodies(scan: Scan, radius_m: float) -> NDArray[np.float64]:
    """Return the centres ``(N, 2)``, metres, base frame, of things as large and round as a robot of this radius."""
    ranges = scan.ranges_m.astype(np.float64)
    is_hit = np.isfinite(ranges) & (ranges <= FARTHEST_M)
    index = np.flatnonzero(is_hit)
    if index.size < BEAMS_LEAST:
        return np.empty((0, 2))
    angles = scan.angles_rad[index]
    ends = ranges[index, None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    # A single dropped beam does not part a thing.
    is_apart = (np.hypot(*np.diff(ends, axis=0).T) > GAP_M) | (np.diff(index) > 2)
    begins = np.concatenate([[0], np.flatnonzero(is_apart) + 1])
    stops = np.append(begins[1:], index.size)
    is_enough = stops - begins >= BEAMS_LEAST
    begins, stops = begins[is_enough], stops[is_enough]
    as_wide = _as_wide(ends[stops - 1] - ends[begins], stops - begins, radius_m)
    found = [
        centre
        for begin, stop in zip(begins[as_wide].tolist(), stops[as_wide].tolist(), strict=True)
        if _stands_free(ranges, index[begin], index[stop - 1])
        and (centre := _centre(ends[begin:stop], radius_m)) is not None
    ]
    return se2.apply(scan.T_base_laser, np.array(found).reshape(-1, 2))


def _as_wide(across_m: NDArray[np.float64], beams: NDArray[np.int64], radius_m: float) -> NDArray[np.bool_]:
    """Return of which things ``(N, 2)``, from the first end to the last, this number of beams shows a circle's width.

    A laser sees the near half of it: as wide as the circle, unless the beams are few.
    """
    width = np.hypot(*across_m.T)
    spacing = width / (beams - 1)
    is_wide: NDArray[np.bool_] = width >= 2.0 * radius_m - 2.5 * spacing - WIDTH_M
    return is_wide & (width <= 2.0 * radius_m + WIDTH_M)


def _centre(ends: NDArray[np.float64], radius_m: float) -> NDArray[np.float64] | None:
    """Return the middle ``(2,)`` of the circle that these ends ``(N, 2)`` lie on, None where they lie on none.

    A laser sees the near half of it, nearest in the middle.
    """
    away = np.hypot(*ends.T)
    middle = ends[0] / away[0] + ends[-1] / away[-1]
    middle /= np.hypot(*middle)
    along, across = ends @ middle, ends @ np.array([-middle[1], middle[0]])
    depth = np.sqrt(np.maximum(radius_m**2 - across**2, 0.0))
    centre: NDArray[np.float64] = middle * float(np.median(along + depth))
    off_m = np.hypot(*(ends - centre).T) - radius_m
    if float(np.sqrt(np.mean(off_m**2))) > ROUND_M + ROUND_SHARE * float(np.hypot(*centre)):
        return None
    return centre


def _stands_free(ranges_m: NDArray[np.float64], first: int, last: int) -> bool:
    """Return whether the beams beside a thing go farther than it, on both sides."""
    before, after = first - 1, last + 1
    if before < 0 or after >= ranges_m.size:
        return False  # cut off by the edge of the field of view
    limits = (ranges_m[first] + BEFORE_M, ranges_m[last] + BEFORE_M)
    return all(
        not ranges_m[beside] <= limit for beside, limit in zip((before, after), limits, strict=True)
    )  # inf and NaN are not nearer
