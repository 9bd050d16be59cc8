"""The common verification: how well two maps agree under a transform, in numbers, and whether that is enough."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrslam.alignment.evidence import Evidence, WallEvidence
from mrslam.alignment.kernels.agreement import MATCHED, OPPOSED, agreement, free_overlap
from mrslam.alignment.kernels.settling import settle_places
from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.verification.refine import equations
from mrslam.alignment.verification.structure import distinct_walls
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

DEEP_M = 0.4
"""A wall that is free in the other map and farther than this from its walls is not bent by noise, metres."""


WALL_M = 0.5
"""Shorter pieces do not count as a wall, metres."""
MOST_WALLS = 20
"""Counting ends here."""
DISCOUNT = 0.25
"""Contradicted wall per metre of agreeing wall that makes a fit e times less worth."""
SNUG_M, DEEP_ENOUGH_M = 0.2, 0.8
"""How far free space in common reaches before the walls that agree: 0.2 m where maps touch, else 0.7 m or more."""
FROM_BEHIND = 0.3
"""What wall seen from opposite sides is worth beside wall seen from one."""
UNDOES = 2.4
"""Agreeing metres that a contradicting one undoes."""
FREE_STEP = 2
"""Every so manieth row and column of free space is looked at."""
QUICK_CELLS = 4000
"""Cells of free space looked at for a quick look."""


@dataclass(frozen=True, eq=False)
class Agreement:
    """What two maps say of each other under one transform."""

    T_a_b: Transform
    evidence: Evidence
    """``score_m``, ``margin`` and ``proposal`` are not set."""
    pivot: NDArray[np.float64]
    """``(2,)`` centre of the matched walls in frame a, metres."""
    H: NDArray[np.float64]
    """``(3, 3)`` curvature of the fit about ``pivot``, unit weights."""


def judge_walls(
    source: PreparedMap, target: PreparedMap, T_t_s: Transform, tolerance_m: float, step: int = 1
) -> tuple[NDArray[np.uint8], tuple[int, int, int, int]]:
    """Return a verdict per wall point of ``source`` and the counts (matched, opposed, contradicted, unseen)."""
    verdict = np.empty(len(source.points), dtype=np.uint8)
    counts = agreement(source.wall_map, target.wall_map, T_t_s, step, tolerance_m, verdict)
    return verdict, counts


def examine(a: PreparedMap, b: PreparedMap, T_a_b: Transform, tolerance_m: float) -> Agreement:
    """Return the measurements on two maps that decide about ``T_a_b``."""
    T_b_a = se2.inverse(T_a_b)
    verdict_b, (mb, ob, cb, _) = judge_walls(b, a, T_a_b, tolerance_m)
    verdict_a, (ma, oa, ca, _) = judge_walls(a, b, T_b_a, tolerance_m)
    _, (_, _, db, _) = judge_walls(b, a, T_a_b, DEEP_M)
    _, (_, _, da, _) = judge_walls(a, b, T_b_a, DEEP_M)
    res = a.res
    small, large = (a, b) if a.state.size <= b.state.size else (b, a)
    T = T_b_a if small is a else T_a_b
    free, occupied, differ, _ = free_overlap(
        small.state, small.x0, small.y0, FREE_STEP, T, large.state, large.x0, large.y0, res
    )
    shared_m2 = (free + occupied + differ) * (FREE_STEP * res) ** 2
    on_a, on_b = a.points[verdict_a == MATCHED], se2.apply(T_a_b, b.points[verdict_b == MATCHED])
    both = np.concatenate([on_a, on_b])
    pivot = both.mean(axis=0) if len(both) else a.centre
    H, _, used, cost = equations(a, b, T_a_b, pivot, tolerance_m, 0.5 * tolerance_m)
    hit = (verdict_b == MATCHED) | (verdict_b == OPPOSED)  # another side of the same wall is a coincidence too
    sizes = distinct_walls(b.points[hit], b.normals[hit], WALL_M / res, 0.3, MOST_WALLS)
    evidence = Evidence(
        a=WallEvidence(ma * res, oa * res, ca * res, da * res),
        b=WallEvidence(mb * res, ob * res, cb * res, db * res),
        overlap_m2=shared_m2,
        overlap=min(shared_m2 / max(min(a.known_m2, b.known_m2), 1e-9), 1.0),  # looked at by steps of cells
        free_m2=free * (FREE_STEP * res) ** 2,
        acceptance_index=(free + occupied) / max(free + occupied + differ, 1),
        crosswise_m=0.5 * res * float(np.linalg.eigvalsh(H[:2, :2])[0]),
        extent_m=float(np.sqrt(both.var(axis=0).sum())) if len(both) else 0.0,
        walls=len(sizes),
        residual=cost / max(used, 1),
    )
    return Agreement(T_a_b, evidence, pivot, H)


@dataclass(frozen=True)
class Case:
    """What speaks for and against a fit, by the worse direction."""

    matched_m: float
    """Wall on wall that faces the same way, metres."""
    opposed_m: float
    """Wall on wall that faces otherwise, seen by the other map from behind, metres."""
    contradicted_m: float
    """Wall where the other map is free, metres."""
    free_m2: float
    """Free in both, square metres."""

    @property
    def open(self) -> float:
        """Return 0..1: whether both maps know free space before the walls that agree.

        Who sees a wall sees the space before it. Maps that merely touch agree along a long wall, and share no room.
        """
        depth_m = self.free_m2 / max(self.matched_m, 0.1)
        return min(max((depth_m - SNUG_M) / (DEEP_ENOUGH_M - SNUG_M), 0.0), 1.0)

    def worth(self, discount: float = DISCOUNT) -> float:
        """Return metres of wall that speak for the fit, discounted by the share that contradicts.

        Where every metre weighs alike, the right place of bent maps falls below places that share a corner and nothing
        else; where the share decides, it stays above them, for chance contradicts about as much as it agrees.
        """
        behind = FROM_BEHIND * min(self.opposed_m, 2.0 * self.matched_m + 2.0)
        share = self.contradicted_m / max(self.matched_m, 0.1)
        return (self.matched_m + behind) * self.open * math.exp(-share / discount)

    @property
    def balance(self) -> float:
        """Return metres that speak for the fit less those against it, each weighed by how seldom it is chance.

        Of wall laid on a wrong place some 40 % agree; at the right place of maps that are bent as usual 8 % contradict:
        a metre that contradicts undoes 2.4 that agree.
        """
        return self.open * (self.matched_m - UNDOES * self.contradicted_m)


def case(evidence: Evidence) -> Case:
    """Return what speaks for and against a fit that was examined."""
    return Case(
        evidence.matched_m,
        min(evidence.a.opposed_m, evidence.b.opposed_m),
        evidence.contradicted_m,
        evidence.free_m2,
    )


def free_step(small: PreparedMap, most_cells: float) -> int:
    """Return the rows and columns from one cell of free space that is looked at to the next, for so many cells."""
    return max(FREE_STEP, math.ceil(math.sqrt(small.state.size / most_cells)))


def quick_case(
    a: PreparedMap,
    b: PreparedMap,
    T_a_b: Transform,
    tolerance_m: float,
    most_points: int = 1_000_000,
    most_cells: float = QUICK_CELLS,
) -> Case:
    """Return the same without examining: from at most so many points of each map's walls, and cells of free space."""
    step_a, step_b = (-(-len(side.points) // most_points) for side in (a, b))
    T_b_a = se2.inverse(T_a_b)
    _, (mb, ob, cb, _) = judge_walls(b, a, T_a_b, tolerance_m, step_b)
    _, (ma, oa, ca, _) = judge_walls(a, b, T_b_a, tolerance_m, step_a)
    small, large, T = (a, b, T_b_a) if a.state.size <= b.state.size else (b, a, T_a_b)
    step = free_step(small, most_cells)
    free, _, _, _ = free_overlap(small.state, small.x0, small.y0, step, T, large.state, large.x0, large.y0, a.res)
    return Case(
        min(ma * step_a, mb * step_b) * a.res,
        min(oa * step_a, ob * step_b) * a.res,
        max(ca * step_a, cb * step_b) * a.res,
        free * (step * a.res) ** 2,
    )


def settled_cases(
    a: PreparedMap,
    b: PreparedMap,
    T_a_b: NDArray[np.float64],
    schedule: tuple[tuple[float, float, int], ...],
    most_points: int,
    tolerance_m: float,
) -> list[Case]:
    """Lay walls on walls from each of the places ``T_a_b (N, 3)``, which are overwritten; return what speaks for each.

    The same as ``refine`` and ``quick_case`` one place after the other.
    """
    step_a, step_b = (-(-len(side.points) // most_points) for side in (a, b))
    step = free_step(a if a.state.size <= b.state.size else b, QUICK_CELLS)
    counts = settle_places(
        a.wall_map, b.wall_map, T_a_b, np.stack([a.centre, b.centre]), (step_a, step_b, step),
        np.array(schedule, dtype=np.float64), tolerance_m,
    )  # fmt: skip
    of_b, of_a = counts[:, :3] * (step_b * a.res), counts[:, 3:6] * (step_a * a.res)
    least, most = np.minimum(of_a, of_b), np.maximum(of_a, of_b)
    free_m2 = counts[:, 6] * (step * a.res) ** 2
    return [
        Case(float(least[k, 0]), float(least[k, 1]), float(most[k, 2]), float(free_m2[k])) for k in range(len(counts))
    ]
