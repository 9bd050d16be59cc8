"""A robot's pose in a saved map: scans are matched to the map as the mapper matches them to the last few metres.

No particles, no drawing, no loops: odometry carries the pose from one matched scan to the next.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.front_end.after_pause import after_pause, came_to, has_driven_unseen
from mrslam.rbpf.front_end.front_end import FrontEnd, Step
from mrslam.rbpf.front_end.intake import Intake, Reading
from mrslam.rbpf.front_end.local_matcher import (
    BETTER,
    FAR_STEP_RAD,
    GOOD_INLIERS,
    ITERATIONS,
    NEAR_M,
    POINTS_SEARCHED,
    STEP_M,
)
from mrslam.rbpf.front_end.look_around import SHOWN_LEAST, found_near
from mrslam.rbpf.front_end.motion import TURN_WAY_M, composed_cov, motion_cov
from mrslam.rbpf.front_end.prediction import DISBELIEVED, can_move
from mrslam.rbpf.front_end.rolling_map import SCAN_DISTANCE_M
from mrslam.rbpf.localise.fit import Fit
from mrslam.rbpf.localise.fixed_map import FixedMap
from mrslam.rbpf.localise.tracking_matcher import TrackingMatcher
from mrslam.rbpf.localise.wheels import WheelsCheck
from mrslam.rbpf.outcome import Stats, UpdateInfo
from mrslam.spatial import Scan
from mrslam.spatial.matching.correlative import Lattice, search
from mrslam.spatial.matching.gauss_newton import Match, match
from mrslam.spatial.poses import between, compose
from mrslam.spatial.se2 import Transform

WAIT_S = 1.0
"""A scan is matched after this time at the latest, seconds: less than a pause (2 s), after which nobody knows how the
robot moved."""
TURN_RAD = 0.03
"""A scan is matched after this turn by odometry, radians: wheels that slip in turns are off by a share of it."""
START_M, START_RAD = 0.4, 0.25
"""Half width of the search where tracking begins, metres and radians: maps are aligned to 0.3 m, 5 degrees."""
SIGMAS, REACH_MOST_M = 3.0, 2.0
"""Where a pose has become unsure along a corridor, it is searched for within this many deviations, and this far."""
FIT_LEAST = 0.6
"""Least share of beams on known floor that must end at walls where tracking begins."""


class Localiser:
    """Tracks one robot in a map that does not change."""

    def __init__(self, fixed: FixedMap, config: MapperConfig) -> None:
        """Take the map; the pose comes with :meth:`begin`."""
        self.config = config
        self._map = fixed
        self._front = FrontEnd(config, map_=fixed, matcher=TrackingMatcher(config.sigma_m))
        self._intake = Intake(config, self._front)
        self.fit = Fit()
        """How well the map shows what the robot sees."""
        self._wheels = WheelsCheck()
        self.is_carried = False
        """Whether the robot was carried off: it saw nothing for a while, and then another place."""
        self.stats = Stats()
        self._since = np.zeros(3)  # by odometry, since the newest scan that was matched
        self._covariance = np.diag([START_M**2, START_M**2, START_RAD**2]) / SIGMAS**2
        self._T_odom_base: Transform | None = None  # at the newest scan that was matched
        self._T_newest: Transform | None = None  # at the newest scan of all
        self._stamp_ns: int | None = None

    @property
    def T_map_base(self) -> Transform:
        """``(3,)``: the robot's pose in the saved map's frame, metres and radians."""
        return compose(self._front.T_local_base, self._since)

    @property
    def T_odom_base(self) -> Transform | None:
        """``(3,)``: the newest odometry that belongs to the pose; None where there is none."""
        return self._T_newest

    @property
    def inliers(self) -> float:
        """Share of beams of the newest scan matched that end at the map's walls, 0..1."""
        return 0.0 if self._front.newest is None else self._front.newest.inliers

    @property
    def covariance(self) -> NDArray[np.float64]:
        """``(3, 3)`` of the pose in the saved map, m^2 and rad^2; the map's own errors are not in it."""
        cell = self._map.resolution_m**2 / 12.0  # a wall is known to a cell
        walls = np.diag([cell, cell, 0.0])
        motion = motion_cov(self.config, self._since, np.zeros(2)) if self._since.any() else np.zeros((3, 3))
        return composed_cov(self.T_map_base, self._since, self._covariance + walls, motion)

    def begin(
        self, scan: Scan, T_odom_base: Transform | None, T_map_base: Transform, *, has_driven: bool = False
    ) -> bool:
        """Begin at about ``T_map_base (3,)``, where a scan was taken; return whether it fits the map there.

        ``has_driven`` : whether the robot saw nothing on its way there: as after a pause, it must surely be there, or
        near by and nowhere else.
        """
        reading = self._intake.take(scan, T_odom_base)
        if reading.reason is not None or reading.waits:
            return False
        self._front.T_local_base = np.array(T_map_base, dtype=np.float64)
        found = self._found_near(reading.sample) if has_driven else self._search(reading.sample, START_RAD, START_M)
        if found is None:
            return False
        shown = found.inliers + found.conflicts
        if shown < SHOWN_LEAST or found.inliers < FIT_LEAST * shown:
            return False
        self._front.T_local_base, self._front.newest = found.pose, found
        self._settle(found.information, len(reading.sample))
        self._note(reading)
        self._T_newest = self._T_odom_base
        return True

    def update(self, scan: Scan, T_odom_base: Transform | None) -> UpdateInfo:
        """Take one scan, and odometry ``(3,)`` at its time: match it if the robot has moved or a second has passed."""
        self.stats.scans += 1
        moved = self._moved(T_odom_base)
        self._T_newest = T_odom_base if moved is not None else self._T_newest
        if moved is not None and not self._is_due(moved, scan):
            self._since = self._front.predictor.dead_reckoned(moved)
            return self._info(processed=False)
        reading = self._intake.take(scan, T_odom_base)
        if reading.reason is not None or reading.waits:
            self.stats.dropped += reading.reason is not None
            self._since = self._front.predictor.dead_reckoned(reading.odom_motion, reading.elapsed_s)
            return self._info(processed=False, reason=reading.reason)
        self._match(reading)
        return self._info(processed=True)

    def _moved(self, T_odom_base: Transform | None) -> Transform | None:
        """Return the motion ``(3,)`` that odometry has since the newest match; None where it says nothing."""
        if T_odom_base is None or self._T_odom_base is None or not self.config.use_odometry:
            return None
        moved = between(self._T_odom_base, T_odom_base)
        return moved if np.isfinite(moved).all() else None

    def _is_due(self, moved: Transform, scan: Scan) -> bool:
        odometry = self._front.predictor.odometry
        waited_s = 0.0 if self._stamp_ns is None else abs(scan.stamp_ns - self._stamp_ns) / 1e9
        return (
            math.hypot(moved[0], moved[1]) > SCAN_DISTANCE_M
            or abs(moved[2]) > TURN_RAD
            or waited_s >= WAIT_S
            or odometry.is_dead
            or odometry.slip > DISBELIEVED
            or self._intake.is_sparse
        )

    def _match(self, reading: Reading) -> None:
        """Match a scan to the map, and learn how sure the pose is and how well the map shows it."""
        self._since = np.zeros(3)
        reading, before = self._after_pause(reading), self._front.T_local_base
        origin, shown = reading.scan.T_base_laser[:2], reading.shown
        step = self._front.step(
            reading.sample, reading.points, reading.odom_motion, reading.elapsed_s, origin, shown=shown
        )
        self.is_carried |= step.is_carried or reading.is_carried
        if shown is not None:
            self._front.newest = self._settled_at(compose(before, shown), reading.sample)
        elif not can_move(step.T_before_base, max(reading.elapsed_s, 0.0)):  # wheels leapt, or caught up with the robot
            place = found_near(self._map.tiles_around(before), reading.sample, before, self.config.sigma_m)
            if place is not None:
                self._front.newest = self._settled_at(place, reading.sample)
        found = self._front.newest
        if found is not None:
            self._predict(step)
            found = self._look_farther(reading.sample, found)
            self._settle(found.information, len(reading.sample))
            way_m = math.hypot(*step.T_before_base[:2]) + TURN_WAY_M * abs(float(step.T_before_base[2]))
            self.fit.follow(found.inliers, found.conflicts, way_m, reading.elapsed_s)
            matched = between(before, self._front.T_local_base)
            if self._wheels.follow(matched, reading.odom_motion, reading.elapsed_s, found, self._front.predictor):
                self.fit.contradict()
        self._note(reading)

    def _after_pause(self, reading: Reading) -> Reading:
        """Return the first reading after a pause with the motion that the map shows: wheels may have leapt in it."""
        predictor, before = self._front.predictor, self._front.T_local_base
        if not has_driven_unseen(reading, predictor):
            return reading
        moved, tiles = predictor.dead_reckoned(reading.odom_motion, reading.elapsed_s), self._map.tiles_around(before)
        if reading.is_set_back:
            return after_pause(reading, moved, before, tiles, self.config.sigma_m)
        place = found_near(tiles, reading.sample, compose(before, moved), self.config.sigma_m)
        return reading if place is None else came_to(place, before, reading)

    def _note(self, reading: Reading) -> None:
        self._T_odom_base, self._stamp_ns = self._intake.T_odom_base, reading.scan.stamp_ns
        self.stats.processed += 1

    def _look_farther(self, points: NDArray[np.float64], found: Match) -> Match:
        """Return the match, or a better one as far off as the pose may be, where it has become unsure on its way."""
        reach_m = min(SIGMAS * math.sqrt(float(np.linalg.eigvalsh(self._covariance[:2, :2])[-1])), REACH_MOST_M)
        if reach_m <= NEAR_M or found.inliers >= GOOD_INLIERS:
            return found
        reach_rad = min(SIGMAS * math.sqrt(float(self._covariance[2, 2])), START_RAD)
        other = self._search(points, reach_rad, reach_m)
        if other.score <= found.score + BETTER:
            return found
        self._front.T_local_base = other.pose
        return other

    def _search(self, points: NDArray[np.float64], half_turn_rad: float, half_shift_m: float) -> Match:
        """Return the best match of ``points (N, 5)`` around the pose."""
        start, tiles = self._front.T_local_base, self._map.tiles_around(self._front.T_local_base)
        lattice = Lattice(half_turn_rad, FAR_STEP_RAD, half_shift_m, STEP_M, POINTS_SEARCHED)
        return self._at(search(tiles, points, start, lattice).pose, points)

    def _found_near(self, points: NDArray[np.float64]) -> Match | None:
        """Return the match at the place near the pose where ``points (N, 5)`` surely fit; None without one."""
        start = self._front.T_local_base
        place = found_near(self._map.tiles_around(start), points, start, self.config.sigma_m)
        return None if place is None else self._at(place, points)

    def _at(self, place: Transform, points: NDArray[np.float64]) -> Match:
        """Return how ``points (N, 5)`` fit next to a place ``(3,)``."""
        tiles = self._map.tiles_around(place)
        return match(tiles, points, place, place, np.zeros((3, 3)), self.config.sigma_m, ITERATIONS)

    def _settled_at(self, place: Transform, points: NDArray[np.float64]) -> Match:
        """Take a place ``(3,)`` for the robot's, and return how ``points (N, 5)`` fit there."""
        found = self._at(place, points)
        self._front.T_local_base = found.pose
        return found

    def _predict(self, step: Step) -> None:
        """Let the covariance grow by the motion."""
        motion = motion_cov(self.config, step.T_before_base, step.blind_m)
        self._covariance = composed_cov(self._front.T_local_base, step.T_before_base, self._covariance, motion)

    def _settle(self, information: NDArray[np.float64], beams: int) -> None:
        """Let it shrink by what the scan says, ``(3, 3)``; beams err alike, and count as ``evidence_beams``."""
        share = min(self.config.evidence_beams / max(beams, 1), 1.0)
        self._covariance = np.asarray(np.linalg.inv(np.linalg.inv(self._covariance) + share * information), np.float64)

    def _info(self, *, processed: bool, reason: str | None = None) -> UpdateInfo:
        return UpdateInfo(
            processed=processed, T_map_base=self.T_map_base, neff=1.0, health=self.fit.value, reason=reason,
            match_score=self.inliers,
        )  # fmt: skip
