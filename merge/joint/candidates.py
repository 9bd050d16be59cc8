"""Pairs of keyframes of two robots that may have seen the same place, by their estimated poses."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np

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
    if believed:
        to_a = a.way_from(np.array([match.i for match in believed]))
        to_b = b.way_from(np.array([match.j for match in believed]))
    nearest, away_m = nearest_keys(T_a[shown[0]], T_b[shown[1]], TURN_COST_M)
    done_m = np.array([b.way_m[j] for _, j in found])
    chosen: list[Candidate] = []
    last_m = -np.inf
    for i, j, away in zip(shown[0][nearest].tolist(), shown[1].tolist(), away_m.tolist(), strict=True):
        if b.way_m[j] - last_m < COMPARED_EVERY_M or away > FAR_MOST_M:
            continue
        lost_m = float((to_a[:, i] + to_b[:, j]).min()) if believed else first_lost_m
        if away > within_m(lost_m):
            continue
        last_m = b.way_m[j]
        if done_m.size == 0 or np.abs(done_m - last_m).min() >= 0.5 * COMPARED_EVERY_M:
            chosen.append(Candidate(i, j, se2.between(T_a[i], T_b[j]), lost_m))
    return chosen


def _are_near(T_a: Transform, T_b: Transform) -> bool:
    """Return whether any two keyframes may be near enough to be compared, by the boxes around ``(K, 3)`` each."""
    if not (len(T_a) and len(T_b)):
        return False
    apart = np.maximum(T_a[:, :2].min(axis=0) - T_b[:, :2].max(axis=0), T_b[:, :2].min(axis=0) - T_a[:, :2].max(axis=0))
    return bool((apart <= FAR_MOST_M).all())
