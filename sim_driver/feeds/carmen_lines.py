"""Scan lines of CARMEN logs.

``FLASER n r_0..r_n-1 laser_x laser_y laser_theta odom_x odom_y odom_theta ipc_time host log_time``

``ROBOTLASER1 type start fov resolution max_range accuracy remission_mode n r_0..r_n-1 n_rem rem_0..
laser_x laser_y laser_theta robot_x robot_y robot_theta tv rv forward side turn ipc_time host log_time``
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.feeds import floats

MAX_BEAMS = 100_000
"""Most beams of one scan: some 30 times the densest planar lasers; a larger count is a damaged line."""
ENDLESS_M = 1.0e4
"""Range limit of lasers whose log names none, metres: beyond any laser's reach."""
FARTHEST_M = 1.0e7
"""No log leads farther from where it began, metres: a larger number is a damaged one."""
LATEST_S = 9e9
"""Latest time stamp, seconds: nanoseconds of later ones do not fit into 64 bits."""


@dataclass(frozen=True)
class LaserLine:
    """One scan line: metres, radians, seconds; poses ``(3,)`` in the odometry frame."""

    ranges_m: NDArray[np.float32]
    angle_min_rad: float
    angle_increment_rad: float
    range_max_m: float
    T_odom_laser: NDArray[np.float64]
    T_odom_base: NDArray[np.float64]
    stamp_s: float


def _numbers(text: str) -> tuple[NDArray[np.float64], float]:
    """Return the numbers after the keyword, up to the closing ``ipc_time host log_time``, and ipc_time."""
    head, ipc_time, _host, _log_time = text.rstrip().rsplit(None, 3)
    _, _, body = head.partition(" ")
    try:
        values = floats.parse(body)
        stamp_s = float(ipc_time)
    except ValueError as error:
        raise ValueError(f"not a number ({error})") from error
    if not np.isfinite(stamp_s) or abs(stamp_s) > LATEST_S:
        raise ValueError(f"time stamp {ipc_time} s out of range")
    return values, stamp_s


def _beam_count(value: float) -> int:
    if not (0 < value <= MAX_BEAMS and value == int(value)):
        raise ValueError(f"beam count {value:g} is not a whole number in 1..{MAX_BEAMS}")
    return int(value)


def _poses(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    if not (np.abs(values) <= FARTHEST_M).all():
        raise ValueError("a pose is not finite, or nowhere on earth")
    return values[:3], values[3:6]


def flaser_angles(beams: int) -> tuple[float, float]:
    """Return first angle and increment (radians) of a half-turn laser: 180 -> 1 deg from -90, 181 -> -90..+90, ..."""
    return -np.pi / 2, np.pi / (beams if beams % 2 == 0 else max(beams - 1, 1))


def _flaser(text: str) -> LaserLine:
    values, stamp_s = _numbers(text)
    beams = _beam_count(values[0] if values.size else 0.0)
    if values.size != 1 + beams + 6:
        raise ValueError(f"{beams} beams announced, but {values.size - 7} ranges found")
    laser, base = _poses(values[1 + beams :])
    angle_min, increment = flaser_angles(beams)
    ranges = values[1 : 1 + beams].astype(np.float32)
    return LaserLine(ranges, angle_min, increment, ENDLESS_M, laser, base, stamp_s)


def _robotlaser(text: str) -> LaserLine:
    values, stamp_s = _numbers(text)
    beams = _beam_count(values[7] if values.size > 7 else 0.0)
    if values.size < 8 + beams + 1:
        raise ValueError(f"{beams} beams announced, but only {max(values.size - 8, 0)} numbers follow")
    tail = 8 + beams + 1 + int(np.clip(values[8 + beams], 0, MAX_BEAMS))
    if values.size != tail + 11:
        raise ValueError(f"{tail + 11} numbers expected, {values.size} found")
    start, increment, range_max = (float(values[i]) for i in (1, 3, 4))
    fits = abs(increment) * (beams - 1) <= 2.0 * np.pi + 1e-3
    if not (np.isfinite(start) and np.isfinite(increment) and fits and range_max > 0):
        raise ValueError(
            f"laser start {start:g} rad, increment {increment:g} rad, max range {range_max:g} m make no sense"
        )
    laser, base = _poses(values[tail : tail + 6])
    return LaserLine(values[8 : 8 + beams].astype(np.float32), start, increment, range_max, laser, base, stamp_s)


PARSERS: dict[str, Callable[[str], LaserLine]] = {"FLASER": _flaser, "ROBOTLASER1": _robotlaser}
"""Keyword of a scan line -> its parser; raises ``ValueError`` where the line is damaged."""
