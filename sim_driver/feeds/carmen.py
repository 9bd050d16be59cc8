"""CARMEN logs: ``FLASER`` and ``ROBOTLASER1`` lines, plain or gzip.

``FLASER n r_0..r_n-1 laser_x laser_y laser_theta odom_x odom_y odom_theta ipc_time host log_time``

``ROBOTLASER1 type start fov resolution max_range accuracy remission_mode n r_0..r_n-1 n_rem rem_0..
laser_x laser_y laser_theta robot_x robot_y robot_theta tv rv forward side turn ipc_time host log_time``

Other messages and comments are passed over. A scan line that cannot be read is dropped and counted; a file that ends in
the middle of a line or of its gzip stream raises, for then nobody knows how much is missing, unless what is whole is to
be salvaged.
"""

from __future__ import annotations

import gzip
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.feeds import floats
from mrslam.sim_driver.feeds.base import Reading
from mrslam.spatial import InputError, Scan, se2

MAX_BEAMS = 100_000
SALVAGE = "; --salvage uses the scans before"
ENDLESS_M = 1.0e4
"""Range limit of lasers whose log tells none, metres."""


URG_INCREMENT_RAD, URG_BEAM_INTERVAL_S = 2.0 * np.pi / 1024, 0.1 / 1024
"""Hokuyo's URG-04LX steps through 1024 directions, ten turns a second; a robot that drives sees its scans sheared."""


@dataclass(frozen=True)
class _Line:
    ranges_m: NDArray[np.float32]
    angle_min_rad: float
    angle_increment_rad: float
    range_max_m: float
    T_odom_laser: NDArray[np.float64]
    T_odom_base: NDArray[np.float64]
    stamp_s: float


class CarmenFeed:
    """A CARMEN log in memory, in file order."""

    def __init__(self, path: Path, salvage: bool = False) -> None:
        """Read the whole log; raise ``InputError`` naming file and line where it holds no scan or was cut off.

        ``salvage`` : use what is whole of a log that was cut off, and note it.
        """
        self.notes: list[str] = []
        lines = _parse(path, self.notes, salvage)
        T_base_laser = _laser_mounting(lines)
        no_return_m = _no_return_value(lines)
        if no_return_m < ENDLESS_M:
            self.notes.append(f"readings of {no_return_m:g} m and more are no-returns")
        longest_m = float(np.nextafter(np.float32(no_return_m), np.float32(0)))
        self.readings = [
            Reading(
                Scan(
                    stamp_ns=round(line.stamp_s * 1e9),
                    ranges_m=line.ranges_m,
                    angle_min_rad=line.angle_min_rad,
                    angle_increment_rad=line.angle_increment_rad,
                    range_max_m=min(line.range_max_m, longest_m),
                    T_base_laser=T_base_laser,
                    beam_interval_s=_beam_interval_s(line.angle_increment_rad),
                ),
                line.T_odom_base,
            )
            for line in lines
        ]
        stamps = np.array([reading.scan.stamp_ns for reading in self.readings])
        steps = np.diff(stamps)
        if (steps < 0).any():
            self.notes.append(f"{int((steps < 0).sum())} stamps run backward; the file's order is kept")
        if (steps == 0).any():
            self.notes.append(f"{int((steps == 0).sum())} stamps repeat the one before")


def _parse(path: Path, notes: list[str], salvage: bool) -> list[_Line]:
    lines: list[_Line] = []
    bad: list[str] = []
    number, text = 0, "\n"
    try:
        with gzip.open(path, "rt", errors="replace") if _is_gzip(path) else path.open(errors="replace") as file:
            for number, text in enumerate(file, start=1):
                kind = (text[:12].split(None, 1) or [""])[0]
                if kind not in PARSERS:
                    continue
                try:
                    lines.append(PARSERS[kind](text))
                except ValueError as error:
                    bad.append(f"line {number}: {error}")
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        if not (salvage and lines):
            reason = f"the gzip stream is cut off or broken after line {number} ({error})"
            raise InputError(f"{path}: {reason}{SALVAGE if lines else ''}") from error
        notes.append(f"the gzip stream is cut off or broken after line {number}: {len(lines)} scans before it are used")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from error
    if not text.endswith("\n") and bad and bad[-1].startswith(f"line {number}:"):
        if not (salvage and lines):
            raise InputError(f"{path}: the log is cut off in its last line, {bad[-1]}{SALVAGE if lines else ''}")
        notes.append(f"the log is cut off in its last line: {len(lines)} scans before it are used")
    if number == 0:
        raise InputError(f"{path}: no FLASER or ROBOTLASER1 line could be read: the file is empty")
    if not lines:
        what = f" (first bad one: {bad[0]})" if bad else ": is it a CARMEN log?"
        raise InputError(f"{path}: no FLASER or ROBOTLASER1 line could be read among {number} lines{what}")
    if bad:
        notes.append(f"{len(bad)} unreadable scan lines dropped, the first {bad[0]}")
    return lines


def _is_gzip(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(2) == b"\x1f\x8b"


def _numbers(text: str) -> tuple[NDArray[np.float64], float]:
    """Return the numbers after the keyword, up to the closing ``ipc_time host log_time``, and ipc_time."""
    head, ipc_time, _host, _log_time = text.rstrip().rsplit(None, 3)
    _, _, body = head.partition(" ")
    try:
        values = floats.parse(body)
        stamp_s = float(ipc_time)
    except ValueError as error:
        raise ValueError(f"not a number ({error})") from error
    if not np.isfinite(stamp_s) or abs(stamp_s) > 9e9:
        raise ValueError(f"time stamp {ipc_time} s out of range")
    return values, stamp_s


def _beam_count(value: float) -> int:
    if not (0 < value <= MAX_BEAMS and value == int(value)):
        raise ValueError(f"beam count {value:g} is not a whole number in 1..{MAX_BEAMS}")
    return int(value)


def _poses(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    if not np.isfinite(values).all():
        raise ValueError("a pose is not finite")
    return values[:3], values[3:6]


def flaser_angles(beams: int) -> tuple[float, float]:
    """Return first angle and increment (radians) of a half-turn laser: 180 -> 1 deg from -90, 181 -> -90..+90, ..."""
    return -np.pi / 2, np.pi / (beams if beams % 2 == 0 else max(beams - 1, 1))


def _flaser(text: str) -> _Line:
    values, stamp_s = _numbers(text)
    beams = _beam_count(values[0] if values.size else 0.0)
    if values.size != 1 + beams + 6:
        raise ValueError(f"{beams} beams announced, but {values.size - 7} ranges found")
    laser, base = _poses(values[1 + beams :])
    angle_min, increment = flaser_angles(beams)
    ranges = values[1 : 1 + beams].astype(np.float32)
    return _Line(ranges, angle_min, increment, ENDLESS_M, laser, base, stamp_s)


def _robotlaser(text: str) -> _Line:
    values, stamp_s = _numbers(text)
    beams = _beam_count(values[7] if values.size > 7 else 0.0)
    if values.size < 8 + beams + 1:
        raise ValueError(f"{beams} beams announced, but only {max(values.size - 8, 0)} numbers follow")
    tail = 8 + beams + 1 + int(np.clip(values[8 + beams], 0, MAX_BEAMS))
    if values.size != tail + 11:
        raise ValueError(f"{tail + 11} numbers expected, {values.size} found")
    start, increment, range_max = (float(values[i]) for i in (1, 3, 4))
    if not (np.isfinite(start) and np.isfinite(increment) and range_max > 0):
        raise ValueError(
            f"laser start {start:g} rad, increment {increment:g} rad, max range {range_max:g} m make no sense"
        )
    laser, base = _poses(values[tail : tail + 6])
    return _Line(values[8 : 8 + beams].astype(np.float32), start, increment, range_max, laser, base, stamp_s)


PARSERS = {"FLASER": _flaser, "ROBOTLASER1": _robotlaser}


def _beam_interval_s(angle_increment_rad: float) -> float:
    """Return the time between beams, which the format does not tell, of the slow laser that its angles give away.

    A SICK LMS sweeps half a turn in 7 ms, in which a robot moves by less than its range noise.
    """
    is_urg = abs(abs(angle_increment_rad) - URG_INCREMENT_RAD) < 0.005 * URG_INCREMENT_RAD
    return URG_BEAM_INTERVAL_S if is_urg else 0.0


def _laser_mounting(lines: list[_Line]) -> NDArray[np.float64]:
    """Return the laser's pose on the robot: the median over the log, since each line is rounded."""
    T_odom_base = np.stack([line.T_odom_base for line in lines])
    T_base_laser = se2.between(T_odom_base, np.stack([line.T_odom_laser for line in lines]))
    return np.round(np.median(T_base_laser, axis=0), 4) + 0.0  # no negative zeros


def _no_return_value(lines: list[_Line]) -> float:
    """Return the reading by which the laser says "nothing seen": a largest value that stands out by its frequency."""
    ranges = np.concatenate([line.ranges_m for line in lines])
    ranges = ranges[np.isfinite(ranges)]
    if ranges.size == 0:
        return ENDLESS_M
    top = float(ranges.max())
    at_top, near_top = int((ranges >= 0.99 * top).sum()), int((ranges >= 0.9 * top).sum())
    return round(0.99 * top, 2) if at_top >= 10 and at_top > 0.5 * near_top else ENDLESS_M
