"""Coordinate frames of a ROS recording, and motion over time, brought down to the plane."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial.se2 import Transform, wrap

NS = 1_000_000_000


class Motion:
    """Poses over time, in the plane."""

    def __init__(self) -> None:
        self._stamps_ns: list[int] = []
        self._poses: list[tuple[float, float, float]] = []
        self._sorted: tuple[NDArray[np.int64], NDArray[np.float64]] | None = None

    def __len__(self) -> int:
        return len(self._stamps_ns)

    def add(self, stamp_ns: int, position: Any, orientation: Any) -> None:
        """Add one ROS pose; those that are not finite are passed over."""
        yaw = float(np.arctan2(*rotation_matrix(orientation)[1::-1, 0]))
        pose = (float(position.x), float(position.y), yaw)
        if np.isfinite(pose).all():
            self._stamps_ns.append(stamp_ns)
            self._poses.append(pose)
            self._sorted = None

    def at(self, stamp_ns: int, max_gap_s: float) -> Transform | None:
        """Return the pose at a time, between its neighbours or at the ends the nearest; None beyond ``max_gap_s``."""
        if not self._stamps_ns:
            return None
        if self._sorted is None:
            order = np.argsort(np.array(self._stamps_ns, dtype=np.int64), kind="stable")
            self._sorted = np.array(self._stamps_ns, dtype=np.int64)[order], np.array(self._poses)[order]
        stamps, poses = self._sorted
        after = int(np.searchsorted(stamps, stamp_ns))
        a, b = max(after - 1, 0), min(after, len(stamps) - 1)
        if min(abs(int(stamps[a]) - stamp_ns), abs(int(stamps[b]) - stamp_ns)) > max_gap_s * NS:
            return None
        span = int(stamps[b] - stamps[a])
        share = min(max((stamp_ns - int(stamps[a])) / span, 0.0), 1.0) if span > 0 else 0.0
        step = poses[b] - poses[a]
        step[2] = wrap(step[2])
        pose: Transform = poses[a] + share * step
        pose[2] = wrap(pose[2])
        return pose


class TransformTree:
    """All transforms of a recording: who is mounted on whom, and what moves."""

    def __init__(self) -> None:
        self._parents: dict[str, str] = {}
        self._motions: dict[str, Motion] = {}
        self._mounts: dict[str, NDArray[np.float64]] = {}
        self._moving: set[str] = set()

    def add(self, parent: str, child: str, stamp_ns: int, translation: Any, rotation: Any) -> None:
        """Add one transform; the first one of a pair of frames is the mounting."""
        mount = np.eye(4)
        mount[:3, :3] = rotation_matrix(rotation)
        mount[:3, 3] = translation.x, translation.y, translation.z
        if not np.isfinite(mount).all() or parent == child:
            return
        self._parents[child] = parent
        first = self._mounts.setdefault(child, mount)
        if not np.allclose(first, mount, atol=1e-3):
            self._moving.add(child)
        self._motions.setdefault(child, Motion()).add(stamp_ns, translation, rotation)

    def parent(self, frame: str) -> str | None:
        """Return the frame above."""
        return self._parents.get(frame)

    def moves(self, frame: str) -> bool:
        """Return whether a frame moves in the one above it."""
        return frame in self._moving

    def motion(self, frame: str) -> Motion:
        """Return how a frame moves in the one above it."""
        return self._motions[frame]

    def base_above(self, frame: str) -> str | None:
        """Return the robot's base; None where TF does not know the frame.

        The first frame from this one upward that moves in the one above it, else the topmost that is not odom or map.
        """
        if frame not in self._parents:
            return None
        chain = self._upward(frame)
        for name in chain:
            if name in self._moving:
                return name
        fixed = [name for name in chain if not any(word in name.lower() for word in ("odom", "map", "world"))]
        return fixed[-1] if fixed else None

    def between(self, base: str, frame: str) -> tuple[Transform, bool] | None:
        """Return how ``frame`` is mounted on ``base`` in the plane, and whether upside down; None if not linked."""
        chain = self._upward(frame)
        if base not in chain:
            return None
        mount = np.eye(4)
        for name in chain[: chain.index(base)]:
            mount = self._mounts[name] @ mount
        x, y, yaw = mount[0, 3], mount[1, 3], np.arctan2(mount[1, 0], mount[0, 0])
        return np.array([x, y, float(wrap(yaw))]) + 0.0, bool(mount[2, 2] < 0)

    def _upward(self, frame: str) -> list[str]:
        chain = [frame]
        while (above := self._parents.get(chain[-1])) is not None and above not in chain:
            chain.append(above)
        return chain


def rotation_matrix(q: Any) -> NDArray[np.float64]:
    """Return the ``(3, 3)`` rotation of a quaternion of any length; all-zero ones count as no rotation."""
    w, x, y, z = float(q.w), float(q.x), float(q.y), float(q.z)
    n = w * w + x * x + y * y + z * z
    if n < 1e-12:
        return np.eye(3)
    s = 2.0 / n
    return np.array(
        [
            [1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)],
            [s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)],
            [s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)],
        ]
    )
