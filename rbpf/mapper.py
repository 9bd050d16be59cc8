"""One robot's mapper: a Rao-Blackwellised particle filter behind a dense local matcher.

The front end matches every scan to a rolling map of the last few metres. Every half metre or so a scan becomes a
keyframe: the back end moves the particles there, draws their maps and closes loops. It works on another thread where
there is one, while the front end matches the next scans; its result is collected at the next keyframe, or after
``SETTLE_SCANS`` scans if that comes first. That is fixed by counting scans, with one thread as with many, so results
depend on neither the number of threads nor their speed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.filter.back_end import BackEnd, KeyframeResult
from mrslam.rbpf.filter.history import History
from mrslam.rbpf.filter.publisher import Publisher
from mrslam.rbpf.front_end.after_pause import after_pause, has_driven_unseen
from mrslam.rbpf.front_end.front_end import FrontEnd, Step
from mrslam.rbpf.front_end.health import ADRIFT_MOST, DOUBTFUL, LOST
from mrslam.rbpf.front_end.intake import Intake, Reading
from mrslam.rbpf.front_end.motion import MOTION, Keyframe, LocalMotion, composed_cov, motion_cov
from mrslam.rbpf.front_end.reported_pose import ReportedPose
from mrslam.rbpf.outcome import Stats, Stopwatch, UpdateInfo
from mrslam.spatial import InputError, Keyframes, LocalMap, Scan, se2
from mrslam.spatial.poses import compose
from mrslam.spatial.runtime.crew import Crew, Pending
from mrslam.spatial.se2 import Transform

LAYOUT = 28
"""Version of what :meth:`Mapper.state` returns; raised whenever its content changes."""
STALE = "after a pause it fits nothing where odometry leads"
"""Why the first scan after a pause may be left out: drivers that stood still deliver old odometry with a new scan."""
SETTLE_SCANS = 10
"""The back end's result is collected after this many scans at the latest: a robot that stopped gets it, too."""


class Mapper:
    """Maps with one robot's laser; the map's frame is the robot's pose at its first scan."""

    def __init__(
        self, config: MapperConfig | None = None, seed: int = 0, clock: Callable[[], float] | None = None
    ) -> None:
        """Start with an empty map; ``clock``, such as ``time.thread_time``, measures how long each stage takes."""
        self.config = config or MapperConfig()
        self.seed = seed
        self.stats = Stats()
        self.stopwatch = Stopwatch(clock)
        self._crew = Crew(self.config.threads)
        self._front = FrontEnd(self.config, self._crew)
        self._intake = Intake(self.config, self._front)
        self._motion = LocalMotion()
        self._dead_reckoned = se2.IDENTITY  # by odometry, since the newest scan that was used
        self._busy_back = BackEnd(self.config, seed, self._crew, Stopwatch(clock, self.stopwatch.seconds))
        self._pending: Pending[KeyframeResult] | None = None  # of the newest keyframe, until it is collected
        self._settle_in = 0  # scans until it is collected at the latest
        self._reported = ReportedPose()
        self._neff, self._health, self._is_lost = 1.0, 1.0, False
        self._history = History()
        self._publisher = Publisher()

    def update(self, scan: Scan, T_odom_base: Transform | None) -> UpdateInfo:
        """Take one scan, and odometry ``(3,)`` at its time; bad data is dropped and counted, never raised."""
        watch = self.stopwatch
        watch.start()
        self.stats.scans += 1
        reading = self._intake.take(scan, T_odom_base)
        if reading.reason is not None:
            return self._drop(reading)
        watch.lap("points")
        if reading.waits:
            return self._carry_on(reading)
        reading = self._after_pause(reading)
        if reading.reason is not None:
            return self._drop(reading)
        self._dead_reckoned = se2.IDENTITY
        step = self._step(reading)
        self._motion.add(step)
        self._intake.matched(reading, self._front.T_local_base)
        watch.lap("front end")
        is_due = self._motion.is_due(self.config, scan.stamp_ns)
        is_key = self._history.keys == 0 or is_due or reading.is_unconfirmed
        self._settle_in -= 1
        resampled = self._settle() if is_key or self._settle_in == 0 else False
        if is_key:
            self._begin_key(reading, step.inliers)
        if step.is_carried or reading.is_unconfirmed:
            self._health, self._is_lost = min(self._health, LOST), True
        watch.start()  # the back end has a watch of its own
        self._history.add_scan(scan.stamp_ns, self._T_key_base, self._motion.way_m, self.T_map_base)
        watch.lap("record")
        return UpdateInfo(
            processed=is_key, T_map_base=self.T_map_base, neff=self._neff, resampled=resampled,
            match_score=step.inliers, health=self.health, is_lost=self._is_lost, dropped_beams=reading.dropped_beams,
        )  # fmt: skip

    def _step(self, reading: Reading) -> Step:
        """Return the motion to a reading."""
        origin = reading.scan.T_base_laser[:2]
        if reading.is_carried:
            return self._front.put_down(reading.points, reading.elapsed_s, origin)
        return self._front.step(
            reading.sample, reading.points, reading.odom_motion, reading.elapsed_s, origin, shown=reading.shown
        )

    def _after_pause(self, reading: Reading) -> Reading:
        """Return the first reading after a pause with the motion that the map shows.

        Where the map contradicts the wheels, the first one is refused, and the next one is doubted.
        """
        predictor = self._front.predictor
        if not has_driven_unseen(reading, predictor):
            return reading
        particles = self._back.filter
        T_map_before = compose(particles.ends[particles.best], self._motion.T_key_base)
        moved = predictor.dead_reckoned(reading.odom_motion, reading.elapsed_s)
        tiles = particles.store.tiles(particles.best)
        usual_fit, sigma_m = self._back.usual_fit, self.config.sigma_m
        reading = after_pause(reading, moved, T_map_before, tiles, sigma_m, self._crew, usual_fit=usual_fit)
        if reading.is_contradicted and self._intake.put_back():  # until the next scan the robot is where it was
            return replace(reading, reason=STALE, odom_motion=None)
        return reading

    def _drop(self, reading: Reading) -> UpdateInfo:
        """Count a scan that is of no use; odometry carries the pose on."""
        self.stats.dropped += 1
        self._dead_reckoned = self._front.predictor.dead_reckoned(reading.odom_motion, reading.elapsed_s)
        # It was some way off when the pause began, and the map says only that it is not where the wheels have it.
        health = min(self.health, LOST) if reading.reason == STALE else self.health
        return UpdateInfo(
            processed=False, T_map_base=self.T_map_base, neff=self._neff, health=health,
            dropped_beams=reading.dropped_beams, reason=reading.reason,
        )  # fmt: skip

    def _carry_on(self, reading: Reading) -> UpdateInfo:
        """Let odometry carry the pose to a scan that is matched together with the next ones."""
        self._dead_reckoned = self._front.predictor.dead_reckoned(reading.odom_motion, reading.elapsed_s)
        self._history.add_scan(reading.scan.stamp_ns, self._T_key_base, self._motion.way_m, self.T_map_base)
        self.stopwatch.lap("record")
        return UpdateInfo(
            processed=False, T_map_base=self.T_map_base, neff=self._neff, health=self.health,
            dropped_beams=reading.dropped_beams,
        )  # fmt: skip

    def _settle(self) -> bool:
        """Collect the back end's result on the newest keyframe, and return whether particles were resampled."""
        if self._pending is None:
            return False
        result, self._pending = self._pending.result(), None
        self._reported.follow(result.T_map_key)
        self._neff, self._health, self._is_lost = result.neff, result.health, result.is_lost
        self.stats.resamplings += result.resampled
        self.stats.loops_closed += result.loop_closed
        self.stats.neff_min = min(self.stats.neff_min, result.neff)
        return result.resampled

    def _begin_key(self, reading: Reading, inliers: float) -> None:
        """Make a keyframe of a scan, and let the back end begin with it."""
        back, stamp_ns = self._back, reading.scan.stamp_ns
        key = Keyframe(
            beams=self._intake.beams(reading), arrival=self._motion.restart(stamp_ns), inliers=inliers,
            is_unconfirmed=reading.is_unconfirmed,
        )  # fmt: skip
        self._reported.begin_key(key.arrival[MOTION])
        is_kept = self._history.add_key(
            stamp_ns, key.beams, back.filter.trajectory, self.T_map_base, is_sure=self.health > DOUBTFUL
        )
        self.stats.seen_before += not is_kept
        self._pending = self._crew.begin(lambda: back.add(key))
        self._settle_in = SETTLE_SCANS
        self.stats.processed += 1

    @property
    def _back(self) -> BackEnd:
        """The back end, once it has finished the newest keyframe."""
        if self._pending is not None:
            self._pending.result()
        return self._busy_back

    @property
    def T_map_base(self) -> Transform:
        """``(3,)``, the best pose known now; while scans are of no use odometry carries it on."""
        return self._reported.at(self._T_key_base)

    @property
    def _T_key_base(self) -> Transform:
        return compose(self._motion.T_key_base, self._dead_reckoned)

    @property
    def particles(self) -> Transform:
        """``(N, 3)``, where each particle has the robot now; one where all of the way was seen."""
        particles = self._back.filter
        if self._history.keys == 0:
            return np.zeros((particles.count, 3))
        return se2.compose(particles.ends, self._T_key_base)

    @property
    def is_settled(self) -> bool:
        """Whether the back end has done with the newest keyframe: what it holds, as the covariance, costs no wait."""
        return self._pending is None or self._pending.is_done

    @property
    def covariance(self) -> NDArray[np.float64]:
        """``(3, 3)`` of the pose in the map, m^2 and rad^2, where the first pose is certain.

        It adds up how far off the map is here by the keyframes' motion and matches, loops and straight walls; the
        particles' spread; and what the newest match leaves open, or the motion since where there is none.
        """
        if self._history.keys == 0:
            return np.zeros((3, 3))
        pose, particles = self.T_map_base, self.particles
        error = particles - pose
        error[:, 2] = se2.wrap(error[:, 2])
        over_particles = np.einsum("i,ij,ik->jk", self._back.filter.weights, error, error)
        own = np.linalg.inv(motion_cov(self.config, self._T_key_base, self._motion.blind_m))
        if not self._dead_reckoned.any():  # scans since see what the keyframe saw
            own += self._back.matched[-1]
        return over_particles + composed_cov(pose, self._T_key_base, self._back.covariance, np.linalg.inv(own))

    @property
    def neff(self) -> float:
        """Effective number of particles."""
        return self._neff

    @property
    def health(self) -> float:
        """0..1; below 0.5 the pose is doubtful."""
        return min(self._health, DOUBTFUL) if self._front.adrift > ADRIFT_MOST else self._health

    def trajectory(self) -> Keyframes:
        """Return the pose of every accepted scan, in the order fed, as the best particle has it now."""
        return self._history.trajectory(self._back)

    def online_trajectory(self) -> Keyframes:
        """Return the pose of every accepted scan as it was known when the scan came."""
        return self._history.online_trajectory()

    def snapshot(self) -> LocalMap:
        """Return the best particle's map as tiles with revisions, and its keyframes with their scans."""
        back = self._back
        keyframes = self._history.keyframes(back)
        tiles = self._publisher.publish(back.filter.store, back.filter.best, keyframes.stamps_ns.size)
        return LocalMap(tiles, keyframes, self._history.key_scans)

    def use_particles(self, count: int) -> None:
        """Continue with at most this number of particles: there are as many where the way was not seen, else one.

        Raises ``InputError`` where there cannot be as many.
        """
        replace(self.config, particles=count)  # checks it
        self._back.use_particles(count)

    @property
    def particles_most(self) -> int:
        """Most particles there may be now."""
        return self._back.particles_most

    def skip_revisions(self, count: int) -> None:
        """Leave out map revisions: a mapper resumed from disk may have published some that it does not remember."""
        self._publisher.revision += count

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed mapper needs, as numbers, text, arrays, lists and dicts of them."""
        return {
            "layout": LAYOUT, "front": self._front.state(), "intake": self._intake.state(),
            "motion": self._motion.state(), "dead_reckoned": self._dead_reckoned, "back": self._back.state(),
            "result": None if self._pending is None else self._pending.result().state(),
            "settle_in": self._settle_in, "T_map_key": self._reported.T_map_key, "neff": self._neff,
            "health": self._health, "is_lost": self._is_lost, "history": self._history.state(),
            "publisher": self._publisher.state(), "stats": dict(vars(self.stats)),
        }  # fmt: skip

    def restore(self, state: dict[str, Any]) -> None:
        """Become the mapper whose :meth:`state` this is; the configuration must be the same.

        Raises ``InputError`` where it was written by a mapper with another layout.
        """
        if state.get("layout", 1) != LAYOUT:
            raise InputError(f"the mapper's state has layout {state.get('layout', 1)}, this program reads {LAYOUT}")
        self._front.restore(state["front"])
        self._intake.restore(state["intake"])
        self._motion.restore(state["motion"])
        self._dead_reckoned = state["dead_reckoned"]
        self._pending = None if state["result"] is None else Pending.done(KeyframeResult(**state["result"]))
        self._busy_back.restore(state["back"])
        self._settle_in, self._reported.T_map_key = state["settle_in"], state["T_map_key"]
        self._neff, self._health, self._is_lost = state["neff"], state["health"], state["is_lost"]
        self._history = History.of(state["history"])
        self._publisher.restore(state["publisher"])
        self.stats = Stats(**state["stats"])
