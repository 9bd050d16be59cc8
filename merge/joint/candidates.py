"""Pairs of keyframes of two robots that may have seen the same place, by their estimated poses."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.joint.candidate_kernels import nearest_keys
from mrslam.merge.joint.consistent import KeyMatch
from mrslam.merge.joint.local_match import FIRST_LOST_M
from mrslam.merge.joint.trail import Trail
from mrslam.spatial import se2
from mrslam.spatial.matching.places import FAR_MOST_M, TURN_COST_M, within_m
from mrslam.spatial.se2 import Transform

COMPARED_EVERY_M = 2.5
"""Least path between two keyframes of b that are compared, metres. Measured: half of it costs twice the time and
changes the results by 1 to 3 %."""


class Candidate(NamedTuple):
    """Keyframe ``i`` of one robot and ``j`` of another that may have seen the same place."""

    i: int
    j: int
    T_i_j: Transform
    """``(3,)``: expected pose of ``j`` in the frame of ``i``."""
    lost_m: float
    """Path along both trails to the nearest believed match, metres: the expected pose drifts with it."""


def candidates(
    trails: tuple[Trail, Trail],
    poses: tuple[Transform, Transform],
    found: Collection[tuple[int, int]],
    believed: Sequence[KeyMatch],
    first_lost_m: float = FIRST_LOST_M,
) -> list[Candidate]:
    """Return the keyframes of the second trail to compare, each with the nearest of the first; both have scans.

    ``poses`` : present estimates of both robots' keyframes, ``(K, 3)`` each, in one frame. ``found`` : keyframes (i, j)
    of all matches so far; within half of ``COMPARED_EVERY_M`` along the second trail nothing is compared again.
    ``believed`` : those matches that the last solution believes. ``first_lost_m`` : path over which the poses may have
    drifted where there are none, metres.
    """
    (a, b), (T_a, T_b) = trails, poses
    shown = a.scans.shown, b.scans.shown
    if not _are_near(T_a[shown[0]], T_b[shown[1]]):
        return []
    nearest, away_m = nearest_keys(T_a[shown[0]], T_b[shown[1]], TURN_COST_M, FAR_MOST_M)
    near = np.flatnonzero(away_m <= FAR_MOST_M)
    i, j, away_m = shown[0][nearest[near]], shown[1][near], away_m[near]
    lost_m = np.full(j.size, first_lost_m)
    if believed:
        to_a = a.way_between(np.array([match.i for match in believed]), i)
        to_b = b.way_between(np.array([match.j for match in believed]), j)
        lost_m = (to_a + to_b).min(axis=0)
    done_m = np.sort([b.way_m[j] for _, j in found])
    chosen: list[Candidate] = []
    last_m = -np.inf
    for k in np.flatnonzero(away_m <= within_m(lost_m)).tolist():
        way_m = b.way_m[j[k]]
        if way_m - last_m < COMPARED_EVERY_M:
            continue
        last_m = way_m
        if _is_far(done_m, way_m, 0.5 * COMPARED_EVERY_M):
            chosen.append(Candidate(int(i[k]), int(j[k]), se2.between(T_a[i[k]], T_b[j[k]]), float(lost_m[k])))
    return chosen


def _is_far(done_m: NDArray[np.float64], way_m: float, least_m: float) -> bool:
    """Return whether each of ``done_m``, in order, is at least so far from ``way_m``."""
    k = int(np.searchsorted(done_m, way_m))
    return all(abs(near_m - way_m) >= least_m for near_m in done_m[max(k - 1, 0) : k + 1])


def _are_near(T_a: Transform, T_b: Transform) -> bool:
    """Return whether any two keyframes may be near enough to be compared, by the boxes around ``(K, 3)`` each."""
    if not (len(T_a) and len(T_b)):
        return False
    apart = np.maximum(T_a[:, :2].min(axis=0) - T_b[:, :2].max(axis=0), T_b[:, :2].min(axis=0) - T_a[:, :2].max(axis=0))
    return bool((apart <= FAR_MOST_M).all())
