"""One robot's mapper: a Rao-Blackwellised particle filter behind a dense local matcher.

Every scan is matched to the last few metres (front end); every half metre or so one of them becomes a keyframe, which
the particles take (back end). The front end never waits for the particles: they work beside it, on another thread if
there is one, and what they find is told at the next keyframe, or a few scans later if that comes first. It is so with
any number of threads, and however fast they are; so results do not depend on them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.crew import Crew, Pending
from mrslam.rbpf.filter.back_end import BackEnd, Verdict
from mrslam.rbpf.filter.key_scan_log import KeyScanLog
from mrslam.rbpf.filter.scan_log import ScanLog
from mrslam.rbpf.filter.trajectory import spread
from mrslam.rbpf.front_end.front_end import FrontEnd
from mrslam.rbpf.front_end.health import ADRIFT_MOST, DOUBTFUL
from mrslam.rbpf.front_end.motion import MOTION, Keyframe, Since, motion_cov
from mrslam.rbpf.front_end.reported_pose import ToldPose
from mrslam.rbpf.front_end.scan_gate import ScanGate
from mrslam.rbpf.match.sight import Sight
from mrslam.rbpf.outcome import Stats, Stopwatch, UpdateInfo
from mrslam.rbpf.rows import Rows
from mrslam.rbpf.tiles.publisher import Publisher
from mrslam.rbpf.tiles.views import Beams
from mrslam.spatial import InputError, Keyframes, LocalMap, Scan, se2
from mrslam.spatial.poses import between, compose
from mrslam.spatial.se2 import Transform

LAYOUT = 14
"""Of :meth:`Mapper.state`; raised whenever its content changes."""
SETTLE_SCANS = 10
"""What the particles make of a keyframe is told after so many scans at the latest."""


class Mapper:
    """Maps with one robot's laser; the map's frame is the robot's pose at its first scan."""

    def __init__(
        self, config: MapperConfig | None = None, seed: int = 0, clock: Callable[[], float] | None = None
    ) -> None:
        """Start with an empty map; a ``clock`` such as ``time.thread_time`` is read to tell what each stage takes."""
        self.config = config or MapperConfig()
        self.seed = seed
        self.stats = Stats()
        self.stopwatch = Stopwatch(clock)
        self._gate = ScanGate()
        self._sight = Sight(self.config)
        self._crew = Crew(self.config.threads)
        self._front = FrontEnd(self.config, self._crew)
        self._since = Since()
        self._busy_back = BackEnd(self.config, seed, self._crew, Stopwatch(clock, self.stopwatch.seconds))
        self._verdict: Pending[Verdict] | None = None  # on the newest keyframe, until it is told
        self._patience = 0  # scans until then
        self._told = ToldPose()
        self._publisher = Publisher()
        self._log = ScanLog()
        self._key_stamps = Rows(1, np.int64)
        self._key_scans = KeyScanLog()
        self._neff, self._health = float(self.config.particles), 1.0
        self._T_odom_base: Transform | None = None
        self._stamp_ns: int | None = None  # with the odometry above, of the newest scan that was used
        self._carried = se2.IDENTITY  # how far the wheels say it went since

    # -- what it does --------------------------------------------------------------------------------------------------

    def update(self, scan: Scan, T_odom_base: Transform | None) -> UpdateInfo:
        """Take one scan, and what the wheels said when it was taken; bad data is dropped and counted, never raised."""
        watch = self.stopwatch
        watch.start()
        self.stats.scans += 1
        T_odom_base = self._sane(T_odom_base)
        T_before_odom = None
        if T_odom_base is not None and self._T_odom_base is not None:
            T_before_odom = between(self._T_odom_base, T_odom_base)
        points = self._sight.points(scan)
        dropped = scan.ranges_m.size - points.shape[0]
        reason = self._gate.refuse(scan, points, T_odom_base, lambda: self._knows(scan, points, T_before_odom))
        if reason is not None:
            return self._drop(reason, dropped, T_before_odom)
        elapsed_s = 0.0 if self._stamp_ns is None else (scan.stamp_ns - self._stamp_ns) / 1e9
        self._stamp_ns, self._T_odom_base, self._carried = scan.stamp_ns, T_odom_base, se2.IDENTITY
        if scan.beam_interval_s > 0.0:
            self._sight.straighten(points, scan, self._front.predictor.speed(T_before_odom, elapsed_s))
        few = self._sight.few(points, scan.T_base_laser)
        watch.lap("points")
        step = self._front.step(few, points, T_before_odom, elapsed_s)
        self._since.add(step)
        watch.lap("front end")
        due = self._keys == 0 or self._since.is_due(self.config, scan.stamp_ns)
        self._patience -= 1
        resampled = self._settle() if due or self._patience == 0 else False
        if due:
            self._hand_on(scan, points, step.inliers)
        watch.start()  # what the back end took is told by its own watch
        self._log.add(scan.stamp_ns, self._keys - 1, self._since, self.T_map_base)
        watch.lap("record")
        return UpdateInfo(
            processed=due, T_map_base=self.T_map_base, neff=self._neff, resampled=resampled, match_score=step.inliers,
            health=self.health, dropped_beams=dropped,
        )  # fmt: skip

    def _drop(self, reason: str, dropped: int, T_before_odom: Transform | None) -> UpdateInfo:
        self.stats.dropped += 1
        self._carried = self._front.predictor.dead_reckoned(T_before_odom)
        return UpdateInfo(
            processed=False, T_map_base=self.T_map_base, neff=self._neff, health=self.health,
            dropped_beams=dropped, reason=reason,
        )  # fmt: skip

    def _knows(self, scan: Scan, points: NDArray[np.float64], T_before_odom: Transform | None) -> bool:
        """Return whether a scan fits what was seen before."""
        return self._keys > 0 and self._front.knows(self._sight.few(points, scan.T_base_laser), T_before_odom)

    def _sane(self, T_odom_base: Transform | None) -> Transform | None:
        """Return what the wheels tell, if it makes sense and is wanted."""
        if T_odom_base is None or not self.config.use_odometry:
            return None
        now = np.array(T_odom_base, dtype=np.float64)
        return now if now.shape == (3,) and np.isfinite(now).all() else None

    def _settle(self) -> bool:
        """Tell what the particles made of the newest keyframe; return whether they were resampled."""
        if self._verdict is None:
            return False
        verdict, self._verdict = self._verdict.result(), None
        self._told.follow(verdict.T_map_key)
        self._neff, self._health = verdict.neff, verdict.health
        self.stats.resamplings += verdict.resampled
        self.stats.loops_closed += verdict.loop_closed
        self.stats.neff_min = min(self.stats.neff_min, verdict.neff)
        return verdict.resampled

    def _hand_on(self, scan: Scan, points: NDArray[np.float64], inliers: float) -> None:
        """Let the particles begin with this scan, while the next ones are matched."""
        back = self._back
        arrival = self._since.restart(scan.stamp_ns)
        key = Keyframe(
            beams=Beams(scan.T_base_laser[:2].copy(), points.copy(), self._sight.clearing_ends(scan)),
            arrival=arrival, inliers=inliers,
        )  # fmt: skip
        self._key_scans.add(key.beams.points, key.beams.origin)
        self._told.go_on(arrival[MOTION])
        self._verdict = self._crew.begin(lambda: back.take(key))
        self._key_stamps.add(scan.stamp_ns)
        self.stats.processed += 1
        self._patience = SETTLE_SCANS

    # -- what it knows -------------------------------------------------------------------------------------------------

    @property
    def _keys(self) -> int:
        """How many keyframes there are."""
        return self._key_stamps.size

    @property
    def _back(self) -> BackEnd:
        """The back end, once it has done what it was given."""
        if self._verdict is not None:
            self._verdict.result()
        return self._busy_back

    @property
    def T_map_base(self) -> Transform:
        """``(3,)``, the best pose known now; while scans are of no use the wheels tell how it goes on."""
        return self._told.at(self._T_key_base)

    @property
    def _T_key_base(self) -> Transform:
        return compose(self._since.T_key_base, self._carried)

    @property
    def particles(self) -> Transform:
        """``(N, 3)`` where each particle has the robot now."""
        if self._keys == 0:
            return np.zeros((self._back.filter.count, 3))
        return se2.compose(self._back.filter.ends, self._T_key_base)

    @property
    def covariance(self) -> NDArray[np.float64]:
        """``(3, 3)`` of the pose over the particles, and of the motion since the last update."""
        if self._keys == 0:
            return np.zeros((3, 3))
        error = self.particles - self.T_map_base
        error[:, 2] = se2.wrap(error[:, 2])
        spread_of_particles = np.einsum("i,ij,ik->jk", self._back.filter.weights, error, error)
        return spread_of_particles + motion_cov(self.config, self._T_key_base, self._since.blind_m)

    @property
    def neff(self) -> float:
        """Effective number of particles."""
        return self._neff

    @property
    def health(self) -> float:
        """0..1; below 0.5 the pose is doubtful."""
        return min(self._health, DOUBTFUL) if self._front.adrift > ADRIFT_MOST else self._health

    def trajectory(self) -> Keyframes:
        """Return the pose of every accepted scan, in the order fed, as the best particle remembers it now."""
        log, back = self._log.rows, self._back
        motion, way = log["T_key_base"].astype(np.float64), log["way_m"].astype(np.float64)
        return Keyframes(log["stamp_ns"].copy(), spread(back.smoothed(), log["key"], motion, way, back.arrivals))

    def online_trajectory(self) -> Keyframes:
        """Return the pose of every accepted scan as it was known when the scan came."""
        log = self._log.rows
        return Keyframes(log["stamp_ns"].copy(), log["T_online"].astype(np.float64))

    def snapshot(self) -> LocalMap:
        """Return the best particle's map as tiles with revisions, and its keyframes with their scans."""
        back = self._back
        particles = back.filter
        keyframes = Keyframes(self._key_stamps.rows[:, 0].copy(), back.T_map_key.copy())
        tiles = self._publisher.publish(particles.store, particles.best)
        return LocalMap(tiles, keyframes, self._key_scans.scans)

    def use_particles(self, count: int) -> None:
        """Go on with so many particles, drawn by their weights: fewer cost less, and close fewer loops.

        Raises ``InputError`` where there cannot be so many.
        """
        replace(self.config, particles=count)  # checks it
        if count != self._back.filter.count:
            self._back.filter.resize(count)

    def skip_revisions(self, count: int) -> None:
        """Leave out map revisions: a mapper resumed from disk may have published some that it does not remember."""
        self._publisher.revision += count

    # -- on disk -------------------------------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed mapper needs, as numbers, text, arrays, lists and dicts of them."""
        return {
            "layout": LAYOUT, "front": self._front.state(), "back": self._back.state(),
            "publisher": self._publisher.state(), "since": self._since.state(), "T_map_key": self._told.T_map_key,
            "neff": self._neff, "health": self._health, "log": self._log.state(), "stamp_ns": self._stamp_ns,
            "key_stamps": self._key_stamps.rows, "T_odom_base": self._T_odom_base, "carried": self._carried,
            "gate": self._gate.state(), "stats": dict(vars(self.stats)), "patience": self._patience,
            "verdict": None if self._verdict is None else self._verdict.result().state(),
            "key_scans": self._key_scans.state(),
        }  # fmt: skip

    def restore(self, state: dict[str, Any]) -> None:
        """Become the mapper whose :meth:`state` this is; the configuration must be the same.

        Raises ``InputError`` where it was written by a mapper with another layout.
        """
        if state.get("layout", 1) != LAYOUT:
            raise InputError(f"the mapper's state has layout {state.get('layout', 1)}, this program reads {LAYOUT}")
        self._front.restore(state["front"])
        self._verdict = None if state["verdict"] is None else Pending.done(Verdict(**state["verdict"]))
        self._busy_back.restore(state["back"])
        self._patience = state["patience"]
        self._publisher.restore(state["publisher"])
        self._since.restore(state["since"])
        self._told.T_map_key = state["T_map_key"]
        self._neff, self._health = state["neff"], state["health"]
        self._log, self._key_stamps = ScanLog.of(state["log"]), Rows.of(state["key_stamps"])
        self._key_scans = KeyScanLog.of(state["key_scans"])
        self._T_odom_base, self._stamp_ns, self._carried = state["T_odom_base"], state["stamp_ns"], state["carried"]
        self._gate.restore(state["gate"])
        self.stats = Stats(**state["stats"])
