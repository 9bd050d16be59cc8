"""Errors of a trajectory against a reference: absolute (ATE) and relative (RPE), after Sturm et al. 2012."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

Trajectory = tuple[NDArray[np.int64], NDArray[np.float64]]
"""Stamps ``(N,)`` ns and poses ``(N, 3)``."""

NEAR_NS = 20_000_000
"""Two poses within this time are of one instant."""
LEAST = 3
"""Fewer common poses say nothing."""


def matched(estimate: Trajectory, reference: Trajectory) -> tuple[NDArray[np.int64], Transform, Transform]:
    """Return stamps and poses ``(K, 3)`` of both at their common instants: to each estimate the nearest reference."""
    order = np.argsort(reference[0], kind="stable")
    stamps, poses = reference[0][order], reference[1][order]
    if len(stamps) == 0 or len(estimate[0]) == 0:
        return np.empty(0, dtype=np.int64), np.empty((0, 3)), np.empty((0, 3))
    right = np.clip(np.searchsorted(stamps, estimate[0]), 0, len(stamps) - 1)
    left = np.maximum(right - 1, 0)
    nearest = np.where(np.abs(stamps[left] - estimate[0]) <= np.abs(stamps[right] - estimate[0]), left, right)
    near = np.abs(stamps[nearest] - estimate[0]) <= NEAR_NS
    return estimate[0][near], estimate[1][near], poses[nearest[near]]


def in_mission_time(stamps_ns: NDArray[np.int64], began_s: float) -> NDArray[np.int64]:
    """Return a robot's own stamps as mission times, the first at ``began_s``; those that run backward wait."""
    if not len(stamps_ns):
        return stamps_ns
    rising: NDArray[np.int64] = np.maximum.accumulate(stamps_ns)
    return rising - rising[0] + round(1e9 * began_s)


def fit(estimate: Trajectory, reference: Trajectory) -> Transform | None:
    """Return ``T_reference_map``, which lays the estimate on the reference best; None where too few poses match."""
    _, ours, theirs = matched(estimate, reference)
    return None if len(ours) < LEAST else se2.fit_rigid(theirs[:, :2], ours[:, :2])


def absolute_errors(ours: Transform, theirs: Transform) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return how far poses ``(K, 3)`` are off the true ones, metres and degrees, after the best rigid fit."""
    placed = se2.compose(se2.fit_rigid(theirs[:, :2], ours[:, :2]), ours)
    return np.hypot(*(placed - theirs)[:, :2].T), np.degrees(np.abs(se2.wrap(placed[:, 2] - theirs[:, 2])))


def errors(estimate: Trajectory, reference: Trajectory, span_s: float = 1.0) -> dict[str, Any] | None:
    """Return ATE (after the best rigid fit) and RPE over ``span_s``; None where too few poses are common to both."""
    stamps, ours, theirs = matched(estimate, reference)
    if len(ours) < LEAST:
        return None
    off_m, off_deg = absolute_errors(ours, theirs)
    later = np.searchsorted(stamps, stamps + round(span_s * 1e9) - NEAR_NS)
    known = later < len(stamps)
    first, second = np.flatnonzero(known), later[known]
    exact = np.abs(stamps[second] - stamps[first] - round(span_s * 1e9)) <= NEAR_NS
    first, second = first[exact], second[exact]
    drift = se2.between(se2.between(theirs[first], theirs[second]), se2.between(ours[first], ours[second]))
    return {
        "poses": len(ours),
        "ate_rmse_m": _round(np.sqrt(np.mean(off_m**2))),
        "ate_mean_m": _round(off_m.mean()),
        "ate_max_m": _round(off_m.max()),
        "ate_mean_deg": _round(off_deg.mean()),
        "rpe_span_s": span_s,
        "rpe_rmse_m": _round(np.sqrt(np.mean(np.sum(drift[:, :2] ** 2, axis=1)))) if len(first) else None,
        "rpe_mean_deg": _round(np.degrees(np.abs(drift[:, 2])).mean()) if len(first) else None,
    }


def _round(value: float) -> float:
    return round(float(value), 4)
