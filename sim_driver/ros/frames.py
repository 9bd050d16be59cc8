"""tf as it comes in, live: mountings of lasers, and odometry at the moment of a scan."""

from __future__ import annotations

from bisect import bisect_right
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.feeds.tf_tree import rotation_matrix
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

KEPT = 1000
"""Most poses kept of a moving frame: 10 s at 100 Hz, more than a scan waits."""
BACKWARD_NS = 1_000_000_000
"""Stamps that run backward by more than this begin a new time, as of a bag that loops; less is disorder."""
FARTHEST_M = 1e9
"""No robot is farther from where its odometry began, metres; differences of greater numbers may not be finite."""
DEEPEST = 64
"""Most frames from a laser up to the odometry's: a longer chain is a loop in a broken tf."""
MOVING_MOST = 100
"""Most moving frames that are kept, at most 0.4 MB each: a robot's joints, and more than :data:`DEEPEST`, so that there
is one to forget. Trackers of people name new frames for ever."""


class RecentMotion:
    """The newest poses ``(3,)`` of something that moves, by stamp."""

    def __init__(self) -> None:
        self._stamps_ns: list[int] = []
        self._poses: list[Transform] = []

    @property
    def newest_ns(self) -> int | None:
        """Stamp of the newest pose."""
        return self._stamps_ns[-1] if self._stamps_ns else None

    def add(self, stamp_ns: int, pose: Transform) -> bool:
        """Add a pose, unless it is a little out of order; return False where it is not finite or absurdly far."""
        if not _is_possible(pose):
            return False
        if self._stamps_ns and stamp_ns < self._stamps_ns[-1] - BACKWARD_NS:
            self._stamps_ns, self._poses = [], []
        if not self._stamps_ns or stamp_ns > self._stamps_ns[-1]:
            self._stamps_ns.append(stamp_ns)
            self._poses.append(pose)
        if len(self._stamps_ns) > 2 * KEPT:
            del self._stamps_ns[:KEPT], self._poses[:KEPT]
        return True

    def at(self, stamp_ns: int) -> tuple[Transform, int] | None:
        """Return the pose at a stamp, and by how many nanoseconds that lies beyond what is known; None without any.

        Between two poses it is interpolated; beyond the newest or oldest it is that one, and the number is positive
        (the stamp is newer) or negative.
        """
        if not self._stamps_ns:
            return None
        after = bisect_right(self._stamps_ns, stamp_ns)
        if after == 0:
            return self._poses[0], stamp_ns - self._stamps_ns[0]
        before_ns, before = self._stamps_ns[after - 1], self._poses[after - 1]
        if after == len(self._stamps_ns):
            return before, stamp_ns - before_ns
        share = (stamp_ns - before_ns) / (self._stamps_ns[after] - before_ns)
        return se2.compose(before, share * se2.between(before, self._poses[after])), 0


class LiveFrames:
    """The transforms heard so far: fixed ones for good, moving ones for the last seconds."""

    def __init__(self, base: str) -> None:
        """``base`` : the robot's frame; those that it moves in are never forgotten."""
        self._base = base
        self._parents: dict[str, str] = {}
        self._fixed: dict[str, NDArray[np.float64]] = {}  # (4, 4), by child
        self._moving: dict[str, RecentMotion] = {}  # the one heard last at the end

    def add(self, transform: Any, is_static: bool) -> bool:
        """Take one ``geometry_msgs/TransformStamped``; return False where it makes no sense, and is passed over."""
        parent, child = transform.header.frame_id.lstrip("/"), transform.child_frame_id.lstrip("/")
        place, turn = transform.transform.translation, rotation_matrix(transform.transform.rotation)
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = turn, (place.x, place.y, place.z)
        if not parent or not child or parent == child or not _is_possible(matrix):
            return False
        self._parents[child] = parent
        self._fixed[child] = matrix
        if is_static:
            self._moving.pop(child, None)
            return True
        stamp = transform.header.stamp
        self._moving[child] = motion = self._moving.pop(child, None) or RecentMotion()
        motion.add(stamp.sec * 1_000_000_000 + stamp.nanosec, _flat(matrix))
        if len(self._moving) > MOVING_MOST:
            self._forget_one()
        return True

    def _forget_one(self) -> None:
        """Forget the moving frame that was heard longest ago, of those that the base does not move in."""
        above = self._upward(self._base)
        oldest = next(name for name in self._moving if name not in above)
        del self._moving[oldest], self._parents[oldest], self._fixed[oldest]

    def mounting(self, base: str, frame: str) -> tuple[Transform, bool] | None:
        """Return how a frame is mounted on the base in the plane, and whether upside down; None if tf does not say."""
        above = self._upward(base)
        common = next((one for one in self._upward(frame) if one in above), None)
        if common is None or any(one in self._moving for one in above[: above.index(common)]):
            return None
        mount = np.linalg.inv(self._matrix(common, base)) @ self._matrix(common, frame)
        return _flat(mount), bool(mount[2, 2] < 0.0)

    def _upward(self, frame: str) -> list[str]:
        """Return a frame and those above it."""
        names = [frame]
        while names[-1] in self._parents and len(names) <= DEEPEST:
            names.append(self._parents[names[-1]])
        return names

    def _matrix(self, above: str, frame: str) -> NDArray[np.float64]:
        """Return ``T_above_frame (4, 4)`` as it was told last."""
        matrix = np.eye(4)
        for name in self._chain(frame, above) or ():
            matrix = self._fixed[name] @ matrix
        return matrix

    def pose(self, parent: str, frame: str, stamp_ns: int) -> tuple[Transform, int] | None:
        """Return ``T_parent_frame (3,)`` at a stamp, and by how much that lies beyond what is known.

        As :meth:`RecentMotion.at`. None where tf does not link the two.
        """
        chain = self._chain(frame, parent)
        if chain is None:
            return None
        pose, beyond_ns = se2.IDENTITY, 0
        for name in chain:
            if name in self._moving:
                found = self._moving[name].at(stamp_ns)
                if found is None:
                    return None
                step, off_ns = found
                beyond_ns = max(beyond_ns, off_ns, key=abs)
            else:
                step = _flat(self._fixed[name])
            pose = se2.compose(step, pose)
        return pose, beyond_ns

    def _chain(self, frame: str, above: str) -> list[str] | None:
        """Return the frames from this one up to below ``above``; None where they do not lead there."""
        names = self._upward(frame)
        return names[: names.index(above)] if above in names else None


def _is_possible(numbers: NDArray[np.float64]) -> bool:
    """Return whether all numbers of a pose or transform are finite, and no farther than any robot goes."""
    return bool((np.abs(numbers) < FARTHEST_M).all())


def _flat(matrix: NDArray[np.float64]) -> Transform:
    """Return a ``(4, 4)`` transform as one in the plane."""
    return np.array([matrix[0, 3], matrix[1, 3], np.arctan2(matrix[1, 0], matrix[0, 0])])
