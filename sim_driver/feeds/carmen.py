"""CARMEN logs: ``FLASER`` and ``ROBOTLASER1`` lines, plain or gzip.

Other messages and comments are passed over. A scan line that cannot be read is dropped and counted; a file that ends in
the middle of a line or of its gzip stream raises, for then nobody knows how much is missing, unless what is whole is to
be salvaged.
"""

from __future__ import annotations

import gzip
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.feeds.base import Format, Reading
from mrslam.sim_driver.feeds.carmen_lines import ENDLESS_M, PARSERS, LaserLine
from mrslam.spatial import InputError, Scan, se2

SALVAGE = "; --salvage uses the scans before"
"""End of messages about a log of which part can be used."""
URG_INCREMENT_RAD, URG_BEAM_INTERVAL_S = 2.0 * np.pi / 1024, 0.1 / 1024
"""Hokuyo's URG-04LX steps through 1024 directions, ten turns a second; a robot that drives sees its scans sheared."""


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
        self.readings = [_reading(line, T_base_laser, longest_m) for line in lines]
        self._note_stamps()

    def _note_stamps(self) -> None:
        steps = np.diff(np.array([reading.scan.stamp_ns for reading in self.readings]))
        if (steps < 0).any():
            self.notes.append(f"{int((steps < 0).sum())} stamps run backward; the file's order is kept")
        if (steps == 0).any():
            self.notes.append(f"{int((steps == 0).sum())} stamps repeat the one before")


CARMEN = Format("carmen", (".clf", ".log", ".script"), CarmenFeed)


def _reading(line: LaserLine, T_base_laser: NDArray[np.float64], longest_m: float) -> Reading:
    """Return one line's scan and odometry; readings above ``longest_m`` are no-returns."""
    scan = Scan(
        stamp_ns=round(line.stamp_s * 1e9),
        ranges_m=line.ranges_m,
        angle_min_rad=line.angle_min_rad,
        angle_increment_rad=line.angle_increment_rad,
        range_max_m=min(line.range_max_m, longest_m),
        T_base_laser=T_base_laser,
        beam_interval_s=_beam_interval_s(line.angle_increment_rad),
    )
    return Reading(scan, line.T_odom_base)


@dataclass
class _Text:
    """What a log's text holds."""

    scans: list[LaserLine] = field(default_factory=list)
    bad: list[str] = field(default_factory=list)
    """Scan lines that cannot be read, each "line <number>: <why>"."""
    number: int = 0
    """Number of the last line, from 1."""
    last: str = "\n"
    broken: Exception | None = None
    """Why the gzip stream ends too early."""

    def add(self, text: str) -> None:
        """Take in the next line."""
        self.number, self.last = self.number + 1, text
        kind = (text[:12].split(None, 1) or [""])[0]
        if kind not in PARSERS:
            return
        try:
            self.scans.append(PARSERS[kind](text))
        except ValueError as error:
            self.bad.append(f"line {self.number}: {error}")

    @property
    def cut_off(self) -> tuple[str, str] | None:
        """What is cut off and the reason, None where the log ends as it should."""
        if self.broken is not None:
            return f"the gzip stream is cut off or broken after line {self.number}", f" ({self.broken})"
        if not self.last.endswith("\n") and self.bad and self.bad[-1].startswith(f"line {self.number}:"):
            return "the log is cut off in its last line", f", {self.bad[-1]}"
        return None


def _parse(path: Path, notes: list[str], salvage: bool) -> list[LaserLine]:
    """Return the scan lines of a log; what was left out is noted, or raises ``InputError``."""
    text = _read(path)
    if text.cut_off is not None:
        what, why = text.cut_off
        if not (salvage and text.scans):
            raise InputError(f"{path}: {what}{why}{SALVAGE if text.scans else ''}")
        notes.append(f"{what}: {len(text.scans)} scans before it are used")
    if text.number == 0:
        raise InputError(f"{path}: no FLASER or ROBOTLASER1 line could be read: the file is empty")
    if not text.scans:
        what = f" (first bad one: {text.bad[0]})" if text.bad else ": is it a CARMEN log?"
        raise InputError(f"{path}: no FLASER or ROBOTLASER1 line could be read among {text.number} lines{what}")
    if text.bad:
        notes.append(f"{len(text.bad)} unreadable scan lines dropped, the first {text.bad[0]}")
    return text.scans


def _read(path: Path) -> _Text:
    """Return what a log holds up to its end, or to where its gzip stream breaks off."""
    text = _Text()
    try:
        with _opened(path) as file:
            for line in file:
                text.add(line)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        text.broken = error
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from error
    return text


def _opened(path: Path) -> TextIO:
    with path.open("rb") as file:
        is_gzip = file.read(2) == b"\x1f\x8b"
    return gzip.open(path, "rt", errors="replace") if is_gzip else path.open(errors="replace")


def _beam_interval_s(angle_increment_rad: float) -> float:
    """Return the time between beams, which the format does not give, of the slow laser that its angles give away.

    A SICK LMS sweeps half a turn in 7 ms, in which a robot moves by less than its range noise.
    """
    is_urg = abs(abs(angle_increment_rad) - URG_INCREMENT_RAD) < 0.005 * URG_INCREMENT_RAD
    return URG_BEAM_INTERVAL_S if is_urg else 0.0


def _laser_mounting(lines: list[LaserLine]) -> NDArray[np.float64]:
    """Return the laser's pose on the robot: the median over the log, since each line is rounded."""
    T_odom_base = np.stack([line.T_odom_base for line in lines])
    T_base_laser = se2.between(T_odom_base, np.stack([line.T_odom_laser for line in lines]))
    return np.round(np.median(T_base_laser, axis=0), 4) + 0.0  # no negative zeros


def _no_return_value(lines: list[LaserLine]) -> float:
    """Return the reading by which the laser says "nothing seen": a largest value that stands out by its frequency."""
    ranges = np.concatenate([line.ranges_m for line in lines])
    ranges = ranges[np.isfinite(ranges)]
    if ranges.size == 0:
        return ENDLESS_M
    top = float(ranges.max())
    at_top, near_top = int((ranges >= 0.99 * top).sum()), int((ranges >= 0.9 * top).sum())
    return round(0.99 * top, 2) if at_top >= 10 and at_top > 0.5 * near_top else ENDLESS_M
