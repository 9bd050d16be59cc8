"""Scans of keyframes, subsampled and quantised so that they can be kept, sent and matched again anywhere.

A point is a bearing and a range from the laser, both whole numbers: what is sent, written and hashed is exact, and the
metres that follow from it are the same on every machine.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mrslam.spatial.errors import InputError
from mrslam.spatial.se2 import Transform

POINTS_MOST = 60
"""Most points of one keyframe; bounds bytes and matching time (90 are used for loops within one map)."""
APART_M = 0.08
"""Least distance between two of its points, across the beams, metres: four steps of the range."""
RANGE_M = 0.02
"""Step of the range, metres: below the noise of common lasers (0.01 to 0.03 m)."""
BEARINGS = 8192
"""Steps of the bearing in a full turn: a point 40 m away, the farthest that mappers use, moves by 0.015 m at most."""
ORIGIN_M = 1e-3
"""Step of the laser's place on the base, metres."""
ORIGIN_MOST_M = 30.0
"""No laser sits farther from its robot's base, metres (fits 16 bits of ``ORIGIN_M``)."""
SECTORS = 8
"""Directions of the map's frame in which a scan may have seen something, 45 degrees each."""
SAME_M = 1.5
"""A keyframe saw the place of another one that is this near, metres: scans up to 2 m apart are matched, and a robot
that comes by has keyframes every half metre, so that one of those that stay is near enough."""
VISIT_WAY_M = 12.0
"""Least path between two visits of a place, metres: more than a scan's usual reach indoors."""
SHARED = 0.75
"""Least share of the directions seen by a keyframe that another one saw as well: with a field of view of half a turn
headings may differ by less than 90 degrees, with one of a whole turn by any angle."""
KEYFRAMES_MOST = 1 << 22
"""More keyframes are refused; with ``POINTS_MOST`` points each the indices still fit 32 bits."""

_TURN = 2.0 * np.pi * np.arange(BEARINGS) / BEARINGS - np.pi
# Rounded so far above a float64's last place that every machine's cosine comes out the same.
_DIRECTIONS = np.round(np.stack([np.cos(_TURN), np.sin(_TURN)], axis=-1) * 2.0**30) / 2.0**30


@dataclass(frozen=True, eq=False)
class KeyScans:
    """Scan points of K keyframes, P in total, each in its keyframe's base frame.

    Raises ``InputError`` where the arrays contradict each other or their bounds.
    """

    starts: NDArray[np.int32]
    """``(K + 1,) int32``: keyframe k has the points ``starts[k] .. starts[k + 1] - 1``; may have none."""
    polar: NDArray[np.uint16]
    """``(P, 2) uint16``: bearing from the laser (-pi is 0, in ``BEARINGS`` steps a turn; base frame's axes), ascending
    within a keyframe, and range (``RANGE_M``)."""
    origins: NDArray[np.float32]
    """``(K, 2) float32``: the laser in the base frame, metres, whole millimetres."""

    def __post_init__(self) -> None:
        starts, polar, origins = self.starts, self.polar, self.origins
        if starts.ndim != 1 or not 0 < starts.size <= KEYFRAMES_MOST + 1 or starts.dtype != np.int32:
            raise InputError(f"starts must be (K + 1,) int32 with K <= {KEYFRAMES_MOST}, got {starts.shape}")
        if polar.ndim != 2 or polar.shape[1] != 2 or polar.dtype != np.uint16:
            raise InputError(f"polar must be (P, 2) uint16, got {polar.shape} {polar.dtype}")
        if origins.shape != (starts.size - 1, 2) or origins.dtype != np.float32:
            raise InputError(f"origins must be ({starts.size - 1}, 2) float32, got {origins.shape} {origins.dtype}")
        counts = np.diff(starts)
        if starts[0] != 0 or starts[-1] != polar.shape[0] or (counts.size and counts.min() < 0):
            raise InputError(f"starts must rise from 0 to {polar.shape[0]}, the number of points")
        if counts.size and counts.max() > POINTS_MOST:
            raise InputError(f"a keyframe has {counts.max()} points, at most {POINTS_MOST} are allowed")
        if not (np.abs(origins) <= ORIGIN_MOST_M).all():
            raise InputError(f"origins must be finite and within {ORIGIN_MOST_M:g} m of the base")
        if not np.array_equal(quantised_origins(origins), origins):
            raise InputError("origins must be whole millimetres")
        if polar.size and (polar[:, 0].max() >= BEARINGS or polar[:, 1].min() == 0):
            raise InputError(f"bearings must be below {BEARINGS} and ranges above 0")
        falls = np.flatnonzero(polar[1:, 0] < polar[:-1, 0]) + 1
        if not np.array_equal(starts[np.searchsorted(starts, falls)], falls):
            raise InputError("bearings must ascend within a keyframe")

    @classmethod
    def empty(cls) -> KeyScans:
        """Return the scans of no keyframes."""
        return cls.blank(0)

    @classmethod
    def blank(cls, keyframes: int) -> KeyScans:
        """Return scans without points."""
        zeros = np.zeros(keyframes + 1, np.int32)
        return cls(zeros, np.empty((0, 2), np.uint16), np.zeros((keyframes, 2), np.float32))

    @classmethod
    def of_points(cls, scans: Iterable[NDArray[np.float64]], origins: ArrayLike) -> KeyScans:
        """Return these points, each ``(n <= 60, 2)`` metres in its base frame, quantised; ``origins (K, 2)``."""
        laser = quantised_origins(np.asarray(origins, dtype=np.float64).reshape(-1, 2))
        polars = [quantised(points, origin) for points, origin in zip(scans, laser, strict=True)]
        starts = np.concatenate([[0], np.cumsum([len(polar) for polar in polars])]).astype(np.int32)
        return cls(starts, np.concatenate([np.empty((0, 2), np.uint16), *polars]), laser)

    def __len__(self) -> int:
        return self.starts.size - 1

    @cached_property
    def points(self) -> NDArray[np.float32]:
        """``(P, 2) float32``, metres, in the base frame of each point's keyframe; by bearing within one."""
        reach = RANGE_M * self.polar[:, 1].astype(np.float64)
        laser = np.repeat(self.origins.astype(np.float64), np.diff(self.starts), axis=0)
        points: NDArray[np.float32] = (laser + reach[:, None] * _DIRECTIONS[self.polar[:, 0]]).astype(np.float32)
        points.flags.writeable = False
        return points

    @cached_property
    def shown(self) -> NDArray[np.int64]:
        """The keyframes that have points, in order."""
        return np.flatnonzero(np.diff(self.starts))

    def of(self, k: int) -> NDArray[np.float32]:
        """Return ``(n, 2) float32``, the points of keyframe ``k`` in its base frame, metres."""
        return self.points[self.starts[k] : self.starts[k + 1]]

    def part(self, first: int, last: int) -> KeyScans:
        """Return keyframes ``first .. last - 1``, sharing the arrays of points and origins."""
        start, end = self.starts[first], self.starts[last]
        return self.of_checked(self.starts[first : last + 1] - start, self.polar[start:end], self.origins[first:last])

    def chosen(self, keys: NDArray[np.int64]) -> KeyScans:
        """Return some keyframes, which are all that have points."""
        return self.of_checked(self.starts[np.append(keys, len(self))], self.polar, self.origins[keys])

    def directions(self, T_map_key: Transform) -> NDArray[np.bool_]:
        """Return ``(K, SECTORS) bool``: in which directions of the map's frame each keyframe's scan has points.

        ``T_map_key (K, 3)`` : where the keyframes are.
        """
        key = np.repeat(np.arange(len(self)), np.diff(self.starts))
        bearing_rad = 2.0 * np.pi * self.polar[:, 0] / BEARINGS - np.pi + T_map_key[key, 2]
        sector = np.floor(bearing_rad * (SECTORS / (2.0 * np.pi))).astype(np.int64) % SECTORS
        seen = np.zeros((len(T_map_key), SECTORS), dtype=np.bool_)
        seen[key, sector] = True
        return seen

    def copy(self) -> KeyScans:
        """Return the same in memory of its own."""
        return self.of_checked(self.starts.copy(), self.polar.copy(), self.origins.copy())

    @classmethod
    def of_checked(cls, starts: NDArray[np.int32], polar: NDArray[np.uint16], origins: NDArray[np.float32]) -> KeyScans:
        """Return scans of arrays that are known to be sound: the check takes as long as reading them."""
        scans = object.__new__(cls)
        for name, array in (("starts", starts), ("polar", polar), ("origins", origins)):
            object.__setattr__(scans, name, array)
        return scans

    def equals(self, other: KeyScans) -> bool:
        """Return whether both hold the same numbers."""
        pairs = ((self.starts, other.starts), (self.polar, other.polar), (self.origins, other.origins))
        return all(np.array_equal(a, b) for a, b in pairs)

    @classmethod
    def concatenate(cls, parts: Iterable[KeyScans]) -> KeyScans:
        """Return the keyframes of all parts, one after the other."""
        all_parts = [cls.empty(), *parts]
        counts = np.concatenate([[0], *(np.diff(part.starts) for part in all_parts)])
        return cls(
            np.cumsum(counts).astype(np.int32),
            np.concatenate([part.polar for part in all_parts]),
            np.concatenate([part.origins for part in all_parts]),
        )

    def append(self, other: KeyScans) -> KeyScans:
        """Return these keyframes and then those of another."""
        return KeyScans.concatenate((self, other))


def show(others: NDArray[np.bool_], seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which keyframes saw what another one sees: ``(K,)`` of their directions ``(K, S)`` and its ``(S,)``."""
    return np.asarray((others & seen).sum(axis=1) >= SHARED * seen.sum())


def quantised(points: NDArray[np.float64], origin: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Return points ``(n, 2)`` of the base frame as ``(n, 2)`` bearings and ranges from ``origin (2,)``, by bearing.

    What is too near or too far for a whole number above 0 is left out.
    """
    x, y = np.asarray(points, dtype=np.float64)[:, :2].T - origin.astype(np.float64)[:, None]
    bearing = np.round((np.arctan2(y, x) + np.pi) * (BEARINGS / (2.0 * np.pi))).astype(np.int64) % BEARINGS
    reach = np.round(np.hypot(x, y) / RANGE_M)
    keep = (reach >= 1) & (reach <= np.iinfo(np.uint16).max)
    polar = np.stack([bearing[keep], reach[keep].astype(np.int64)], axis=-1)
    return polar[np.lexsort((polar[:, 1], polar[:, 0]))].astype(np.uint16)


def quantised_origins(origins: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return the lasers' places ``(K, 2)`` in whole millimetres, as metres."""
    return (np.round(origins.astype(np.float64) / ORIGIN_M) * ORIGIN_M + 0.0).astype(np.float32)  # no -0
