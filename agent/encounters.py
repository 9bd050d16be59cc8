"""What the own scans say of teammates that report where they are: the moments kept, and the pairs they speak about."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mrslam.comms import TeammatePose
from mrslam.mutual_detection import Moment, MutualDetectionConfig, MutualFix, find_bodies, mutual_fix
from mrslam.mutual_detection.encounters import MOMENTS_MOST, MOST_HIDDEN_LLR, MOST_UNSEEN_LLR
from mrslam.spatial import Scan, se2
from mrslam.spatial.se2 import Transform

SCANS_MOST = 30
"""Scans kept until reports of teammates at these times arrive: three seconds of 10 Hz, longer than a beacon is late."""
TOGETHER_NS = 150_000_000
"""A scan and a report of one moment are no farther apart, nanoseconds: a report lies half a sweep from a scan of 10 Hz,
and is as late as it took to arrive. Robots drive 8 cm in it."""


STANDS_M, STANDS_NS, GONE_NS = 0.25, 4_000_000_000, 20_000_000_000
"""A body seen within this of one place for longer stands there, and is forgotten where it was not seen for so long:
metres, nanoseconds. Furniture would be reported all the time; of a robot that stands nothing new is learned."""


class Standing:
    """Tells bodies that stand from those that move or came just now."""

    def __init__(self) -> None:
        """Start without any."""
        self._places: list[tuple[NDArray[np.float64], int, int]] = []  # place, first seen (ns), last seen (ns)

    def are_new(self, places_m: NDArray[np.float64], now_ns: int) -> NDArray[np.bool_]:
        """Return ``(N,)`` which bodies at these places ``(N, 2)`` (map frame) do not stand.

        Asked for every scan while somebody is wanted; what stood before a longer break is new once more.
        """
        known = [one for one in self._places if now_ns - one[2] < GONE_NS]
        new = np.ones(len(places_m), dtype=np.bool_)
        for i, place in enumerate(places_m):
            near = next((k for k, one in enumerate(known) if np.hypot(*(one[0] - place)) <= STANDS_M), None)
            if near is None:
                known.append((place, now_ns, now_ns))
            else:
                new[i] = now_ns - known[near][1] < STANDS_NS
                known[near] = (known[near][0], known[near][1], now_ns)
        self._places = known
        return new


@dataclass(eq=False)
class _Seen:
    stamp_ns: int
    scan: Scan
    T_map_base: Transform
    radius_m: float
    reports: dict[str, tuple[int, Transform]] = field(default_factory=dict)
    """By teammate that said where it was then: the epoch of its map, and where it was in it."""

    @cached_property
    def bodies_m(self) -> NDArray[np.float64]:
        """Bodies in the scan, found once for all teammates."""
        return find_bodies(self.scan, self.radius_m)


class Encounters:
    """Keeps the last scans, and by teammate the moments at which it said where it was."""

    def __init__(self, config: MutualDetectionConfig) -> None:
        """Start without teammates."""
        self.radius_m = config.robot_radius_m
        self.most_unseen_llr = MOST_UNSEEN_LLR if config.teammates_visible else MOST_HIDDEN_LLR
        self._enabled = config.encounters
        self._scans: deque[_Seen] = deque(maxlen=SCANS_MOST)
        self._moments: dict[str, deque[Moment]] = {}
        self._epochs: dict[str, int] = {}
        self._standing = Standing()

    def on_scan(self, scan: Scan, T_map_base: Transform, now_ns: int) -> None:
        """Keep a scan, with the beams that end at teammates, and where the robot took it."""
        if self._enabled:
            self._scans.append(_Seen(now_ns, scan, T_map_base, self.radius_m))

    def moving_bodies_m(self) -> NDArray[np.float64]:
        """Return ``(N, 2)`` bodies in the newest scan that have not stood where they are for long, base frame."""
        if not self._scans:
            return np.empty((0, 2))
        newest = self._scans[-1]
        bodies_m = newest.bodies_m
        return bodies_m[self._standing.are_new(se2.apply(newest.T_map_base, bodies_m), newest.stamp_ns)]

    def forget(self) -> None:
        """Forget scans and moments: the own map was given up, and their poses with it."""
        self._standing = Standing()
        self._scans.clear()
        self._moments.clear()

    def moments(self, peer: str, epoch: int) -> list[Moment]:
        """Return the moments kept of a teammate on its map of this epoch, oldest first."""
        return list(self._moments[peer]) if peer in self._moments and self._epochs[peer] == epoch else []

    def on_report(self, report: TeammatePose) -> Moment | None:
        """Return a report's moment where a scan was taken then, and it is independent of the last one."""
        if not self._enabled:
            return None
        seen = min(self._scans, key=lambda one: abs(one.stamp_ns - report.stamp_ns), default=None)
        if seen is None or abs(seen.stamp_ns - report.stamp_ns) > TOGETHER_NS:
            return None
        seen.reports[report.peer] = (report.epoch, report.T_map_base)
        if self._epochs.get(report.peer) != report.epoch:
            self._epochs[report.peer] = report.epoch
            self._moments.pop(report.peer, None)
        kept = self._moments.setdefault(report.peer, deque(maxlen=MOMENTS_MOST))
        moment = Moment(seen.scan, seen.bodies_m, seen.T_map_base, report.T_map_base, report.bodies_m, seen.reports)
        if kept and not moment.is_after(kept[-1]):
            return None
        kept.append(moment)
        return moment

    def fix(self, peer: str) -> MutualFix | None:
        """Return the transform to a teammate's map that their sightings of each other agree on, if any."""
        return mutual_fix(list(self._moments.get(peer, ())))
