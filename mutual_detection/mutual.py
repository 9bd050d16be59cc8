"""Where a teammate's map lies, by two robots that see each other: no map is needed (Fox et al. 2006; Howard 2006).

Each sees a body, both at the same distance: then the two bearings and the distance are the pose of one robot from the
other. A box or a person seen by both gives such a pose, too, but not the same one again when both robots have moved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrslam.mutual_detection.encounters import Moment
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

RANGES_AGREE_M = 0.15
"""Two robots that see each other measure one distance, to within this, metres: 5 cm of the bodies' middles each, and as
much for what they drove between their scans."""
AGREES_M = 0.3
"""A body this near to where a transform expects it agrees with it, metres."""
MOMENTS_LEAST = 4
"""Moments that must agree on one transform."""
MATE_MOVED_M, BOTH_MOVED_M = 0.6, 1.2
"""Extent of the teammate's places in these moments, and the sum of both robots' extents, metres: twice and four times
``AGREES_M``, for what stands still must not be the teammate."""
SIGMA_M = 0.08
"""Error of one body's place, one sigma, metres: of its middle, of the robot's pose, and of the time between scans."""


@dataclass(frozen=True, eq=False)
class MutualFix:
    """A transform that two robots' sightings of each other agree on."""

    T_map_mate: Transform
    """``(3,)``: maps points of the teammate's map into the own one."""
    covariance: NDArray[np.float64]
    """``(3, 3)``, m^2 and rad^2."""
    moments: int


def mutual_fix(moments: Sequence[Moment]) -> MutualFix | None:
    """Return the transform on which most moments agree with the newest one, or None where too few do."""
    if not moments:
        return None
    newest, best = moments[-1], None
    for one in newest.bodies_m:
        for other in newest.mate_bodies_m:
            if abs(np.hypot(*one) - np.hypot(*other)) > RANGES_AGREE_M:
                continue
            fix = _fit(moments, _by_bearings(newest, one, other))
            if fix is not None and (best is None or fix.moments > best.moments):
                best = fix
    return best


def _by_bearings(moment: Moment, body_m: NDArray[np.float64], mate_body_m: NDArray[np.float64]) -> Transform:
    """Return ``T_map_mate (3,)`` where the body is the teammate, and the body that it sees is this robot."""
    towards, back = (float(np.arctan2(at[1], at[0])) for at in (body_m, mate_body_m))
    T_base_mate = se2.transform(body_m[0], body_m[1], towards + np.pi - back)
    return se2.compose(se2.compose(moment.T_map_base, T_base_mate), se2.inverse(moment.T_mate_base))


def _fit(moments: Sequence[Moment], T_map_mate: Transform) -> MutualFix | None:
    """Return the transform fitted to all moments that agree with it, None where these are too few or stood still."""
    in_map: list[NDArray[np.float64]] = []
    in_mate: list[NDArray[np.float64]] = []
    agreeing = []
    for moment in moments:
        body = _nearest(moment.bodies_m, moment.place_m(T_map_mate))
        mate_body = _nearest(moment.mate_bodies_m, moment.mate_place_m(T_map_mate))
        if body is None or mate_body is None:
            continue
        agreeing.append(moment)
        in_map += [se2.apply(moment.T_map_base, body), moment.T_map_base[:2]]
        in_mate += [moment.T_mate_base[:2], se2.apply(moment.T_mate_base, mate_body)]
    if len(agreeing) < MOMENTS_LEAST:
        return None
    own_m, mate_m = (
        _extent_m(np.array([T[:2] for T in way]))
        for way in zip(*((m.T_map_base, m.T_mate_base) for m in agreeing), strict=True)
    )
    if mate_m < MATE_MOVED_M or own_m + mate_m < BOTH_MOVED_M:
        return None
    p_map, p_mate = np.array(in_map), np.array(in_mate)
    fitted = se2.fit_rigid(p_map, p_mate)
    return MutualFix(fitted, _covariance(p_map, fitted), len(agreeing))


def _nearest(bodies_m: NDArray[np.float64], place_m: NDArray[np.float64]) -> NDArray[np.float64] | None:
    if not len(bodies_m):
        return None
    apart = np.hypot(*(bodies_m - place_m).T)
    k = int(np.argmin(apart))
    return bodies_m[k] if apart[k] <= AGREES_M else None


def _extent_m(places: NDArray[np.float64]) -> float:
    return float(np.hypot(*np.ptp(places, axis=0)))


def _covariance(points: NDArray[np.float64], T_map_mate: Transform) -> NDArray[np.float64]:
    """Return the covariance of a rigid fit to points ``(N, 2)`` with ``SIGMA_M`` each, at the origin of the map fitted.

    Half of the points count: a moment's two share their error of time.
    """
    middle = points.mean(axis=0)
    count = len(points) / 2.0
    around_m2 = max(float(((points - middle) ** 2).sum(axis=1).mean()), SIGMA_M**2)
    place_m2, turn_rad2 = SIGMA_M**2 / count, SIGMA_M**2 / (count * around_m2)
    lever = T_map_mate[:2] - middle
    J = np.array([[1.0, 0.0, -lever[1]], [0.0, 1.0, lever[0]], [0.0, 0.0, 1.0]])
    return J @ np.diag([place_m2, place_m2, turn_rad2]) @ J.T
