"""The particles: many ways the robot may have come, each with a map of its own, and who of them lives on."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbpf.config import MapperConfig
from rbpf.crew import Crew
from rbpf.loops import SKIP_M
from rbpf.matching import RESULT_SIZE
from rbpf.motion import BLIND_M, MOTION, Keyframe, motion_cov
from rbpf.nearest import COS, SIN
from rbpf.outcome import Stopwatch
from rbpf.particles import insert_range, propose
from rbpf.resampling import effective, normalised, systematic
from rbpf.scan_points import spaced
from rbpf.sight import SPACING_M
from rbpf.tile_store import NO_ENDS, TileStore
from spatial import se2
from spatial.se2 import Transform

LOYALTY = 2.0
"""The particle that speaks for all is given up for one that is this much better in log weight."""
BEYOND_M = 2.0
"""Maps reach this much farther than the laser is used, metres."""


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
        self._poses = np.zeros((n, 64, 3))  # (particle, keyframe): every particle's whole ancestry
        self._rng = np.random.default_rng(seed)
        self._reach_m = config.usable_range_m + BEYOND_M

    @property
    def poses(self) -> Transform:
        """``(N, K, 3)``, where each particle has the keyframes."""
        return self._poses[:, : self.keys]

    @property
    def weights(self) -> NDArray[np.float64]:
        """``(N,)``, their sum 1."""
        return normalised(self.log_weights)

    def update(self, key: Keyframe) -> NDArray[np.float64] | None:
        """Take a keyframe; return the row that the matcher wrote for the best particle, None at the very first."""
        result: NDArray[np.float64] | None = None
        if self.keys == 0:
            self.store.cover(np.full(2, -self._reach_m), np.full(2, self._reach_m))
        else:
            if self.keys == self._poses.shape[1]:
                self._poses = np.concatenate([self._poses, np.zeros_like(self._poses)], axis=1)
            result = self._propose(key)
        self.keys += 1
        weights = self.weights
        self.neff = effective(weights)
        if self.neff < self.config.neff_fraction * self.config.particles:
            self._resample(weights)
        self.watch.lap("resample")
        self._insert(key)
        self.watch.lap("map update")
        return result

    def _propose(self, key: Keyframe) -> NDArray[np.float64]:
        n, config, store = self.config.particles, self.config, self.store
        motion = key.arrival[MOTION].copy()
        before = self._poses[:, self.keys - 1]
        noise = self._rng.standard_normal((n, 3))
        centres = se2.compose(before, motion)[:, :2]
        store.cover(centres.min(axis=0) - self._reach_m, centres.max(axis=0) + self._reach_m)
        few = np.empty_like(key.points)
        few = few[: spaced(key.points, key.origin, SPACING_M, config.beams_filter, few)]
        poses, gain, results = np.empty((n, 3)), np.empty(n), np.zeros((n, RESULT_SIZE))
        place = (store.pool, store.tables, store.row0, store.col0, store.resolution_m, few)
        cov = motion_cov(config, motion, key.arrival[BLIND_M])
        self.crew.share(
            lambda first, last: propose(
                *place, before, motion, cov, noise, config.sigma_m, config.evidence_beams, COS, SIN, first, last,
                poses, gain, results,
            ), n,
        )  # fmt: skip
        self.watch.lap("match")
        self.log_weights += gain
        self.log_weights -= self.log_weights.max()
        if self.log_weights[self.best] < -LOYALTY:
            self.best = int(np.argmax(self.log_weights))
        self._poses[:, self.keys] = poses
        return results[self.best]

    def _resample(self, weights: NDArray[np.float64]) -> None:
        parents = systematic(weights, float(self._rng.random()))
        heir = int(np.argmax(np.where(parents == self.best, 1.0, weights[parents])))
        self._poses[:, : self.keys] = self._poses[parents, : self.keys]
        self.store.resample(parents)
        self.log_weights[:] = 0.0
        self.best = heir
        self.resamplings += 1

    def _insert(self, key: Keyframe) -> None:
        store, points, ends = self.store, key.points, key.ends
        poses = np.ascontiguousarray(self._poses[:, self.keys - 1])
        for i in range(self.config.particles):
            store.own(i, key.origin, poses[i], points, ends, True)
        place = (store.pool, store.refs, store.tables, store.row0, store.col0, store.resolution_m, key.origin, poses)
        self.crew.share(
            lambda first, last: insert_range(*place, points, ends, SKIP_M, first, last), self.config.particles
        )

    def adopt(self, poses: Transform, scans: list[NDArray[np.float32]], origins: list[NDArray[np.float64]]) -> None:
        """Let all go on from this trajectory ``(K, 3)`` and the map it makes: a loop's closing leaves one history."""
        store = self.store
        store.cover(poses[:, :2].min(axis=0) - self._reach_m, poses[:, :2].max(axis=0) + self._reach_m)
        for i in range(self.config.particles):
            store.clear(i)
        for pose, scan, origin in zip(poses, scans, origins, strict=True):
            points = scan.astype(np.float64)
            store.own(0, origin, pose, points, NO_ENDS, True)
            store.insert(0, origin, pose, points, NO_ENDS, SKIP_M)
        store.resample(np.zeros(self.config.particles, dtype=np.int64))
        self._poses[:, : self.keys] = poses
        self.log_weights[:] = 0.0

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed filter needs."""
        return {
            "store": self.store.state(), "rng": self._rng.bit_generator.state, "log_weights": self.log_weights,
            "poses": self.poses, "best": self.best, "neff": self.neff, "resamplings": self.resamplings,
        }  # fmt: skip

    def restore(self, state: dict[str, Any]) -> None:
        """Become the filter that was saved."""
        self.store.restore(state["store"])
        self._rng.bit_generator.state = state["rng"]
        self.log_weights = state["log_weights"]
        poses = state["poses"]
        self.keys = poses.shape[1]
        self._poses = np.concatenate([poses, np.zeros((poses.shape[0], max(64, self.keys), 3))], axis=1)
        self.best, self.neff, self.resamplings = state["best"], state["neff"], state["resamplings"]
