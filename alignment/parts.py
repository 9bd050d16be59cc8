"""Large maps that fit nowhere as one piece: parts of the smaller one, each looked for in the larger one by itself.

A mapper's heading drifts, so that a map of hundreds of metres is bent by metres, and no rigid transform lays more than
a corner of it on another. A part of it is bent as little as any map of that size. Parts found one by one that lie to
each other about as they do in their own map tell where all of it lies.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mrslam.alignment.kernels.walls import REACH
from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.result import Alignment, Rejection
from mrslam.alignment.stability import CORRECTED
from mrslam.spatial import se2

F64 = NDArray[np.float64]
PART_M = 50.0
"""Side of a part, metres: some rooms and a corridor, and by far more wall than a fit must show."""
LARGE_M = 2.0 * PART_M
"""Extent of a map's walls from which it is looked at in parts, metres. At 1 % of bending, ends of smaller ones stay
within the reach of a fit."""
MOST_PARTS = 8
"""Most parts looked for, those with the most wall first; bounds the time."""
LEAST_WALL_M = 20.0
"""Wall below which a part is not looked for, metres."""
APART_M, STRAIN, TURN_RAD = 0.5, 0.03, 0.1
"""Two parts agree where each lays the middle between them within ``APART_M`` and ``STRAIN`` times their distance of
where the other lays it, turned by less than ``TURN_RAD``: usual bending (docs/experiments.md)."""


@dataclass(frozen=True, eq=False)
class Part:
    """A part of map b that was found in map a."""

    centre: F64
    """``(2,)`` middle of its walls, frame b, metres."""
    found: Alignment


def is_large(side: PreparedMap) -> bool:
    """Return whether a map is looked at in parts."""
    return bool(np.max(np.ptp(side.points, axis=0)) >= LARGE_M)


def in_parts(
    b: PreparedMap,
    rejected: Rejection,
    find: Callable[[PreparedMap], Alignment | Rejection],
    place: se2.Transform | None = None,
) -> Rejection:
    """Return the rejection of map b as a whole, one that may bend where ``find`` finds parts of it.

    ``place`` : ``T_a_b (3,)`` asked about, which one of the parts must lie near.
    """
    parts = found_parts(b, find)
    if place is not None:
        parts = [part for part in parts if CORRECTED.is_near(part.found.T_a_b, place)]
    if not parts:
        return rejected
    best = parts[0].found
    reason = f"{rejected.reason}; parts of {PART_M:.0f} m fit one by one: the whole is bent too much"
    return replace(
        rejected, reason=reason, T_a_b=best.T_a_b, evidence=best.evidence, may_bend=True, is_in_parts=True, rivals=()
    )


def found_parts(b: PreparedMap, find: Callable[[PreparedMap], Alignment | Rejection]) -> list[Part]:
    """Return two parts of map b that are found and agree, the one with more agreeing wall first, or nothing."""
    found: list[Part] = []
    for part in parts_of(b)[:MOST_PARTS]:
        outcome = find(part)
        if isinstance(outcome, Rejection):
            continue
        here = Part(part.centre, outcome)
        for other in found:
            if agree(here, other):
                return sorted((other, here), key=lambda one: -one.found.evidence.matched_m)
        found.append(here)
    return []


def parts_of(side: PreparedMap) -> list[PreparedMap]:
    """Return a map cut evenly into parts of about ``PART_M``, most wall first; those with hardly any are left out."""
    low, high = side.points.min(axis=0), side.points.max(axis=0)
    cols, rows = (
        np.linspace(at, end, max(1, round((end - at) / PART_M)) + 1) for at, end in zip(low, high, strict=True)
    )
    parts = [_cut(side, xs, ys) for ys in pairwise(rows) for xs in pairwise(cols)]
    parts = [part for part in parts if part.wall_m >= LEAST_WALL_M]
    return sorted(parts, key=lambda part: -part.wall_m)


def _cut(side: PreparedMap, xs: tuple[float, float], ys: tuple[float, float]) -> PreparedMap:
    """Return the part between ``xs`` and ``ys`` (from, to; metres), with an unknown border."""
    first, last = (
        (round((x - side.x0) / side.res), round((y - side.y0) / side.res)) for x, y in zip(xs, ys, strict=True)
    )
    border = REACH + 1
    state = np.pad(side.state[first[1] : last[1] + 1, first[0] : last[0] + 1], border)
    return PreparedMap(
        state, side.x0 + (first[0] - border) * side.res, side.y0 + (first[1] - border) * side.res, side.res
    )


def agree(one: Part, other: Part) -> bool:
    """Return whether two parts of a map lie to each other about as they do in it."""
    middle = 0.5 * (one.centre + other.centre)
    apart_m, turn_rad = se2.difference_at(one.found.T_a_b, other.found.T_a_b, middle)
    return apart_m <= APART_M + STRAIN * math.hypot(*(one.centre - other.centre)) and turn_rad <= TURN_RAD
