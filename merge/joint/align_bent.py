"""Aligning two maps that do not fit rigidly: bent until their scans agree, they are judged once more."""

from __future__ import annotations

from dataclasses import dataclass, replace

from mrslam.alignment import Alignment, AlignmentConfig, Rejection, align
from mrslam.merge.joint.bend import Bend
from mrslam.merge.joint.join import join
from mrslam.merge.joint.local_match import LocalMatcher
from mrslam.merge.joint.trail import Trail
from mrslam.spatial import OccupancyGrid, se2

TIES_LEAST = 6
"""Matched places that two maps must share before bending may help them: twice what ties two maps that fit."""
SAME_M, SAME_RAD = 1.0, 0.1
"""The bent maps must fit where they were bent to fit, within this."""


@dataclass(frozen=True, eq=False)
class Scanned:
    """A map with the way that made it."""

    grid: OccupancyGrid
    trail: Trail


def align_bent(
    a: Scanned, b: Scanned, rejected: Rejection, method: str, config: AlignmentConfig, matcher: LocalMatcher
) -> Alignment | Rejection:
    """Return an alignment where the maps fit once they are bent, else the rejection as it is.

    The bent maps pass the same tests against everything else they might fit, and fit where the ways were joined.
    """
    if not rejected.may_bend or rejected.T_a_b is None or not (len(a.trail) and len(b.trail)):
        return rejected
    joint = join({"a": a.trail, "b": b.trail}, {"a": se2.IDENTITY, "b": rejected.T_a_b}, matcher)
    if joint.tied("a", "b") < TIES_LEAST:
        return rejected
    one, two = (Bend(x.trail.T_map_key, joint.T_team_key[name]) for name, x in (("a", a), ("b", b)))
    outcome = align(one.bent(a.grid), two.bent(b.grid), method=method, config=config)
    T_a_b = se2.between(one.T_team_map, two.T_team_map)
    if isinstance(outcome, Rejection):
        return replace(rejected, reason=f"{rejected.reason}; bent to fit: {outcome.reason}")
    away_m, turned_rad = se2.difference(outcome.T_a_b, T_a_b)
    if away_m > SAME_M or turned_rad > SAME_RAD:
        return replace(rejected, reason=f"{rejected.reason}; bent to fit, they fit {away_m:.1f} m elsewhere")
    return replace(outcome, T_a_b=rejected.T_a_b)
