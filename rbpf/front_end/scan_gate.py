"""Refuses scans that are of no use: too few returns, a laser that is stuck, ranges that show no place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import Scan
from mrslam.spatial.key_scans import ORIGIN_MOST_M
from mrslam.spatial.poses import between
from mrslam.spatial.se2 import Transform

POINTS_LEAST = 10
"""A scan with fewer usable returns is dropped: they fix no pose."""
PART_LEAST = 1
"""The same where several scans are matched together."""
STUCK = 5e-3
"""A scan equal to the last one used bit by bit is dropped if odometry moved by more than this, metres or radians.
Others may have come between: a driver that comes back from an outage may send what it had sent last."""
REPEATED_LEAST = 40
"""Beams that are equal bit by bit show a repeated scan though the others were dropped: so many, or half of a laser's
few. One of a driver that counts in centimetres may be equal by chance, every other one."""
ON_SURFACES = 0.25
"""Where a smaller share of the points lies in line with its neighbours, the scan is scattered. Measured: of random
ranges up to 40 m about 0.06 do, up to 5 m 0.15; of 10 000 scans of halls, offices and streets none had less than
0.29."""
ON_SURFACES_LEAST = 6
"""Where fewer points do, a scan is scattered whatever their share."""
DENSE_RAD = 0.05
"""Beams that return farther apart than this need not hit a surface twice, and their scans are never scattered."""
CLOSEST = 0.1
"""Of the gaps between beams that return this share is smaller than the one that counts: those of a laser of few beams
are all alike, those of random ranges, of which most may lie beyond the longest, are not."""
ALIKE, ALIKE_M, ALIKE_SHARE = 0.3, 0.1, 0.05
"""Two scans show one place if the first share of the beams that return in both are equally long, within the second and
the third share of their length; of random ranges a tenth are."""
ALIKE_LEAST = 20
"""They must be at least as many beams as this."""
TURNED_RAD = 0.4
"""The robot may have turned by this between them."""


class ScanGate:
    """Compares each scan with the one that came before it, used or not, and with the last one that was used."""

    def __init__(self) -> None:
        self._stamp_ns: int | None = None
        self._ranges_m = self._used_m = np.empty(0, dtype=np.float32)
        self._T_odom_used: Transform | None = None  # odometry when the ranges that were used came first

    def refuse(
        self,
        scan: Scan,
        points: NDArray[np.float64],
        T_odom_base: Transform | None,
        points_least: int,
        knows: Callable[[], bool],
    ) -> str | None:
        """Return why a scan is refused, None where it is used.

        ``points (N, 5)`` : of the scan. ``T_odom_base (3,)`` : odometry at its time, if there is some. ``knows()`` :
        whether the scan fits what was seen before; called only where it shows no surfaces.
        """
        before_ns, before_m = self._stamp_ns, self._ranges_m
        same = _repeats(scan.ranges_m, before_m)
        self._stamp_ns = scan.stamp_ns
        if not same:
            self._ranges_m = scan.ranges_m
        elif before_ns == scan.stamp_ns:
            return "the scan repeats the one before"
        was_used = _repeats(scan.ranges_m, self._used_m)
        if was_used and _moved(self._T_odom_used, T_odom_base):
            return "the scan repeats one that was taken elsewhere, by odometry"
        reason = self._useless(scan, points, points_least, knows, None if same else before_m)
        if reason is None and not was_used:
            self._used_m, self._T_odom_used = scan.ranges_m, T_odom_base
        return reason

    def _useless(
        self,
        scan: Scan,
        points: NDArray[np.float64],
        points_least: int,
        knows: Callable[[], bool],
        before_m: NDArray[np.float32] | None,
    ) -> str | None:
        """Return why a scan shows no place, None where it does; ``before_m (B,)`` : ranges of another one."""
        if np.abs(scan.T_base_laser[:2]).max() > ORIGIN_MOST_M:
            return f"a laser more than {ORIGIN_MOST_M:g} m from the base"
        if points.shape[0] < points_least:
            return too_few(points.shape[0], points_least)
        if not _is_scattered(scan, points) or (before_m is not None and _resembles(scan, before_m)) or knows():
            return None
        return "the scan shows no surfaces, nor what was seen before"

    def state(self) -> list[Any]:
        """Return everything that a resumed gate needs."""
        return [self._stamp_ns, self._ranges_m, self._used_m, self._T_odom_used]

    def restore(self, state: list[Any]) -> None:
        """Become the gate that was saved."""
        self._stamp_ns, self._ranges_m, self._used_m, self._T_odom_used = state


def _moved(T_odom_before: Transform | None, T_odom_base: Transform | None) -> bool:
    if T_odom_before is None or T_odom_base is None:
        return False
    return bool(np.abs(between(T_odom_before, T_odom_base)).max() > STUCK)


def too_few(returns: int, least: int) -> str | None:
    """Return why a scan of this number of usable returns is refused, None where it is not."""
    return f"{returns} usable returns, {least} are needed" if returns < least else None


def _repeats(now_m: NDArray[np.float32], before_m: NDArray[np.float32]) -> bool:
    """Return whether ranges equal those before bit by bit, but for beams that were dropped in one of the two.

    Teammates are masked where they are believed to be, which moves on before a laser that is stuck; of one that stands
    close by most beams are.
    """
    if now_m.size != before_m.size:
        return False
    unlike = now_m != before_m  # what was dropped is unlike everything
    if unlike.size - np.count_nonzero(unlike) < min(REPEATED_LEAST, unlike.size / 2):
        return now_m.tobytes() == before_m.tobytes()
    return bool((np.isnan(now_m[unlike]) | np.isnan(before_m[unlike])).all())


def _is_scattered(scan: Scan, points: NDArray[np.float64]) -> bool:
    """Return whether hardly any of a scan's points ``(N, 5)`` lie on surfaces, as random ranges do."""
    on_surfaces = np.count_nonzero(points[:, 4] > 0.0)
    if on_surfaces >= max(ON_SURFACES * points.shape[0], ON_SURFACES_LEAST):
        return False
    returns = np.flatnonzero(np.isfinite(scan.ranges_m))
    beams_apart = float(np.quantile(np.diff(returns), CLOSEST)) if returns.size > 1 else 1.0
    return beams_apart * abs(scan.angle_increment_rad) <= DENSE_RAD


def _resembles(scan: Scan, before_m: NDArray[np.float32]) -> bool:
    """Return whether a scan may show the same place as ranges ``(B,)`` before it, whatever that is."""
    now_m, count = scan.ranges_m, scan.ranges_m.size
    if count != before_m.size:
        return False
    beams = min(int(TURNED_RAD / max(abs(scan.angle_increment_rad), 1e-9)), count // 2)
    return any(
        _alike(now_m[k:], before_m[: count - k]) or _alike(now_m[: count - k], before_m[k:]) for k in range(beams + 1)
    )


def _alike(one_m: NDArray[np.float32], two_m: NDArray[np.float32]) -> bool:
    both = np.isfinite(one_m) & np.isfinite(two_m)
    near_m = np.minimum(one_m[both], two_m[both])
    alike = np.abs(one_m[both] - two_m[both]) <= ALIKE_M + ALIKE_SHARE * near_m
    return bool(np.count_nonzero(alike) >= max(ALIKE_LEAST, ALIKE * alike.size))
