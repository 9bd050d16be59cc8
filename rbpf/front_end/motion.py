"""Local motion from keyframe to keyframe: how it adds up, when the next keyframe is due, and its covariance.

"Way" is the length of the path driven, metres, turns included (``TURN_WAY_M``). "Blind" is motion along a direction
where scans saw nothing of it, as along a corridor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.front_end.front_end import Step
from mrslam.spatial import se2
from mrslam.spatial.hits.views import Beams
from mrslam.spatial.poses import compose
from mrslam.spatial.se2 import Transform

TURN_WAY_M = 0.3
"""Way that a turn of one radian counts as, metres: a turning robot sees as much that is new."""
WAY_MOST = 3.0
"""A keyframe is due after this many times the way it takes straight on, wherever that led."""
NOISE_M, NOISE_RAD = 0.01, 0.0015
"""Standard deviation of any local motion, however short, metres and radians: of the matcher's pose."""

CARRIED_M, CARRIED_RAD = 1e3, math.pi
"""Standard deviation of a motion in which the robot was carried, metres and radians: it may be anywhere."""

MOTION, WAY, BLIND_M, CARRIED, GUESSED = slice(0, 3), 3, slice(4, 6), 6, slice(7, 9)
"""Columns of an arrival: local motion ``T_before_key`` from the keyframe before (3: m, m, rad), its way (1: m), its
blind error in the frame of the keyframe before (2: m), whether the robot was carried meanwhile (0 or 1), and variances
of position and heading where scans fitted nothing, so that motion was but guessed (2: m^2, rad^2)."""
ARRIVAL_COLUMNS = 9
"""Number of columns of an arrival."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Keyframe:
    """A scan at which the filter is updated, and how the robot came there; nothing in it changes any more."""

    beams: Beams
    arrival: NDArray[np.float64]
    """``(9,)``: motion to this keyframe, columns ``MOTION``, ``WAY``, ``BLIND_M``, ``CARRIED`` and ``GUESSED``."""
    inliers: float
    """Share of beams that lie on the rolling map, 0..1."""
    is_unconfirmed: bool = False
    """Whether its map shows something else, or nothing, where the robot's wheels led in a pause."""

    @property
    def is_carried(self) -> bool:
        """Whether the robot was carried here."""
        return bool(self.arrival[CARRIED])

    @property
    def is_apart(self) -> bool:
        """Whether no scan led here from the keyframe before: the robot was carried, or came by its wheels alone."""
        return self.is_carried or self.is_unconfirmed


@dataclass(frozen=True, kw_only=True, eq=False)
class Agreement:
    """How far a map agrees with a keyframe's scan."""

    inliers: float
    """Share of beams that fit the map, 0..1."""
    conflicts: float
    """Share of beams that contradict it, 0..1."""
    information: NDArray[np.float64] = field(default_factory=lambda: np.zeros((3, 3)))
    """``(3, 3)``, what the scan says of the keyframe's pose in the map, in its own axes: 1/m^2, 1/(m rad), 1/rad^2."""


class LocalMotion:
    """Local motion since the newest keyframe."""

    def __init__(self) -> None:
        self.stamp_ns = 0
        """Of the keyframe."""
        self.T_key_base: Transform = np.zeros(3)
        """``(3,)``, metres and radians."""
        self.way_m = 0.0
        """Length of the path driven, turns included."""
        self.blind_m = np.zeros(2)
        """``(2,)``, keyframe's frame: error of the motion along what could not be seen."""
        self.is_carried = False
        """Whether the robot was carried since."""
        self.guessed = np.zeros(2)
        """``(2,)``, variances of position and heading by scans that fitted nothing, m^2 and rad^2."""

    def add(self, step: Step) -> None:
        """Add the motion of one scan."""
        self.T_key_base = compose(self.T_key_base, step.T_before_base)
        if step.blind_m.any():
            self.blind_m += se2.apply(np.array([0.0, 0.0, self.T_key_base[2]]), step.blind_m)
        self.is_carried |= step.is_carried
        self.guessed = self.guessed + step.guessed
        self.way_m += float(math.hypot(*step.T_before_base[:2]) + TURN_WAY_M * abs(step.T_before_base[2]))

    def is_due(self, config: MapperConfig, stamp_ns: int) -> bool:
        """Return whether the next keyframe is due."""
        motion = self.T_key_base
        waited = 0.0 < config.temporal_update_s <= abs(stamp_ns - self.stamp_ns) * 1e-9
        return (
            math.hypot(motion[0], motion[1]) >= config.linear_update_m
            or abs(motion[2]) >= config.angular_update_rad
            or self.way_m >= WAY_MOST * config.linear_update_m
            or waited
            or self.is_carried
        )

    def restart(self, stamp_ns: int) -> NDArray[np.float64]:
        """Begin again at a keyframe, and return the arrival ``(9,)`` there."""
        arrival = np.array([*self.T_key_base, self.way_m, *self.blind_m, float(self.is_carried), *self.guessed])
        self.stamp_ns, self.T_key_base, self.way_m, self.blind_m = stamp_ns, np.zeros(3), 0.0, np.zeros(2)
        self.is_carried, self.guessed = False, np.zeros(2)
        return arrival

    def state(self) -> list[Any]:
        """Return everything that a resumed mapper needs."""
        return [self.stamp_ns, self.T_key_base, self.way_m, self.blind_m, self.is_carried, self.guessed]

    def restore(self, state: list[Any]) -> None:
        """Continue from what :meth:`state` returned."""
        self.stamp_ns, self.T_key_base, self.way_m, self.blind_m, self.is_carried, self.guessed = state


def motion_cov(config: MapperConfig, motion: Transform, blind_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``(3, 3)``, the covariance of a local motion ``(3,)`` in the frame it starts from.

    ``blind_m (2,)`` : error of the motion along what could not be seen, in the same frame.
    """
    return chain_cov(config, np.array([[*motion, 0.0, *blind_m, 0.0, 0.0, 0.0]]))[0]


def chain_cov(config: MapperConfig, arrivals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``(K, 3, 3)`` covariances of the motion to each keyframe, from ``arrivals (K, 9)``."""
    length, turn = np.hypot(arrivals[:, 0], arrivals[:, 1]), np.abs(arrivals[:, 2])
    sigma_m = NOISE_M + config.noise_m_per_m * length + config.noise_m_per_rad * turn
    sigma_rad = NOISE_RAD + config.noise_rad_per_m * length + config.noise_rad_per_rad * turn
    cov = np.zeros((arrivals.shape[0], 3, 3))
    cov[:, 0, 0] = cov[:, 1, 1] = sigma_m**2
    cov[:, 2, 2] = sigma_rad**2
    cov[:, [0, 1, 2], [0, 1, 2]] += arrivals[:, GUESSED][:, [0, 0, 1]]
    cov[arrivals[:, CARRIED] > 0.0] += np.diag(np.square([CARRIED_M, CARRIED_M, CARRIED_RAD]))
    cov[:, :2, :2] += np.einsum("ki,kj->kij", arrivals[:, BLIND_M], arrivals[:, BLIND_M])
    return cov


def composed_cov(
    T_map_base: Transform, T_key_base: Transform, key_cov: NDArray[np.float64], motion_cov: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return ``(3, 3)`` of a pose in the map: of its keyframe's (map axes), and of the motion since (its own axes)."""
    heading = float(T_map_base[2] - T_key_base[2])
    c, s = math.cos(heading), math.sin(heading)
    x, y = c * T_key_base[0] - s * T_key_base[1], s * T_key_base[0] + c * T_key_base[1]
    by_key = np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]])
    turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(by_key @ key_cov @ by_key.T + turned @ motion_cov @ turned.T)
