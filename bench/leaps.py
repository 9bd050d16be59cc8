"""Robots carried off between two scans, to another place of the same log: who notices, and when; one JSON line a log.

    python bench/leaps.py LOG ... [--leaps 6] [--seed 7]

Each leap is played after an eighth of the log, for ``AFTER`` scans more; its wheels know nothing of it. ``noticed_s`` :
seconds until ``health`` says that the robot was carried, null where it does not; ``leaps_m`` : how far they were.
Logs need their reference trajectory beside them.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from drives import Drive, recorded  # beside this file

from mrslam import rbpf
from mrslam.rbpf.front_end.health import LOST

BEFORE, AFTER = 0.12, 150
"""Share of the log that is driven before a leap, and scans after it."""
NEAREST_M, FARTHEST_M = 2.0, 20.0
"""Leaps are between these."""


def leap(drive: Drive, rng: np.random.Generator) -> tuple[int, int, float]:
    """Return the scan before a leap, the one after it, and its length, metres."""
    count = len(drive.readings)
    while True:
        before = int(rng.integers(int(0.15 * count), int(0.85 * count)))
        after = int(rng.integers(before + 50, count - 100))
        away_m = float(np.hypot(*(drive.truth[after] - drive.truth[before])[:2]))
        if NEAREST_M < away_m < FARTHEST_M:  # false where either is not known
            return before, after, away_m


def noticed_s(drive: Drive, before: int, after: int) -> float | None:
    """Play one leap."""
    first = max(0, before + 1 - int(BEFORE * len(drive.readings)))
    joined = Drive(drive.readings[first:], drive.truth[first:]).carried(before + 1 - first, after - first)
    leaps = before + 1 - first
    stamps_ns = np.array([reading.scan.stamp_ns for reading in joined.readings])
    gap_ns = int(stamps_ns[leaps] - stamps_ns[leaps - 1] - np.median(np.diff(stamps_ns)))
    mapper = rbpf.Mapper(rbpf.MapperConfig(particles=1, threads=1), seed=1)
    for k, reading in enumerate(joined.readings[: leaps + AFTER]):
        scan = replace(reading.scan, stamp_ns=reading.scan.stamp_ns - gap_ns * (k >= leaps))
        health = mapper.update(scan, reading.T_odom_base).health
        if k >= leaps and health <= LOST:
            return round(float(stamps_ns[k] - stamps_ns[leaps]) / 1e9, 1)
    return None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", nargs="+", type=Path)
    parser.add_argument("--leaps", type=int, default=6)
    parser.add_argument("--seed", type=int, default=7)
    args = parser.parse_args()
    rbpf.warm_up()
    for log in args.logs:
        drive, rng = recorded(log), np.random.default_rng(args.seed)
        leaps = [leap(drive, rng) for _ in range(args.leaps)]
        line = {
            "log": log.name, "leaps": len(leaps), "leaps_m": [round(away_m, 1) for *_, away_m in leaps],
            "noticed_s": [noticed_s(drive, before, after) for before, after, _ in leaps],
        }  # fmt: skip
        print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
