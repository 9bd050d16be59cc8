"""The particles: many ways the robot may have come, each with a map of its own, and who of them lives on."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.crew import Crew
from mrslam.rbpf.filter.particles import Motion, Proposals, insert_range, propose
from mrslam.rbpf.filter.resampling import effective, normalised, systematic
from mrslam.rbpf.filter.wall_directions import WallDirections
from mrslam.rbpf.front_end.motion import BLIND_M, MOTION, WAY, Agreement, Keyframe, motion_cov
from mrslam.rbpf.loops.loops import SKIP_M
from mrslam.rbpf.match.scan_points import spaced
from mrslam.rbpf.match.sight import SPACING_M
from mrslam.rbpf.outcome import Stopwatch
from mrslam.rbpf.rows import Rows
from mrslam.rbpf.tiles.store import TileStore
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

LOYALTY = 2.0
"""The particle that speaks for all is given up for one that is this much better in log weight."""
SPREAD = 0.1
"""Particles are drawn this much closer than the proposal's deviation. The motion between keyframes is matched scan by
scan and far better than its noise says: by a tenth of that in rooms. The noise has to leave the map room to correct it,
and corridors' maps correct half of it; but drawn by a half, the best particle's heading walks at random, by 0.12 deg in
an office and more in corridors, and its map with it."""
APART_MOST = 1024
"""Particles remember so many keyframes each for itself; of what is older, all remember what the best one has."""
DRAWN_AT_ONCE = 64
"""Scans of a map that is drawn anew are unpacked so many at a time."""
BEYOND_M = 2.0
"""Maps reach this much farther than the laser is used, metres."""
SKIP_CELLS = 2.0
"""In maps of small cells beams clear the map up to this many before their end: floor beside a wall is known, too."""


class ParticleFilter:
    """Grisetti, Stachniss and Burgard 2007, over one pool of tiles."""

    def __init__(self, config: MapperConfig, seed: int, crew: Crew, watch: Stopwatch) -> None:
        n = config.particles
        self.config, self.crew, self.watch = config, crew, watch
        self.store = TileStore(n, config.resolution_m)
        self.log_weights = np.zeros(n)
        self.keys = 0
        """How many keyframes there were."""
        self.best = 0
        """Index of the particle that speaks for all."""
        self.neff = float(n)
        self.resamplings = 0
        self._walls = WallDirections()
        self._shared = Rows(3)  # keyframes on which all particles agree, from the first on
        self._poses = np.zeros((n, 64, 3))  # (particle, keyframe) of those after
        self._rng = np.random.default_rng(seed)
        self._reach_m = config.usable_range_m + BEYOND_M
        self._skip_m = min(SKIP_M, SKIP_CELLS * config.resolution_m)

    @property
    def count(self) -> int:
        """How many particles there are."""
        return self._poses.shape[0]

    @property
    def ends(self) -> Transform:
        """``(N, 3)``, where each particle has the newest keyframe."""
        return self._own[:, -1]

    def ancestry(self, index: int) -> Transform:
        """Return ``(K, 3)``, where a particle has all keyframes."""
        return np.concatenate([self._shared.rows, self._own[index]])

    @property
    def _own(self) -> Transform:
        """``(N, k, 3)``, the keyframes on which particles differ, and always the newest."""
        return self._poses[:, : self.keys - self._shared.size]

    @property
    def weights(self) -> NDArray[np.float64]:
        """``(N,)``, their sum 1."""
        return normalised(self.log_weights)

    def move(self, key: Keyframe) -> Agreement | None:
        """Bring the particles to a keyframe, to be drawn next (:meth:`draw`), and resample them where it is time.

        Return how far the best particle's map agrees with it, None at the very first.
        """
        agreement: Agreement | None = None
        if self.keys == 0:
            self.store.cover(np.full(2, -self._reach_m), np.full(2, self._reach_m))
        else:
            if self._own.shape[1] == APART_MOST:
                self._share(APART_MOST // 2, self.best)
            if self._own.shape[1] == self._poses.shape[1]:
                self._poses = np.concatenate([self._poses, np.zeros_like(self._poses)], axis=1)
            agreement = self._propose(key)
        if self.config.use_walls:
            heading = self._poses[:, self.keys - self._shared.size, 2]
            turn = self._walls.turn(
                key.beams.points, key.beams.origin, float(heading[self.best]), float(key.arrival[WAY])
            )
            if turn != 0.0:
                heading[:] = se2.wrap(heading + turn)
        self.keys += 1
        weights = self.weights
        self.neff = effective(weights)
        if self.neff < self.config.neff_fraction * self.count:
            self._replace(systematic(weights, self.count, float(self._rng.random())), weights)
            self.resamplings += 1
        self.watch.lap("resample")
        return agreement

    def _propose(self, key: Keyframe) -> Agreement:
        n, config, store = self.count, self.config, self.store
        motion = key.arrival[MOTION].copy()
        before = self.ends
        noise = SPREAD * self._rng.standard_normal((n, 3))
        centres = se2.compose(before, motion)[:, :2]
        store.cover(centres.min(axis=0) - self._reach_m, centres.max(axis=0) + self._reach_m)
        few = np.empty_like(key.beams.points)
        few = few[: spaced(key.beams.points, key.beams.origin, SPACING_M, config.beams_filter, few)]
        moved = Motion(motion, motion_cov(config, motion, key.arrival[BLIND_M]))
        maps, out = store.maps, Proposals.empty(n)

        def job(first: int, last: int) -> None:
            propose(maps, few, before, moved, noise, config.sigma_m, config.evidence_beams, first, last, out)

        self.crew.share(job, n)
        self.watch.lap("match")
        self.log_weights += out.gains
        self.log_weights -= self.log_weights.max()
        if self.log_weights[self.best] < -LOYALTY:
            self.best = int(np.argmax(self.log_weights))
        self._poses[:, self._own.shape[1]] = out.poses
        return Agreement(inliers=float(out.inliers[self.best]), conflicts=float(out.conflicts[self.best]))

    def resize(self, count: int) -> None:
        """Go on with more or fewer particles, drawn by their weights; the one that speaks for all is among them."""
        weights = self.weights
        parents = systematic(weights, count, float(self._rng.random()))
        if self.best not in parents:
            parents[0] = self.best
        self._replace(parents, weights)
        self.neff = float(count)

    def _replace(self, parents: NDArray[np.int64], weights: NDArray[np.float64]) -> None:
        """Let ``parents[i]`` live on as particle ``i``; what all then have in common is kept once."""
        heir = int(np.argmax(np.where(parents == self.best, 1.0, weights[parents])))
        own = self._own[parents]
        differ = (own != own[:1]).any(axis=(0, 2))[:-1]
        common = int(np.argmax(differ)) if differ.any() else differ.size
        self._poses = own
        self._share(common, 0)
        self.store.resample(parents)
        self.log_weights = np.zeros(parents.size)
        self.best = heir

    def _share(self, count: int, one: int) -> None:
        """Keep the oldest of the keyframes that each remembers for itself once, as this particle has them."""
        own = self._own
        for pose in own[one, :count]:
            self._shared.add(pose)
        rest = own[:, count:]
        self._poses = np.zeros((own.shape[0], max(64, 2 * rest.shape[1]), 3))
        self._poses[:, : rest.shape[1]] = rest

    def draw(self, key: Keyframe, beside: Callable[[], None]) -> None:
        """Draw the newest keyframe into all maps; ``beside`` is called meanwhile, and must let them be."""
        store, beams = self.store, key.beams
        poses = np.ascontiguousarray(self.ends)

        def insert(first: int, last: int) -> None:
            insert_range(store.maps, beams, poses, self._skip_m, first, last)

        own = partial(store.own, 0, beams, poses, True)
        self.crew.share(insert, self.count, before=own, beside=beside)
        self.watch.lap("map update")

    def adopt(self, poses: Transform, scans: dict[int, NDArray[np.float32]], origins: NDArray[np.float64]) -> None:
        """Let all go on from this trajectory ``(K, 3)`` and the map that the scans of some keyframes make on it."""
        if self.config.use_walls:
            self._walls.adopt(poses[:, 2])
        store = self.store
        store.cover(poses[:, :2].min(axis=0) - self._reach_m, poses[:, :2].max(axis=0) + self._reach_m)
        for i in range(self.count):
            store.clear(i)
        kept = list(scans)
        for first in range(0, len(kept), DRAWN_AT_ONCE):
            keys = kept[first : first + DRAWN_AT_ONCE]
            store.draw(0, origins[keys], poses[keys], [scans[k] for k in keys], self._skip_m)
        store.resample(np.zeros(self.count, dtype=np.int64))
        self._shared = Rows.of(poses[:-1])
        self._poses = np.zeros((self.count, 64, 3))
        self._poses[:, 0] = poses[-1]
        self.log_weights[:] = 0.0

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed filter needs."""
        return {
            "store": self.store.state(), "rng": self._rng.bit_generator.state, "log_weights": self.log_weights,
            "shared": self._shared.rows, "poses": self._own, "best": self.best, "neff": self.neff,
            "resamplings": self.resamplings, "walls": self._walls.state(),
        }  # fmt: skip

    def restore(self, state: dict[str, Any]) -> None:
        """Become the filter that was saved."""
        self.store.restore(state["store"])
        self._rng.bit_generator.state = state["rng"]
        self.log_weights = state["log_weights"]
        self._walls.restore(state["walls"])
        self._shared, poses = Rows.of(state["shared"]), state["poses"]
        self.keys = self._shared.size + poses.shape[1]
        self._poses = np.concatenate([poses, np.zeros((poses.shape[0], max(64, poses.shape[1]), 3))], axis=1)
        self.best, self.neff, self.resamplings = state["best"], state["neff"], state["resamplings"]
