"""One robot's keyframes with their scans, as a pose graph: relative poses and their information."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from mrslam.merge.joint.normals import with_normals
from mrslam.merge.joint.stretch import Stretch
from mrslam.merge.joint.trail_kernels import seen_again
from mrslam.spatial import KeyScans, LocalMap, se2
from mrslam.spatial.pose_graph import Edges
from mrslam.spatial.se2 import Transform

STEP_M, STEP_RAD = 0.005, 0.001
"""Standard deviation of the motion between keyframes at one place, as a map has it: many scan matches averaged."""
STEP_PER_M, TURN_PER_M = 0.01, 0.001
"""Its growth for each metre between them (1, rad/m): maps of recorded logs are bent by a per cent. Measured: three
times as much gives the same errors on logs, and decimetres in simulated buildings, whose maps are right to millimetres;
with half as much, right matches of maps that are bent by 2 % are dropped (``bench/joint.py``)."""
STEP_PER_RAD, TURN_PER_RAD = 0.005, 0.003
"""And for each radian (m/rad, 1)."""
SEEN_AGAIN_M, SEEN_AGAIN_RAD = 0.03, 0.005
"""Standard deviation of the relative pose of two keyframes at one place, metres and radians: both were matched with one
map of it. Measured: three times as much changes no error between robots by more than 1 %."""
NEAR_M = 2.0
"""Keyframes closer to each other than this saw the same place, metres."""
OLD_WAY_M = 12.0
"""Least path between two keyframes for a place seen again, metres: more than a scan's usual reach indoors."""
EXTENT_LEAST_M = 1.0
"""Places within less than this say nothing of a heading, metres: they are good to centimetres."""
SEEN_AGAIN_EVERY_M = 2.0
"""Least path between two edges to places seen again, metres: ``NEAR_M``, so that no stretch is left out."""


class Whole(NamedTuple):
    """What is known of K keyframes in the trail that they are some of."""

    keys: NDArray[np.int64]
    """``(K,)``: which they are there."""
    way_m: NDArray[np.float64]
    """``(K,)``: path to each, metres."""


@dataclass(frozen=True, eq=False)
class Trail:
    """Keyframes of one robot in its own map, and their scans."""

    T_map_key: Transform
    """``(K, 3)``, as the robot published them."""
    scans: KeyScans
    """The scans of these keyframes, at most 60 points each."""
    stamps_ns: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    """``(K,)`` where they are known."""
    part_of: Whole | None = None
    """Where these are some of a trail's keyframes: what is known of all. None where none is left out."""

    @classmethod
    def of(cls, local: LocalMap) -> Trail:
        """Return the trail of a robot's map, empty where that came without scans."""
        count, keyframes = len(local.key_scans), local.keyframes
        poses = np.asarray(keyframes.T_map_base[:count], dtype=np.float64)
        return cls(poses, local.key_scans, keyframes.stamps_ns[:count])

    def __len__(self) -> int:
        """Return the number of keyframes."""
        return self.T_map_key.shape[0]

    @cached_property
    def core(self) -> Core:
        """The keyframes that a joint solution has to move: those with scans, and the ends of the stretches without.

        The others saw only what these had seen, and follow them, so that a solution's cost grows with what is known,
        and not with how long robots drive about in it.
        """
        is_bare, shown = np.diff(self.scans.starts) == 0, self.scans.shown
        is_inner = is_bare & bool(shown.size)  # where none has a scan there is none to follow
        is_inner[:1] = is_inner[-1:] = False
        is_inner[1:-1] &= is_bare[:-2] & is_bare[2:]
        keys, follows = np.flatnonzero(~is_inner), np.cumsum(~is_inner) - 1
        if is_inner.any():
            _, nearest = cKDTree(self.T_map_key[shown, :2]).query(self.T_map_key[is_inner, :2])
            follows[is_inner] = follows[shown[nearest]]
        stamps_ns = self.stamps_ns[keys[keys < self.stamps_ns.size]]
        part = Trail(self.T_map_key[keys], self.scans.chosen(keys), stamps_ns, Whole(keys, self.way_m[keys]))
        return Core(part, keys, follows)

    def around(self, k: int, count: int) -> NDArray[np.int64]:
        """Return the indices of keyframe ``k`` and of up to ``count`` before and after it in the map."""
        near = np.arange(max(0, k - count), min(k + count + 1, len(self)))
        if self.part_of is None:
            return near
        keys = self.part_of.keys
        return near[np.abs(keys[near] - keys[k]) <= count]

    def stretch(self, k: int, count: int) -> Stretch:
        """Return the keyframes :meth:`around` one."""
        return Stretch.of(self.T_map_key, k, self.around(k, count))

    def content(self, k: int, count: int) -> bytes:
        """Return the hash of a stretch; made once, for many robots' stretches are compared with it."""
        held = self._contents.get((k, count))
        if held is None:
            held = self._contents[k, count] = self.stretch(k, count).content(self.scans)
        return held

    @cached_property
    def _contents(self) -> dict[tuple[int, int], bytes]:
        return {}

    @cached_property
    def way_m(self) -> NDArray[np.float64]:
        """``(K,)``: length of the path from the first keyframe to each, metres."""
        if self.part_of is not None:
            return self.part_of.way_m
        steps = np.hypot(*np.diff(self.T_map_key[:, :2], axis=0).T)
        return np.concatenate([np.zeros(min(len(self), 1)), np.cumsum(steps)])

    @cached_property
    def edges(self) -> Edges:
        """The robot's own pose graph: motion from keyframe to keyframe, and places seen again.

        Measured poses are those of the published keyframes, so that without matches nothing moves; the information says
        how much a match may bend the map.
        """
        chain = np.arange(max(len(self) - 1, 0))
        pairs = np.concatenate([np.stack([chain, chain + 1], axis=1), self._seen_again])
        T = se2.between(self.T_map_key[pairs[:, 0]], self.T_map_key[pairs[:, 1]])
        length, turn = np.hypot(T[:, 0], T[:, 1]), np.abs(T[:, 2])
        sigma_m = STEP_M + STEP_PER_M * length + STEP_PER_RAD * turn
        sigma_rad = STEP_RAD + TURN_PER_M * length + TURN_PER_RAD * turn
        sigma_m[chain.size :], sigma_rad[chain.size :] = SEEN_AGAIN_M, SEEN_AGAIN_RAD
        information = np.zeros((len(pairs), 3, 3))
        information[:, 0, 0] = information[:, 1, 1] = sigma_m**-2
        information[:, 2, 2] = sigma_rad**-2
        return Edges(pairs[:, 0], pairs[:, 1], T, information)

    @cached_property
    def _seen_again(self) -> NDArray[np.int64]:
        """``(E, 2)``: keyframes, the earlier first, between which the robot went far and came back.

        Measured on parts of recorded logs: the loops that the mapper closed, in place of these or
        beside them, change the errors between robots by 5 % at most, either way, so they do not travel with maps.
        """
        keys = np.array(self.T_map_key, order="C")  # of a map that came by radio they are read-only
        return seen_again(keys, self.way_m, OLD_WAY_M, NEAR_M, SEEN_AGAIN_EVERY_M)

    def way_between(self, keys: NDArray[np.int64], others: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return ``(len(keys), len(others))``: shortest path in the pose graph between keyframes, metres.

        From each of ``keys`` it is looked up once: matches come back in every round of joining.
        """
        new = np.array(sorted(set(keys.tolist()) - self._ways.keys()), dtype=np.int64)
        if new.size:
            ways = dijkstra(self.lengths, directed=False, indices=new).astype(np.float32)  # there are many of them
            self._ways.update(zip(new.tolist(), ways, strict=True))
        found = [self._ways[key][others] for key in keys.tolist()]
        return np.array(found, dtype=np.float64).reshape(-1, len(others))

    @cached_property
    def _ways(self) -> dict[int, NDArray[np.float32]]:
        return {}

    @cached_property
    def lengths(self) -> csr_matrix:
        """``(K, K)``: length of each edge of the pose graph, metres."""
        edges = self.edges
        length = np.hypot(*edges.T_first_second[:, :2].T) + 1e-6  # a length of 0 would be no edge
        return coo_matrix((length, (edges.first, edges.second)), shape=(len(self), len(self))).tocsr()

    def points(self, k: int) -> NDArray[np.float64]:
        """Return ``(n, 5)``: the scan of keyframe ``k`` as (x, y, nx, ny, quality) in the keyframe's frame, metres."""
        held = self._points.get(k)
        if held is None:
            held = self._points[k] = with_normals(self.scans.of(k), self.scans.origins[k])
        return held

    @cached_property
    def _points(self) -> dict[int, NDArray[np.float64]]:
        return {}


class Core(NamedTuple):
    """The keyframes of a trail that a joint solution moves, and which of them each of the others follows."""

    trail: Trail
    """Those alone, C of them."""
    keys: NDArray[np.int64]
    """``(C,)``: which of the whole trail's they are."""
    follows: NDArray[np.int64]
    """``(K,)``: which of the C each of the whole trail's is, or follows rigidly: the nearest one with a scan."""

    def spread(self, whole: Trail, T_team_core: Transform) -> Transform:
        """Return ``(K, 3)``, all keyframes of the whole trail, where the core has its own at ``T_team_core (C, 3)``."""
        T_core_key = se2.between(self.trail.T_map_key[self.follows], whole.T_map_key)
        return se2.compose(T_team_core[self.follows], T_core_key)


def rigid(T_a_key: Transform, T_b_key: Transform) -> Transform:
    """Return ``T_a_b (3,)``, the rigid transform that fits keyframes ``(K, 3)`` known in two frames best.

    By their places; where the robot hardly moved, by the last keyframe.
    """
    if np.ptp(T_b_key[:, :2], axis=0).max() < EXTENT_LEAST_M:
        return se2.compose(T_a_key[-1], se2.inverse(T_b_key[-1]))
    return se2.fit_rigid(T_a_key[:, :2], T_b_key[:, :2])
