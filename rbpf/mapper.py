"""One robot's mapper: a Rao-Blackwellised particle filter behind a dense local matcher."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbpf.config import MapperConfig
from rbpf.front_end import COS, SIN, FrontEnd, Step
from rbpf.graph import relax
from rbpf.loops import MOVED_M, SKIP_M, LoopCloser
from rbpf.matching import CONFLICTS, INLIERS, RESULT_SIZE
from rbpf.particles import insert_range, propose
from rbpf.poses import between, compose
from rbpf.publisher import Publisher
from rbpf.resampling import effective, normalised, systematic
from rbpf.scan_points import POINT_COLUMNS, scan_points, spaced
from rbpf.tile_store import TileStore
from rbpf.trajectory import Rows, spread
from spatial import Keyframes, LocalMap, Scan, se2
from spatial.se2 import Transform

POINTS_LEAST = 10
"""A scan with fewer usable returns is dropped."""
SPACING_M = 0.02
HEALTH_MEMORY = 0.2
ANCHOR_M, ANCHOR_RAD = 0.05, 0.02
"""How far smoothing may take a keyframe from where its particle has it (standard deviations)."""
FOLLOW, JUMP_M, JUMP_RAD = 0.25, 0.15, 0.05
"""The pose told takes this share of what it misses of the best particle's at an update, and all of it beyond a jump."""
LOYALTY = 2.0
"""The particle that speaks for all is given up for one that is this much better in log weight."""


@dataclass(frozen=True, kw_only=True, eq=False)
class UpdateInfo:
    """What became of one scan."""

    processed: bool
    """Whether the filter was updated, not only the local motion."""
    T_map_base: Transform
    """``(3,)``, the best pose known now."""
    neff: float
    """Effective number of particles."""
    resampled: bool = False
    """Whether particles were resampled."""
    match_score: float = 0.0
    """Share of beams that fit the local map, 0..1."""
    health: float = 1.0
    """0..1; below 0.5 the pose is doubtful."""
    dropped_beams: int = 0
    """Beams that are no usable return."""
    reason: str | None = None
    """Why the scan was not used; None where it was."""


@dataclass(eq=False)
class Stats:
    """Counts since the start, and CPU seconds by stage (the latter are no part of the mapper's state)."""

    scans: int = 0
    dropped: int = 0
    processed: int = 0
    resamplings: int = 0
    neff_min: float = np.inf
    loops_closed: int = 0
    cpu_s: dict[str, float] = field(default_factory=dict)


class Mapper:
    """Maps with one robot's laser; the map's frame is the robot's pose at its first scan."""

    def __init__(self, config: MapperConfig | None = None, seed: int = 0) -> None:
        """Start with an empty map."""
        self.config = config or MapperConfig()
        self.seed = seed
        n = self.config.particles
        self.stats = Stats()
        self._rng = np.random.default_rng(seed)
        self._front = FrontEnd(self.config)
        self._store = TileStore(n, self.config.resolution_m)
        self._log_weights = np.zeros(n)
        self._poses = np.zeros((n, 64, 3))  # (particle, keyframe): every particle's whole ancestry
        self._keys = 0
        self._arrival = Rows(6)  # per keyframe: local motion from the one before, its way, and its blind error
        self._scan_place = Rows(2, np.int64)  # per scan: stamp, keyframe
        self._scan_motion = Rows(4)  # per scan: local motion since that keyframe, and its way
        self._online = Rows(3)
        self._T_key_base: Transform = np.zeros(3)
        self._T_out: Transform = np.zeros(3)
        self._way = 0.0
        self._blind_m = np.zeros(2)  # in the last keyframe's frame: error of motion along what could not be seen
        self._key_stamp_ns = 0
        self._T_odom_base: Transform | None = None
        self._stamp_ns: int | None = None
        self.best = 0
        """Index of the particle that speaks for all."""
        self._ranges = np.empty(0, dtype=np.float32)
        self._neff = float(n)
        self._health = 1.0
        self._publisher = Publisher()
        self._loops = LoopCloser(self.config)
        self._geometry: tuple[object, ...] = ()
        self._pool = _pool(self.config.threads, n)

    # -- what it knows -------------------------------------------------------------------------------------------------

    @property
    def T_map_base(self) -> Transform:
        """``(3,)``, the best pose known now."""
        if self._keys == 0:
            return np.zeros(3)
        return self._T_out.copy()

    @property
    def particles(self) -> Transform:
        """``(N, 3)`` where each particle has the robot now."""
        if self._keys == 0:
            return np.zeros((self.config.particles, 3))
        return se2.compose(self._poses[:, self._keys - 1], self._T_key_base)

    @property
    def covariance(self) -> NDArray[np.float64]:
        """``(3, 3)`` of the pose over the particles, and of the motion since the last update."""
        if self._keys == 0:
            return np.zeros((3, 3))
        poses = se2.compose(self._poses[:, self._keys - 1], self._T_key_base)
        error = poses - self.T_map_base
        error[:, 2] = se2.wrap(error[:, 2])
        weights = normalised(self._log_weights)
        return np.einsum("i,ij,ik->jk", weights, error, error) + self._motion_cov(self._T_key_base, self._blind_m)

    @property
    def neff(self) -> float:
        """Effective number of particles."""
        return self._neff

    @property
    def health(self) -> float:
        """0..1; below 0.5 the pose is doubtful."""
        return self._health

    def trajectory(self) -> Keyframes:
        """Return the pose of every accepted scan, in the order fed, as the best particle remembers it now."""
        place, motion = self._scan_place.rows, self._scan_motion.rows
        poses = spread(self._smoothed(), place[:, 1], motion[:, :3], motion[:, 3], self._arrival.rows)
        return Keyframes(place[:, 0].copy(), poses)

    def _smoothed(self) -> Transform:
        """Return the best particle's keyframes without the jitter of sampling.

        Each stays near where the filter has it; the local motion, which is finer than the filter's samples, says how
        they lie to each other.
        """
        poses = self._poses[self.best, : self._keys]
        if self._keys < 2:
            return poses.copy()
        chain = np.arange(self._keys - 1)
        near = np.linalg.inv(np.diag(np.square([ANCHOR_M, ANCHOR_M, ANCHOR_RAD])))
        information = np.concatenate([np.linalg.inv(self._chain_cov()[1:]), np.tile(near, (chain.size, 1, 1))])
        return relax(
            poses, np.concatenate([chain, 0 * chain]), np.concatenate([chain + 1, chain + 1]),
            np.concatenate([self._arrival.rows[1:, :3], se2.between(poses[0], poses[1:])]), information,
            np.zeros(2 * chain.size, dtype=bool),
        )  # fmt: skip

    def online_trajectory(self) -> Keyframes:
        """Return the pose of every accepted scan as it was known when the scan came."""
        return Keyframes(self._scan_place.rows[:, 0].copy(), self._online.rows.copy())

    def snapshot(self) -> LocalMap:
        """Return the best particle's map as tiles with revisions, and its keyframes."""
        place = self._scan_place.rows
        first = np.searchsorted(place[:, 1], np.arange(self._keys))
        keyframes = Keyframes(place[first, 0].copy(), self._poses[self.best, : self._keys].copy())
        return LocalMap(self._publisher.publish(self._store, self.best), keyframes)

    # -- what it does --------------------------------------------------------------------------------------------------

    def update(self, scan: Scan, T_odom_base: Transform | None) -> UpdateInfo:
        """Take one scan, and what the wheels said when it was taken; bad data is dropped and counted, never raised."""
        clock = _Clock(self.stats.cpu_s)
        self.stats.scans += 1
        count = self._see(scan)
        dropped = scan.ranges_m.size - count
        if self._stamp_ns is not None and scan.stamp_ns == self._stamp_ns and self._same(scan):
            return self._drop("the scan repeats the one before", dropped)
        if count < POINTS_LEAST:
            return self._drop(f"{count} usable returns, {POINTS_LEAST} are needed", dropped)
        self._stamp_ns, self._ranges = scan.stamp_ns, scan.ranges_m
        points = self._points[:count]
        T_before_odom = self._odometry(T_odom_base)
        few = spaced(points, scan.T_base_laser, SPACING_M, self.config.beams_match, self._few)
        clock.lap("points")
        step = self._front.step(self._few[:few], points, T_before_odom)
        self._T_key_base = compose(self._T_key_base, step.T_before_base)
        if step.blind_m.any():
            self._blind_m += se2.apply(np.array([0.0, 0.0, self._T_key_base[2]]), step.blind_m)
        self._way += float(math.hypot(*step.T_before_base[:2]) + 0.3 * abs(step.T_before_base[2]))
        self._T_out = compose(self._T_out, step.T_before_base)
        clock.lap("front end")
        processed = self._due(scan.stamp_ns)
        resampled = False
        if processed:
            resampled = self._filter(scan, points, step, clock)
            self._follow()
        self._scan_place.add((scan.stamp_ns, self._keys - 1))
        self._scan_motion.add((*self._T_key_base, self._way))
        T_map_base = self.T_map_base
        self._online.add(T_map_base)
        clock.lap("record")
        return UpdateInfo(
            processed=processed, T_map_base=T_map_base, neff=self._neff, resampled=resampled,
            match_score=step.inliers, health=self._health, dropped_beams=dropped,
        )  # fmt: skip

    def _follow(self) -> None:
        """Draw the pose that is told towards the best particle's.

        A particle's pose is a sample: it jitters by centimetres from update to update while local motion is good to
        millimetres. So the pose told follows slowly, but jumps where the two are far apart, as after a loop's closing.
        """
        T_map_key = self._poses[self.best, self._keys - 1]
        missed = between(self._T_out, T_map_key)
        if math.hypot(missed[0], missed[1]) > JUMP_M or abs(missed[2]) > JUMP_RAD:
            self._T_out = T_map_key.copy()
        else:
            self._T_out = compose(self._T_out, FOLLOW * missed)

    def _see(self, scan: Scan) -> int:
        """Turn the scan into points; return how many."""
        geometry = (scan.ranges_m.size, scan.angle_min_rad, scan.angle_increment_rad)
        if geometry != self._geometry:
            self._geometry = geometry
            angles = scan.angles_rad
            self._cos, self._sin = np.cos(angles), np.sin(angles)
            self._points = np.zeros((angles.size, POINT_COLUMNS))
            self._few = np.zeros((angles.size, POINT_COLUMNS))
        return scan_points(
            scan.ranges_m, self._cos, self._sin, scan.T_base_laser, self.config.usable_range_m, self._points
        )

    def _same(self, scan: Scan) -> bool:
        return scan.ranges_m.shape == self._ranges.shape and bool(
            np.array_equal(scan.ranges_m, self._ranges, equal_nan=True)
        )

    def _drop(self, reason: str, dropped: int) -> UpdateInfo:
        self.stats.dropped += 1
        return UpdateInfo(
            processed=False, T_map_base=self.T_map_base, neff=self._neff, health=self._health,
            dropped_beams=dropped, reason=reason,
        )  # fmt: skip

    def _odometry(self, T_odom_base: Transform | None) -> Transform | None:
        before = self._T_odom_base
        if T_odom_base is None or not self.config.use_odometry:
            self._T_odom_base = None
            return None
        now = np.asarray(T_odom_base, dtype=np.float64)
        if now.shape != (3,) or not np.isfinite(now).all():
            self._T_odom_base = None
            return None
        self._T_odom_base = now.copy()
        return None if before is None else between(before, now)

    def _due(self, stamp_ns: int) -> bool:
        if self._keys == 0:
            return True
        config, motion = self.config, self._T_key_base
        waited = 0.0 < config.temporal_update_s <= abs(stamp_ns - self._key_stamp_ns) * 1e-9
        return (
            math.hypot(motion[0], motion[1]) >= config.linear_update_m
            or abs(motion[2]) >= config.angular_update_rad
            or self._way >= 3.0 * config.linear_update_m
            or waited
        )

    def _filter(self, scan: Scan, points: NDArray[np.float64], step: Step, clock: _Clock) -> bool:
        """Update every particle with this scan; return whether they were resampled."""
        n, config, store = self.config.particles, self.config, self._store
        motion = self._T_key_base.copy()
        if self._keys == self._poses.shape[1]:
            self._poses = np.concatenate([self._poses, np.zeros_like(self._poses)], axis=1)
        resampled = False
        reach = config.usable_range_m + 2.0
        if self._keys == 0:
            poses = np.zeros((n, 3))
            store.cover(np.full(2, -reach), np.full(2, reach))
        else:
            before = self._poses[:, self._keys - 1]
            noise = self._rng.standard_normal((n, 3))
            centres = se2.compose(before, motion)[:, :2]
            store.cover(centres.min(axis=0) - reach, centres.max(axis=0) + reach)
            few = spaced(points, scan.T_base_laser, SPACING_M, config.beams_filter, self._few)
            poses, gain, results = np.empty((n, 3)), np.empty(n), np.zeros((n, RESULT_SIZE))
            place = (store.pool, store.tables, store.row0, store.col0, store.resolution_m, self._few[:few])
            cov = self._motion_cov(motion, self._blind_m)
            self._parallel(
                lambda first, last: propose(
                    *place, before, motion, cov, noise, config.sigma_m, config.evidence_beams, COS, SIN, first, last,
                    poses, gain, results,
                )
            )  # fmt: skip
            clock.lap("match")
            self._log_weights += gain
            self._log_weights -= self._log_weights.max()
            if self._log_weights[self.best] < -LOYALTY:
                self.best = int(np.argmax(self._log_weights))
            self._judge(results, step)
        self._poses[:, self._keys] = poses
        self._arrival.add((*motion, self._way, *self._blind_m))
        self._keys += 1
        self._T_key_base, self._way, self._key_stamp_ns = np.zeros(3), 0.0, scan.stamp_ns
        self._blind_m = np.zeros(2)
        weights = normalised(self._log_weights)
        self._neff = effective(weights)
        self.stats.processed += 1
        self.stats.neff_min = min(self.stats.neff_min, self._neff)
        if self._neff < config.neff_fraction * n:
            self._resample(weights)
            resampled = True
        clock.lap("resample")
        self._insert(scan, points)
        clock.lap("map update")
        self._loops.add_key(points, scan.T_base_laser[:2].copy(), float(self._arrival.rows[-1, 3]))
        if config.close_loops:
            self._close_loops()
            clock.lap("loops")
        return resampled

    def _close_loops(self) -> None:
        """Where the best particle comes to a place it has been, see whether its trajectory agrees; relax it if not."""
        poses = self._poses[self.best, : self._keys]
        if not self._loops.look(poses):
            return
        relaxed = self._loops.relaxed(poses, self._chain_cov())
        if np.hypot(*(relaxed - poses)[:, :2].T).max() < MOVED_M:
            return
        self.stats.loops_closed += 1
        self._adopt(relaxed)

    def _chain_cov(self) -> NDArray[np.float64]:
        """Return ``(K, 3, 3)`` covariances of the motion to each keyframe."""
        return np.stack([self._motion_cov(row[:3], row[4:6]) for row in self._arrival.rows])

    def _adopt(self, poses: Transform) -> None:
        """Let all particles go on from this trajectory and the map it makes: a loop's closing leaves one history."""
        store, reach = self._store, self.config.usable_range_m + 2.0
        store.cover(poses[:, :2].min(axis=0) - reach, poses[:, :2].max(axis=0) + reach)
        for i in range(self.config.particles):
            store.clear(i)
        ends = np.empty((0, 2))
        for k in range(self._keys):
            points = self._loops.scans[k].astype(np.float64)
            origin = self._loops.origins[k]
            store.own(0, origin, poses[k], points, ends, True)
            store.insert(0, origin, poses[k], points, ends, SKIP_M)
        store.resample(np.zeros(self.config.particles, dtype=np.int64))
        self._poses[:, : self._keys] = poses
        self._log_weights[:] = 0.0

    def _motion_cov(self, motion: Transform, blind_m: NDArray[np.float64]) -> NDArray[np.float64]:
        config, length, turn = self.config, float(np.hypot(motion[0], motion[1])), abs(float(motion[2]))
        sigma_xy = 0.01 + config.srr * length + config.str * turn
        sigma_t = 0.0015 + config.srt * length + config.stt * turn
        cov = np.diag([sigma_xy**2, sigma_xy**2, sigma_t**2])
        cov[:2, :2] += np.outer(blind_m, blind_m)
        return cov

    def _judge(self, results: NDArray[np.float64], step: Step) -> None:
        """Follow how well the best particle's map foretells the scans, and how much way was covered unseen."""
        best = results[self.best]
        seen = best[INLIERS] + best[CONFLICTS]
        now = best[INLIERS] / seen if seen > 0.2 else step.inliers
        fit = float(np.clip((now - 0.3) / 0.5, 0.0, 1.0))
        lost = math.hypot(self._blind_m[0], self._blind_m[1]) / max(self._way, 1e-9)
        self._health += HEALTH_MEMORY * (fit * (1.0 - min(2.0 * lost, 1.0)) - self._health)

    def _resample(self, weights: NDArray[np.float64]) -> None:
        parents = systematic(weights, float(self._rng.random()))
        heir = int(np.argmax(np.where(parents == self.best, 1.0, weights[parents])))
        self._poses[:, : self._keys] = self._poses[parents, : self._keys]
        self._store.resample(parents)
        self._log_weights[:] = 0.0
        self.best = heir
        self.stats.resamplings += 1

    def _insert(self, scan: Scan, points: NDArray[np.float64]) -> None:
        store, config = self._store, self.config
        poses = np.ascontiguousarray(self._poses[:, self._keys - 1])
        ends = self._clearing_ends(scan)
        origin = scan.T_base_laser[:2].copy()
        for i in range(config.particles):
            store.own(i, origin, poses[i], points, ends, True)
        place = (store.pool, store.refs, store.tables, store.row0, store.col0, store.resolution_m, origin, poses)
        self._parallel(lambda first, last: insert_range(*place, points, ends, SKIP_M, first, last))

    def _clearing_ends(self, scan: Scan) -> NDArray[np.float64]:
        """Return where beams without a return end, in the base frame, if they are to clear the map."""
        reach = min(self.config.clear_range_m, self.config.usable_range_m)
        if reach <= 0.0:
            return np.empty((0, 2))
        none = np.isinf(scan.ranges_m)
        ends = reach * np.stack([self._cos[none], self._sin[none]], axis=-1)
        return se2.apply(scan.T_base_laser, ends)

    def _parallel(self, job: Callable[[int, int], None]) -> None:
        n = self.config.particles
        if self._pool is None:
            job(0, n)
            return
        parts = self._pool._max_workers
        bounds = [n * k // parts for k in range(parts + 1)]
        list(self._pool.map(job, bounds[:-1], bounds[1:]))

    def skip_revisions(self, count: int) -> None:
        """Leave out map revisions: a mapper resumed from disk may have published some that it does not remember."""
        self._publisher.revision += count

    # -- on disk -------------------------------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed mapper needs, as numbers, text, arrays, lists and dicts of them."""
        stats = self.stats
        return {
            "store": self._store.state(), "front": self._front.state(), "publisher": self._publisher.state(),
            "loops": self._loops.state(), "rng": self._rng.bit_generator.state, "log_weights": self._log_weights,
            "poses": self._poses[:, : self._keys], "best": self.best, "neff": self._neff, "health": self._health,
            "arrival": self._arrival.rows, "scan_place": self._scan_place.rows, "scan_motion": self._scan_motion.rows,
            "online": self._online.rows, "T_key_base": self._T_key_base, "way": self._way, "blind_m": self._blind_m,
            "T_out": self._T_out,
            "key_stamp_ns": self._key_stamp_ns, "T_odom_base": self._T_odom_base, "stamp_ns": self._stamp_ns,
            "ranges": self._ranges,
            "stats": [stats.scans, stats.dropped, stats.processed, stats.resamplings, stats.loops_closed],
            "neff_min": float(stats.neff_min),
        }  # fmt: skip

    def restore(self, state: dict[str, Any]) -> None:
        """Become the mapper whose :meth:`state` this is; the configuration must be the same."""
        self._store.restore(state["store"])
        self._front.restore(state["front"])
        self._publisher.restore(state["publisher"])
        self._loops.restore(state["loops"])
        self._rng.bit_generator.state = state["rng"]
        self._log_weights = state["log_weights"]
        poses = state["poses"]
        self._keys = poses.shape[1]
        self._poses = np.concatenate([poses, np.zeros((poses.shape[0], max(64, self._keys), 3))], axis=1)
        self.best, self._neff, self._health = state["best"], state["neff"], state["health"]
        self._arrival, self._scan_place = Rows.of(state["arrival"]), Rows.of(state["scan_place"])
        self._scan_motion, self._online = Rows.of(state["scan_motion"]), Rows.of(state["online"])
        self._T_key_base, self._way, self._key_stamp_ns = state["T_key_base"], state["way"], state["key_stamp_ns"]
        self._T_out, self._blind_m = state["T_out"], state["blind_m"]
        self._T_odom_base, self._stamp_ns, self._ranges = state["T_odom_base"], state["stamp_ns"], state["ranges"]
        stats = self.stats
        stats.scans, stats.dropped, stats.processed, stats.resamplings, stats.loops_closed = state["stats"]
        stats.neff_min = state["neff_min"]


class _Clock:
    """CPU seconds by stage."""

    def __init__(self, laps: dict[str, float]) -> None:
        self.laps, self.since = laps, time.process_time()

    def lap(self, stage: str) -> None:
        now = time.process_time()
        self.laps[stage] = self.laps.get(stage, 0.0) + now - self.since
        self.since = now


def _pool(threads: int, particles: int) -> ThreadPoolExecutor | None:
    threads = min(threads or len(os.sched_getaffinity(0)), particles)
    return ThreadPoolExecutor(threads, thread_name_prefix="rbpf") if threads > 1 else None
