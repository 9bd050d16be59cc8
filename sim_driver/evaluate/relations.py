"""Errors against relations: pairs of poses whose true relative pose is known (Kuemmerle et al. 2009)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from spatial import InputError, se2
from spatial.se2 import Transform

Relations = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]
"""Stamps (us) of the two poses of each relation, and the second pose in the frame of the first, ``(N, 3)``."""

LAST_S = 1e10
"""No log is from after this time, seconds since 1970."""


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
    relations: Relations,
    poses_a: tuple[NDArray[np.int64], NDArray[np.float64]],
    poses_b: tuple[NDArray[np.int64], NDArray[np.float64]],
    T_a_b: Transform,
) -> NDArray[np.float64]:
    """Return ``(N, 2)`` errors (m, deg) of the relations between a pose only robot a has and one only b has.

    Poses are ``(stamps_ns, (K, 3))``, each in its robot's own map frame.
    """
    by_stamp_a, by_stamp_b = _by_stamp(*poses_a), _by_stamp(*poses_b)
    errors = []
    for t1, t2, T_1_2 in zip(*relations, strict=True):
        t1, t2 = int(t1), int(t2)
        if (t1 in by_stamp_a and t2 in by_stamp_a) or (t1 in by_stamp_b and t2 in by_stamp_b):
            continue  # one robot saw both: that judges its mapper, not the merge
        if t1 in by_stamp_a and t2 in by_stamp_b:
            T_a_1, T_a_2 = by_stamp_a[t1], se2.compose(T_a_b, by_stamp_b[t2])
        elif t1 in by_stamp_b and t2 in by_stamp_a:
            T_a_1, T_a_2 = se2.compose(T_a_b, by_stamp_b[t1]), by_stamp_a[t2]
        else:
            continue
        error = se2.between(T_1_2, se2.between(T_a_1, T_a_2))
        errors.append((np.hypot(error[0], error[1]), np.degrees(abs(error[2]))))
    return np.array(errors, dtype=np.float64).reshape(-1, 2)


def own_errors(
    relations: Relations, stamps_ns: NDArray[np.int64], T_map_base: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return ``(N, 2)`` errors (m, deg) of the relations between two poses of one robot's trajectory."""
    by_stamp = _by_stamp(stamps_ns, T_map_base)
    rows = [
        (by_stamp[int(t1)], by_stamp[int(t2)], T_1_2)
        for t1, t2, T_1_2 in zip(*relations, strict=True)
        if int(t1) in by_stamp and int(t2) in by_stamp
    ]
    if not rows:
        return np.empty((0, 2))
    first, second, true = (np.array(column) for column in zip(*rows, strict=True))
    error = se2.between(true, se2.between(first, second))
    return np.stack([np.hypot(error[:, 0], error[:, 1]), np.degrees(np.abs(error[:, 2]))], axis=-1)


def _by_stamp(stamps_ns: NDArray[np.int64], poses: NDArray[np.float64]) -> dict[int, NDArray[np.float64]]:
    table: dict[int, NDArray[np.float64]] = {}
    for stamp, pose in zip(_us(stamps_ns).tolist(), poses, strict=True):
        table.setdefault(stamp, pose)
    return table
