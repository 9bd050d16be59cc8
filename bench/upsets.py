"""Stretches of logs with what goes wrong on robots put into them, and what becomes of the map: one JSON line each.

    python bench/upsets.py LOG ... [--seeds 1 2] [--only pause-leap ...]

Half of a log is driven from a place drawn by the seed, and somewhere on it the robot is upset: no scans come for some
seconds, the laser gives rubbish, the wheels leap or begin again at zero, or it is carried to a place that it passed.
``finished`` and ``online`` : RMS distance (m) to the reference beside the log after the best rigid fit;
``flagged`` : share of the way more than 1 m off that was marked doubtful, null where there is none, ``false`` : of the
rest; as in ``bench/particles.py``. ``plain`` is the stretch as it is.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from drives import Drive, carried_between, recorded  # beside this file
from numpy.typing import NDArray
from particles import medians, run  # beside this file

from mrslam import rbpf
from mrslam.sim_driver.feeds.base import Reading
from mrslam.spatial import se2

SHARE = 0.5
"""Of the log that is driven."""
LEAP_M, LEAP_RAD = 1.5, 0.6
"""Wheels leap by up to this, along either axis and in heading."""
CARRIED_SHARE = 0.15
"""Of the log that a robot drives on after it was carried."""


class Upset:
    """One stretch of a log, and where in it something goes wrong."""

    def __init__(self, log: Path, seed: int) -> None:
        """Draw both."""
        rng = np.random.default_rng(seed)
        begin = float(rng.uniform(0.0, 1.0 - SHARE))
        self.drive = recorded(log, begin, begin + SHARE)
        self.at = int(rng.uniform(0.3, 0.8) * len(self.drive.readings))
        self.leap = np.append(rng.uniform(-LEAP_M, LEAP_M, 2), rng.uniform(-LEAP_RAD, LEAP_RAD))
        self.back = float(rng.uniform(0.1, 0.9))
        self.rng = rng
        stamps_ns = np.array([reading.scan.stamp_ns for reading in self.drive.readings])
        self.interval_s = float(np.median(np.diff(stamps_ns))) / 1e9

    def cases(self) -> dict[str, Callable[[], Drive]]:
        """Return what makes each drive, by name."""
        rubbish, other_rubbish = self.rubbish(5.0), self.rubbish(5.0)  # drawn whether they are asked for or not
        return {
            "plain": lambda: self.drive,
            "leap": lambda: self.moved(self.drive, self.leap_from(self.at)),
            "zero": lambda: self.moved(self.drive, se2.inverse(self.wheels(self.at))),
            "pause": lambda: self.pause(10.0),
            "pause-leap": lambda: self.moved(self.pause(6.0), self.leap_from(self.at)),
            "pause-zero": lambda: self.moved(self.pause(6.0), se2.inverse(self.wheels(self.after(6.0)))),
            "rubbish": lambda: rubbish,
            "rubbish-leap": lambda: self.moved(other_rubbish, self.leap_from((self.at + self.after(5.0)) // 2)),
            "carried": self.carried,
        }

    def wheels(self, k: int) -> NDArray[np.float64]:
        """Return odometry ``(3,)`` at a reading."""
        told = self.drive.readings[k].T_odom_base
        assert told is not None
        return told

    def leap_from(self, k: int) -> NDArray[np.float64]:
        """Return what odometry is moved by, ``(3,)`` in its own frame, where the wheels leap at a reading."""
        return se2.compose(se2.compose(self.wheels(k), self.leap), se2.inverse(self.wheels(k)))

    def after(self, seconds: float) -> int:
        """Return the reading so long after it began."""
        return min(self.at + math.ceil(seconds / self.interval_s), len(self.drive.readings) - 20)

    def moved(self, drive: Drive, T_new_odom: NDArray[np.float64]) -> Drive:
        """Return a drive whose odometry is in another frame from where it is upset on."""
        told = [reading.T_odom_base for reading in drive.readings]
        new = [one if k < self.at or one is None else se2.compose(T_new_odom, one) for k, one in enumerate(told)]
        return drive.told(new)

    def pause(self, seconds: float) -> Drive:
        """Return the drive without scans for so long."""
        end = self.after(seconds)
        readings, truth = self.drive.readings, self.drive.truth
        return Drive(readings[: self.at] + readings[end:], np.concatenate([truth[: self.at], truth[end:]]))

    def rubbish(self, seconds: float) -> Drive:
        """Return the drive with a laser that measures anything for so long."""
        readings = list(self.drive.readings)
        for k in range(self.at, self.after(seconds)):
            ranges = self.rng.uniform(0.2, 8.0, readings[k].scan.ranges_m.size).astype(np.float32)
            readings[k] = Reading(replace(readings[k].scan, ranges_m=ranges), readings[k].T_odom_base)
        return Drive(readings, self.drive.truth)

    def carried(self) -> Drive:
        """Return the first part of the drive, and another one from a place that it passed."""
        count = round(CARRIED_SHARE / SHARE * len(self.drive.readings))
        there = int(self.back * max(self.at - count, 0))
        first, second = (
            Drive(self.drive.readings[part], self.drive.truth[part])
            for part in (slice(self.at), slice(there, min(there + count, self.at)))
        )
        return carried_between(first, second)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", nargs="+", type=Path)
    parser.add_argument("--seeds", nargs="+", type=int, default=[1])
    parser.add_argument("--only", nargs="+")
    args = parser.parse_args()
    rbpf.warm_up()
    for log in args.logs:
        for seed in args.seeds:
            for name, make in Upset(log, seed).cases().items():
                if not args.only or name in args.only:
                    line = {"log": log.name.split(".")[0], "seed": seed, "upset": name, **medians([run(make(), 30, 1)])}
                    print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
