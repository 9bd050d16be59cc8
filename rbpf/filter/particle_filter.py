"""The particle filter: hypotheses of the robot's trajectory, each with a map of its own."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.filter.ancestry import Ancestry
from mrslam.rbpf.filter.particles import Motion, Proposals, insert_range, propose
from mrslam.rbpf.filter.resampling import effective, normalised, systematic
from mrslam.rbpf.filter.wall_directions import WallDirections
from mrslam.rbpf.front_end.motion import BLIND_M, MOTION, WAY, Agreement, Keyframe, motion_cov
from mrslam.rbpf.front_end.sight import SPACING_M
from mrslam.rbpf.loops.headings import Headings
from mrslam.rbpf.outcome import Stopwatch
from mrslam.spatial import se2
from mrslam.spatial.hits.cells import TILE
from mrslam.spatial.hits.drawing import SKIP_M
from mrslam.spatial.hits.store import GROWTH_TILES, TileStore
from mrslam.spatial.matching.scan_points import spaced
from mrslam.spatial.runtime.crew import Crew
from mrslam.spatial.se2 import Transform

BEST_SWITCH_LOG_WEIGHT = 2.0
"""Another particle becomes the best where its log weight is larger by this: the published map must not flicker."""
PROPOSAL_SPREAD = 0.1
"""Share of the proposal's standard deviation that particles are drawn with. The motion between keyframes is matched
scan by scan, and in rooms its error is a tenth of what its noise says. The noise has to let the map correct it, and
maps of corridors correct half of it; but with a share of a half the best particle's heading walks at random, by 0.12
deg in an office and more in corridors, and its map with it."""
DRAWN_AT_ONCE = 64
"""Scans that are unpacked at a time where a map is drawn again: it bounds the memory that takes."""
BEYOND_M = 2.0
"""Maps reach this much farther than the laser is used, metres."""
MOST_TILES = 1 << 20
"""Most tiles in the maps' window, filled or not: 1.6 x 1.6 km at 5 cm, 4 MB for each particle. Where more would be
needed keyframes go by dead reckoning, and are not drawn."""
SCANS_WIDE = 2.0
"""A window this many scans wide is allowed at any rate, whatever the laser's range and the cells' size."""
SKIP_CELLS = 2.0
"""In maps of small cells beams clear the map up to this number of cells before their end, where ``SKIP_M`` is more."""


class ParticleFilter:
    """Grisetti, Stachniss and Burgard 2007, over one pool of tiles."""

    def __init__(self, config: MapperConfig, seed: int, crew: Crew, watch: Stopwatch) -> None:
        self.config, self.crew, self.watch = config, crew, watch
        self.store = TileStore(config.particles, config.resolution_m)
        self.ancestry = Ancestry(config.particles)
        self.log_weights = np.zeros(config.particles)
        """``(N,)``; the largest is 0."""
        self.best = 0
        """Index of the best particle, whose map and trajectory are published."""
        self.neff = float(config.particles)
        """Effective number of particles at the newest keyframe, before resampling."""
        self.resamplings = 0
        self._walls = WallDirections()
        self._rng = np.random.default_rng(seed)
        self._reach_m = config.usable_range_m + BEYOND_M
        self._is_beyond = False  # whether the newest keyframe lies where maps have no room
        self._skip_m = min(SKIP_M, SKIP_CELLS * config.resolution_m)

    @property
    def count(self) -> int:
        """Number of particles."""
        return self.ancestry.count

    @property
    def ends(self) -> Transform:
        """``(N, 3)``, where each particle has the newest keyframe."""
        return self.ancestry.ends

    @property
    def trajectory(self) -> Transform:
        """``(K, 3)``, where the best particle has all keyframes."""
        return self.ancestry.of(self.best)

    @property
    def weights(self) -> NDArray[np.float64]:
        """``(N,)``, their sum 1."""
        return normalised(self.log_weights)

    @property
    def headings(self) -> Headings:
        """What walls say of the keyframes' headings."""
        return self._walls.readings()

    def move(self, key: Keyframe, is_carried: bool = False) -> Agreement | None:
        """Bring the particles to a keyframe, to be drawn next (:meth:`draw`), and resample them where Neff is low.

        ``is_carried`` : whether the robot was carried and nobody knows where to: then only local motion says where it
        goes. Return how far the best particle's map agrees with it, None at the very first.
        """
        agreement: Agreement | None = None
        poses = np.zeros((self.count, 3))
        if self.ancestry.keys > 0:
            self.ancestry.make_room(self.best)
            poses = se2.compose(self.ends, key.arrival[MOTION])
        self._is_beyond = not self.has_room(poses)
        if self._is_beyond:
            agreement = Agreement(inliers=0.0, conflicts=1.0)
        else:
            self._cover(poses[:, :2])
        if is_carried:
            agreement = Agreement(inliers=key.inliers, conflicts=0.0)
        elif self.ancestry.keys > 0 and not self._is_beyond:
            proposals = self._propose(key)
            self._reweigh(proposals.gains)
            poses, agreement = proposals.poses, proposals.agreement(self.best)
        self._turn_by_walls(key, poses, is_carried)
        self.ancestry.append(poses)
        self._resample_if_due()
        self.watch.lap("resample")
        return agreement

    def _propose(self, key: Keyframe) -> Proposals:
        """Return poses drawn from each particle's improved proposal, and what they add to its weight."""
        config, before, beams = self.config, np.ascontiguousarray(self.ends), key.beams
        motion = Motion(key.arrival[MOTION].copy(), motion_cov(config, key.arrival[MOTION], key.arrival[BLIND_M]))
        noise = PROPOSAL_SPREAD * self._rng.standard_normal((self.count, 3))
        points = np.empty_like(beams.points)
        points = points[: spaced(beams.points, beams.origin, SPACING_M, config.beams_filter, points)]
        maps, out = self.store.maps, Proposals.empty(self.count)

        def job(first: int, last: int) -> None:
            propose(maps, points, before, motion, noise, config.sigma_m, config.evidence_beams, first, last, out)

        self.crew.share(job, self.count)
        self.watch.lap("match")
        return out

    def _reweigh(self, gains: NDArray[np.float64]) -> None:
        """Add ``gains (N,)`` to the log weights, and give up the best particle where another is far better."""
        self.log_weights += gains
        self.log_weights -= self.log_weights.max()
        if self.log_weights[self.best] < -BEST_SWITCH_LOG_WEIGHT:
            self.best = int(np.argmax(self.log_weights))

    def _turn_by_walls(self, key: Keyframe, poses: Transform, is_carried: bool) -> None:
        """Turn the new ``poses (N, 3)`` by what the directions of walls say of the best one's heading."""
        if not self.config.use_walls:
            return
        if is_carried:
            self._walls.pass_over()
            return
        heading, way_m = float(poses[self.best, 2]), float(key.arrival[WAY])
        turn = self._walls.turn(key.beams.points, key.beams.origin, heading, way_m)
        if turn != 0.0:
            poses[:, 2] = se2.wrap(poses[:, 2] + turn)

    def _resample_if_due(self) -> None:
        weights = self.weights
        self.neff = effective(weights)
        if self.neff < self.config.neff_fraction * self.count:
            self._replace(systematic(weights, self.count, float(self._rng.random())), weights)
            self.resamplings += 1

    def resize(self, count: int) -> None:
        """Continue with more or fewer particles, drawn by their weights; the best one is among them."""
        weights = self.weights
        parents = systematic(weights, count, float(self._rng.random()))
        if self.best not in parents:
            parents[0] = self.best
        self._replace(parents, weights)
        self.neff = float(count)

    def _replace(self, parents: NDArray[np.int64], weights: NDArray[np.float64]) -> None:
        """Let particle ``i`` continue from ``parents[i]``; the best one's child is the best, or the heaviest's."""
        heir = int(np.argmax(np.where(parents == self.best, 1.0, weights[parents])))
        self.ancestry.inherit(parents)
        self.store.resample(parents)
        self.log_weights = np.zeros(parents.size)
        self.best = heir

    def draw(self, key: Keyframe, beside: Callable[[], None]) -> None:
        """Draw the newest keyframe into all maps; ``beside`` is called meanwhile, and must not touch them."""
        if self._is_beyond:
            beside()
            return
        poses = np.ascontiguousarray(self.ends)

        def insert(first: int, last: int) -> None:
            insert_range(self.store.maps, key.beams, poses, self._skip_m, first, last)

        own = partial(self.store.own, 0, key.beams, poses, True)
        self.crew.share(insert, self.count, before=own, beside=beside)
        self.watch.lap("map update")

    def adopt(self, trajectory: Transform, scans: dict[int, NDArray[np.float32]], origins: NDArray[np.float64]) -> None:
        """Let all particles continue from one trajectory ``(K, 3)`` and the map that scans of keyframes make on it.

        ``scans`` by keyframe, each ``(N, 5)``, taken from ``origins (K, 2)`` on the base.
        """
        if self.config.use_walls:
            self._walls.adopt(trajectory[:, 2])
        self._cover(trajectory[:, :2])
        for i in range(self.count):
            self.store.clear(i)
        kept = list(scans)
        for first in range(0, len(kept), DRAWN_AT_ONCE):
            keys = kept[first : first + DRAWN_AT_ONCE]
            self.store.draw(0, origins[keys], trajectory[keys], [scans[k] for k in keys], self._skip_m)
        self.store.resample(np.zeros(self.count, dtype=np.int64))
        self.ancestry.replace(trajectory)
        self.log_weights[:] = 0.0

    def has_room(self, T_map_base: Transform) -> bool:
        """Return whether maps can hold all that is seen from poses ``(n, 3)``."""
        if not np.isfinite(T_map_base).all():
            return False
        tiles = self.store.window_tiles(*self._seen_from(T_map_base[:, :2]))
        scan_tiles = (2.0 * self._reach_m / (TILE * self.config.resolution_m) + 4.0 * GROWTH_TILES) ** 2
        return tiles <= max(MOST_TILES, SCANS_WIDE**2 * scan_tiles)

    def _seen_from(self, places: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the corners ``(2,)`` of the box that holds all that can be seen from ``places (n, 2)``."""
        return places.min(axis=0) - self._reach_m, places.max(axis=0) + self._reach_m

    def _cover(self, places: NDArray[np.float64]) -> None:
        """Widen the maps' window to all that can be seen from ``places (n, 2)``."""
        self.store.cover(*self._seen_from(places))

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed filter needs."""
        return {
            "store": self.store.state(), "rng": self._rng.bit_generator.state, "log_weights": self.log_weights,
            "ancestry": self.ancestry.state(), "best": self.best, "neff": self.neff,
            "resamplings": self.resamplings, "walls": self._walls.state(),
        }  # fmt: skip

    def restore(self, state: dict[str, Any]) -> None:
        """Become the filter that was saved."""
        self.store.restore(state["store"])
        self._rng.bit_generator.state = state["rng"]
        self.log_weights = state["log_weights"]
        self._walls.restore(state["walls"])
        self.ancestry.restore(state["ancestry"])
        self.best, self.neff, self.resamplings = state["best"], state["neff"], state["resamplings"]
