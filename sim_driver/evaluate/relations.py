"""Errors against relations: pairs of poses whose true relative pose is known (Kuemmerle et al. 2009)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.evaluate.trajectories import Trajectory
from mrslam.spatial import InputError, se2
from mrslam.spatial.se2 import Transform

Relations = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]
"""Stamps (us) of the two poses of each relation, and the second pose in the frame of the first, ``(N, 3)``."""

LAST_S = 1e10
"""No log is from after this time, seconds since 1970."""
NEAR_US = 5_000
"""A stamp means the nearest scan within this time: files round stamps to 10 us, 1 ms or 10 ms (at most 5 ms off), scans
are 25 ms and more apart, and in 5 ms a robot drives a few millimetres at most."""


def read_relations(path: Path) -> Relations:
    """Read ``t1 t2 x y z roll pitch yaw`` lines (Kuemmerle et al. 2009)."""
    try:
        values = np.loadtxt(path, ndmin=2, comments="#")
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: not a relations file ({error})") from error
    if values.shape[1] != 8:
        raise InputError(f"{path}: a relation has 8 numbers, got {values.shape[1]}")
    if not (np.isfinite(values).all() and (np.abs(values[:, :2]) < LAST_S).all()):
        raise InputError(f"{path}: relations need finite numbers, and times in seconds")
    return _us(values[:, 0] * 1e9), _us(values[:, 1] * 1e9), values[:, [2, 3, 7]]


def _us(stamps_ns: NDArray[np.float64] | NDArray[np.int64]) -> NDArray[np.int64]:
    return np.rint(stamps_ns / 1e3).astype(np.int64)


def cross_errors(
    relations: Relations, poses_a: Trajectory, poses_b: Trajectory, T_a_b: Transform
) -> NDArray[np.float64]:
    """Return ``(N, 2)`` errors (m, deg) of the relations between a pose only robot a has and one only b has.

    Poses are ``(stamps_ns, (K, 3))``, each in its robot's own map frame.
    """
    t1, t2, T_1_2 = relations
    placed_b = poses_b[0], se2.compose(T_a_b, poses_b[1])
    (a1, off_a1), (b1, off_b1) = _nearest(poses_a, t1), _nearest(placed_b, t1)
    (a2, off_a2), (b2, off_b2) = _nearest(poses_a, t2), _nearest(placed_b, t2)
    # two robots of one log have scans side by side: a stamp is the nearer robot's, or both's where both have that scan
    has_a1, has_b1 = _owns(off_a1, off_b1), _owns(off_b1, off_a1)
    has_a2, has_b2 = _owns(off_a2, off_b2), _owns(off_b2, off_a2)
    own = (has_a1 & has_a2) | (has_b1 & has_b2)  # one robot saw both: that judges its mapper, not the merge
    from_a, from_b = ~own & has_a1 & has_b2, ~own & has_b1 & has_a2
    first, second = np.where(from_a[:, None], a1, b1), np.where(from_a[:, None], b2, a2)
    used = from_a | from_b
    return _errors(T_1_2[used], first[used], second[used])


def own_errors(
    relations: Relations, stamps_ns: NDArray[np.int64], T_map_base: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return ``(N, 2)`` errors (m, deg) of the relations between two poses of one robot's trajectory."""
    t1, t2, T_1_2 = relations
    (first, off_1), (second, off_2) = (_nearest((stamps_ns, T_map_base), t) for t in (t1, t2))
    used = (off_1 <= NEAR_US) & (off_2 <= NEAR_US)
    return _errors(T_1_2[used], first[used], second[used])


def _errors(T_1_2: Transform, first: Transform, second: Transform) -> NDArray[np.float64]:
    error = se2.between(T_1_2, se2.between(first, second))
    return np.stack([np.hypot(error[:, 0], error[:, 1]), np.degrees(np.abs(error[:, 2]))], axis=-1)


def _owns(off_us: NDArray[np.int64], others_us: NDArray[np.int64]) -> NDArray[np.bool_]:
    return off_us <= np.minimum(others_us, NEAR_US)


def _nearest(trajectory: Trajectory, asked_us: NDArray[np.int64]) -> tuple[Transform, NDArray[np.int64]]:
    """Return the poses ``(N, 3)`` nearest in time to the stamps asked for, and how far off they are, ``(N,)`` us.

    Of poses with one stamp it is the first.
    """
    stamps_us, first = np.unique(_us(trajectory[0]), return_index=True)
    if len(first) == 0:
        return np.zeros((len(asked_us), 3)), np.full(len(asked_us), NEAR_US + 1)
    right = np.searchsorted(stamps_us, asked_us).clip(max=len(first) - 1)
    left = np.maximum(right - 1, 0)
    nearest = np.where(asked_us - stamps_us[left] <= stamps_us[right] - asked_us, left, right)
    return trajectory[1][first[nearest]], np.abs(stamps_us[nearest] - asked_us)
