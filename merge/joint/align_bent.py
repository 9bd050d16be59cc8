"""Aligning two maps that do not fit rigidly: bent until their scans agree, they are tested once more."""

from __future__ import annotations

from dataclasses import dataclass, replace

from mrslam.alignment import Alignment, AlignmentConfig, Rejection, align
from mrslam.merge.joint.bend import Bend
from mrslam.merge.joint.join import join
from mrslam.merge.joint.local_match import LocalMatcher
from mrslam.merge.joint.trail import Trail
from mrslam.spatial import OccupancyGrid, se2

TIES_LEAST = 6
"""Least believed matches before a pair is bent to pass the tests: twice ``MATCHES_LEAST``, for a pair rejected once."""
SAME_M, SAME_RAD = 1.0, 0.1
"""Largest difference of the bent maps' alignment from the transform they were bent to, metres and radians."""

EVEN = 1.0
"""Contradicted wall per metre of agreeing wall that is allowed of maps whose parts fit one by one, by all tests: as
much as agrees. Measured outdoors, among trees: 0.4 to 0.6 where everything lies right."""


@dataclass(frozen=True, eq=False)
class Scanned:
    """A map with the trail that made it, both in the map's frame."""

    grid: OccupancyGrid
    trail: Trail


def align_bent(
    a: Scanned, b: Scanned, rejected: Rejection, method: str, config: AlignmentConfig, matcher: LocalMatcher
) -> Alignment | Rejection:
    """Return an alignment ``T_a_b`` where the maps fit once they are bent, else the rejection.

    ``rejected`` : of the unbent maps; only one with ``may_bend`` is reconsidered. The bent maps are aligned without a
    prior, pass all tests, and must fit where their trails were joined (``SAME_M``, ``SAME_RAD``). Large maps of which
    parts fit are examined there alone, with rivals everywhere; of these walls as much may contradict as agrees.
    """
    if not rejected.may_bend or rejected.T_a_b is None or not (len(a.trail) and len(b.trail)):
        return rejected
    joint = join({"a": a.trail, "b": b.trail}, {"a": se2.IDENTITY, "b": rejected.T_a_b}, matcher)
    if joint.tied("a", "b") < TIES_LEAST:
        return rejected
    one, two = (Bend(x.trail.T_map_key, joint.T_team_key[name]) for name, x in (("a", a), ("b", b)))
    T_a_b, place = se2.between(one.T_team_map, two.T_team_map), None
    if rejected.is_in_parts:
        config, place = replace(config, max_contradiction=EVEN, max_deep_contradiction=EVEN), T_a_b
    outcome = align(
        one.bent(a.grid), two.bent(b.grid), method=method, config=config, place=place, by_parts=False
    )  # fmt: skip
    if isinstance(outcome, Rejection):
        return replace(rejected, reason=f"{rejected.reason}; bent to fit: {outcome.reason}")
    away_m, turned_rad = se2.difference(outcome.T_a_b, T_a_b)
    if away_m > SAME_M or turned_rad > SAME_RAD:
        return replace(rejected, reason=f"{rejected.reason}; bent to fit, they fit {away_m:.1f} m elsewhere")
    # The edge is between the maps as published; the next joint solution starts from it and bends them again.
    return replace(outcome, T_a_b=rejected.T_a_b, is_in_parts=rejected.is_in_parts)
