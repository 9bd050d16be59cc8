"""Which beams end at a teammate."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.spatial import Scan, se2
from mrslam.spatial.se2 import Transform


def mask_teammates(
    scan: Scan, T_map_base: Transform, centres_m: NDArray[np.float64], radii_m: NDArray[np.float64]
) -> tuple[Scan, int]:
    """Return the scan with every beam that ENDS in a circle dropped (NaN), and how many were.

    ``centres_m`` : ``(N, 2)`` in my map frame, ``radii_m`` : ``(N,)``. Beams that pass beyond a circle are kept:
    what they hit is behind where the teammate was thought to be. With no circle hit the scan comes back as it is.
    """
    beams = masked_beams(scan, T_map_base, centres_m, radii_m)
    count = int(np.count_nonzero(beams))
    if count == 0:
        return scan, 0
    return scan.with_ranges(np.where(beams, np.float32(np.nan), scan.ranges_m)), count


def masked_beams(
    scan: Scan, T_map_base: Transform, centres_m: NDArray[np.float64], radii_m: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return ``(B,)``, which beams end in a circle."""
    beams = np.zeros(scan.ranges_m.size, dtype=np.bool_)
    if len(centres_m):
        T_map_laser = se2.compose(T_map_base, scan.T_base_laser)
        centres_laser = se2.apply(se2.inverse(T_map_laser), np.asarray(centres_m, dtype=np.float64).reshape(-1, 2))
        radii = np.ascontiguousarray(radii_m, dtype=np.float64)
        ends_in_discs(scan.ranges_m, scan.angle_min_rad, scan.angle_increment_rad, centres_laser, radii, beams)
    return beams


@njit(cache=True, nogil=True)
def ends_in_discs(
    ranges_m: NDArray[np.float32],
    angle_min_rad: float,
    angle_increment_rad: float,
    centres_m: NDArray[np.float64],
    radii_m: NDArray[np.float64],
    out: NDArray[np.bool_],
) -> None:  # pragma: no cover - compiled
    """Set ``out`` ``(B,)`` where a beam's end lies in a disc; ``centres_m`` : ``(N, 2)`` in the laser frame."""
    for i in range(ranges_m.size):
        if not np.isfinite(ranges_m[i]):
            continue
        angle = angle_min_rad + i * angle_increment_rad
        x, y = ranges_m[i] * np.cos(angle), ranges_m[i] * np.sin(angle)
        for k in range(radii_m.size):
            dx, dy = x - centres_m[k, 0], y - centres_m[k, 1]
            if dx * dx + dy * dy <= radii_m[k] * radii_m[k]:
                out[i] = True
                break
