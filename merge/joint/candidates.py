"""Where two robots may have seen the same place, by what is known of their ways."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np

from mrslam.merge.joint.consistent import Match
from mrslam.merge.joint.local_match import DRIFT, FAR_MOST_M
from mrslam.merge.joint.trail import Trail
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

EVERY_M = 2.5
"""Places are compared once in so much way, metres. Measured: twice as often costs twice and changes 1 to 3 %."""
NEAR_M = 2.0
"""Keyframes closer than this are compared even where their places are known without error, metres."""
TURN_COSTS_M = 0.7
"""A turn of one radian makes a keyframe as unlike as this much distance: lasers that look ahead see something else."""
FIRST_LOST_M = 20.0
"""Way for which two maps laid rigidly over each other are as far off as by drift along it, before any match, metres."""


class Candidate(NamedTuple):
    """Two keyframes that may have seen the same place."""

    i: int
    j: int
    T_i_j: Transform
    """Where ``j`` should be in the frame of ``i``."""
    lost_m: float
    """Way on both trails to the nearest match that is believed."""


def candidates(
    trails: tuple[Trail, Trail],
    poses: tuple[Transform, Transform],
    found: Collection[tuple[int, int]],
    believed: Sequence[Match],
) -> list[Candidate]:
    """Return stretches of the second robot's way to compare with the nearest of the first's.

    ``poses`` are both robots' keyframes ``(K, 3)`` in one frame, as far as they are known. Where a match was ``found``
    nothing is compared again.
    """
    (a, b), (T_a, T_b) = trails, poses
    if believed:
        to_a = a.way_from(np.array([match.i for match in believed]))
        to_b = b.way_from(np.array([match.j for match in believed]))
    done_m = np.array([b.way_m[j] for _, j in found])
    chosen: list[Candidate] = []
    last_m = -np.inf
    for j in range(len(b)):
        if b.way_m[j] - last_m < EVERY_M:
            continue
        away = np.hypot(*(T_a[:, :2] - T_b[j, :2]).T)
        i = int(np.argmin(away + TURN_COSTS_M * np.abs(se2.wrap(T_a[:, 2] - T_b[j, 2]))))
        lost_m = float((to_a[:, i] + to_b[:, j]).min()) if believed else FIRST_LOST_M
        if away[i] > min(NEAR_M + DRIFT * lost_m, FAR_MOST_M):
            continue
        last_m = b.way_m[j]
        if done_m.size == 0 or np.abs(done_m - last_m).min() >= 0.5 * EVERY_M:
            chosen.append(Candidate(i, j, se2.between(T_a[i], T_b[j]), lost_m))
    return chosen
