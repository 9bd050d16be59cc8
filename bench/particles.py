"""Cases where more than one history may be true, mapped with 1, 5 and 30 particles: one JSON line a case.

    python bench/particles.py [--only NAME ...] [--particles 1 5 30] [--seeds 1] [--data DIR]

No odometry, wheels that stop counting, corridors that look alike, robots that are carried, drifts of which loops could
close in two ways; simulated, and stretches of public logs under ``DIR`` (default ``$MRSLAM_DATA``). ``finished`` and
``online`` : RMS distance (m) to the truth after the best rigid fit, of all poses as they are in the end and as they
were reported; ``flagged`` : share of the way (m) reported more than 1 m off that was marked doubtful, ``false`` : share
of the rest that was; both by the frame of the drive's first fifth. Medians over the seeds; ``cpu_s`` is the mapper's.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from drives import Drive, carried_between, recorded, simulated, way_along  # beside this file
from numpy.typing import NDArray

from mrslam import rbpf
from mrslam.sim_driver.evaluate.doubtful import DOUBTFUL_BELOW
from mrslam.sim_driver.evaluate.trajectories import absolute_errors
from mrslam.sim_driver.kernels import load_kernels
from mrslam.sim_driver.robots.config import OdometryConfig
from mrslam.sim_driver.worlds.canvas import Canvas
from mrslam.sim_driver.worlds.hotel import hotel as worlds_hotel
from mrslam.sim_driver.worlds.office import office
from mrslam.spatial import OccupancyGrid, se2

WIDE_M, LONG_M, HIGH_M = 2.4, 62.0, 42.0
"""Corridors are this wide; the block they go round measures this, with them."""
FAR_OFF_M = 1.0
"""A pose farther off should be doubted, metres."""
BEGUN = 0.2
"""The first share of a drive, by which its map's frame is laid on the truth's."""
CLEAR_M = 0.2
"""No wall is nearer to a robot on its way through a building, metres."""
DRAWN_MOST = 200
"""Ways that are drawn for a drive through a building at most."""
CARRIED_M = 2.0
"""Between two scans a robot that moved farther did not drive, metres."""
WORN = OdometryConfig(scale_misfit=0.05, turn_misfit=0.05, translation_m_per_sqrt_m=0.1)
"""Wheels that slip and are worn."""


@dataclass(frozen=True)
class Case:
    """What is mapped."""

    kind: str
    make: Callable[[Path, int], Drive]
    """Returns the drive, from the folder of public logs and a seed."""


def block(recesses: int) -> OccupancyGrid:
    """A closed core with a corridor around it, and this number of recesses in the walls, each unlike the others."""
    plan, rng = Canvas(LONG_M, HIGH_M), np.random.default_rng(5)
    plan.box(WIDE_M, WIDE_M, LONG_M - WIDE_M, HIGH_M - WIDE_M)
    for _ in range(recesses):
        along, deep, wide = rng.uniform(0.1, 0.9), rng.uniform(0.4, 1.5), rng.uniform(0.8, 2.5)
        if rng.random() < LONG_M / (LONG_M + HIGH_M):
            low, x = rng.random() < 0.5, along * LONG_M
            y0, y1 = (WIDE_M - 0.1, WIDE_M + deep) if low else (HIGH_M - WIDE_M - deep, HIGH_M - WIDE_M + 0.1)
            plan.box(x, y0, x + wide, y1, value=0)
        else:
            left, y = rng.random() < 0.5, along * HIGH_M
            x0, x1 = (WIDE_M - 0.1, WIDE_M + deep) if left else (LONG_M - WIDE_M - deep, LONG_M - WIDE_M + 0.1)
            plan.box(x0, y, x1, y + wide, value=0)
    return plan.grid()


def round_block(recesses: int, laps: float, data: Path, seed: int) -> Drive:
    """Drive round the block."""
    middle = 0.5 * WIDE_M
    ring = [(middle, middle), (LONG_M - middle, middle), (LONG_M - middle, HIGH_M - middle), (middle, HIGH_M - middle)]
    corners = [(0.3 * LONG_M, middle), ring[1], ring[2], ring[3], *(ring * 3)]
    return simulated(block(recesses), _first(corners, laps * 2 * (LONG_M + HIGH_M), seed), seed, 8.0)


def _first(corners: list[tuple[float, float]], length_m: float, seed: int) -> NDArray[np.float64]:
    """Return the poses of the first metres of a drive."""
    way = way_along(corners, np.random.default_rng(seed))
    gone = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way[:, :2], axis=0).T))])
    return way[gone <= length_m]


def hotel(rooms: int) -> OccupancyGrid:
    """A corridor with equal niches every four metres on both sides, and an unlike lobby at each end."""
    plan = Canvas(4.0 * rooms + 12.0, 9.0)
    end = 4.0 * rooms + 6.0
    plan.box(6.0, 0.0, end, 3.3).box(6.0, 5.7, end, 9.0)
    for k in range(rooms):
        x = 7.5 + 4.0 * k
        plan.box(x, 2.3, x + 1.0, 3.3, value=0).box(x, 5.7, x + 1.0, 6.7, value=0)
    plan.box(1.0, 6.5, 2.5, 8.0).box(end + 2.0, 0.1, end + 3.0, 1.5).disc(end + 4.0, 7.0, 0.4)
    return plan.grid()


def along_hotel(times: int, data: Path, seed: int) -> Drive:
    """Drive to and fro along the hotel's corridor by worn wheels."""
    plan = hotel(8)
    ends = [(3.0, 4.5), (41.0, 4.5)]
    corners = [(3.0, 3.0)]
    for k in range(times):
        corners += [ends[k % 2], ends[(k + 1) % 2], (ends[(k + 1) % 2][0], 3.0)]
    return simulated(plan, way_along(corners, np.random.default_rng(seed)), seed, 6.0, WORN)


def hotel_carried(data: Path, seed: int) -> Drive:
    """After a drive to and fro, the robot is put down in the corridor and drives to one of its ends."""
    first = along_hotel(2, data, seed)
    way = way_along([(18.0 + seed % 3 * 4.0, 4.5), (41.0, 4.5), (41.0, 3.0)], np.random.default_rng(seed + 50))
    return carried_between(first, simulated(hotel(8), way, seed + 90, 6.0, WORN))


WINGS_M = 26.0
"""Distance of two equal wings."""


def wings() -> OccupancyGrid:
    """Two equal wings, each a small ring of corridors, at the ends of a bare passage, with a lobby before the first."""
    plan = Canvas(2 * WINGS_M + 18.0, 24.0)
    plan.box(0.0, 0.0, 2 * WINGS_M + 18.0, 24.0)
    plan.box(2.0, 3.8, 2 * WINGS_M + 12.0, 6.2, value=0).box(0.8, 1.0, 5.0, 8.0, value=0).box(2.0, 1.2, 3.0, 2.0)
    for k in (0, 1):
        x = 10.0 + k * WINGS_M
        plan.box(x, 6.0, x + 14.0, 20.0, value=0).box(x + 2.4, 8.4, x + 11.6, 17.6)
        plan.box(x + 3.0, 17.5, x + 4.2, 18.1).box(x + 11.5, 10.0, x + 12.1, 10.6).box(x, 12.0, x + 0.8, 13.4)
    return plan.grid()


def through_wings(data: Path, seed: int) -> Drive:
    """Drive round the first wing, along the passage, round the second, and back through both."""

    def ring(k: int) -> list[tuple[float, float]]:
        x = 10.0 + k * WINGS_M
        return [(x + 1.2, 5.0), (x + 1.2, 18.8), (x + 12.8, 18.8), (x + 12.8, 7.2), (x + 1.2, 7.2), (x + 1.2, 5.0)]

    corners = [(3.0, 5.0), *ring(0), *ring(1), (30.0, 5.0), *ring(0), (3.0, 5.0)]
    return simulated(wings(), way_along(corners, np.random.default_rng(seed)), seed, 8.0, WORN)


def wings_carried(data: Path, seed: int) -> Drive:
    """After the drive through the wings the robot is put down in the second one, and drives out of it to the first."""
    x = 10.0 + WINGS_M
    corners = [(x + 6.0, 18.8), (x + 12.8, 18.8), (x + 12.8, 7.2), (x + 1.2, 7.2), (x + 1.2, 5.0), (18.0, 5.0)]
    way = way_along(corners, np.random.default_rng(seed + 50))
    return carried_between(through_wings(data, seed), simulated(wings(), way, seed + 90, 8.0, WORN))


def office_carried(number: int, data: Path, seed: int) -> Drive:
    """Drive through an office floor, be carried to another place of it, and drive on."""
    return carried_through(office(number, 30.0), (170.0, 50.0), seed)


def inn_carried(number: int, data: Path, seed: int) -> Drive:
    """Drive through a hotel of the product's worlds (``hotel:NUMBER``), be carried within it, and drive on."""
    return carried_through(worlds_hotel(number), (300.0, 60.0), seed)


def carried_through(plan: OccupancyGrid, lengths_m: tuple[float, float], seed: int) -> Drive:
    """Drive about a floor between random places for so many metres, be carried, and drive about again."""
    from surveys import free_inside, way_through  # imported here: it brings OpenCV

    rng = np.random.default_rng(seed)
    ways: list[NDArray[np.float64]] = []
    inside, room = free_inside(plan.cells != 0)
    for _ in range(DRAWN_MOST):
        length = lengths_m[len(ways)]
        rough = way_through(inside, room, length, rng)
        way = _first([(float(x), float(y)) for x, y, _ in rough], length, seed)
        cells = np.floor((way[:, :2] - np.asarray(plan.origin_m)) / plan.resolution_m).astype(np.int64)
        if room[cells[:, 1], cells[:, 0]].min() > CLEAR_M:  # rounded corners may lead through walls
            ways.append(way)
        if len(ways) == len(lengths_m):
            break
    else:
        raise SystemExit(f"none of {DRAWN_MOST} ways keeps {CLEAR_M} m off the walls: another seed or building may do")
    legs = [simulated(plan, way, seed + k, 8.0) for k, way in enumerate(ways)]
    return carried_between(legs[0], legs[1])


def log(name: str, begin: float, end: float, data: Path, seed: int) -> Drive:
    return recorded(data / name, begin, end)


def logs_carried(one: tuple[str, float, float], two: tuple[str, float, float], data: Path, seed: int) -> Drive:
    """Two stretches of logs of one building: the robot was carried from the one's end to the other's beginning."""
    return carried_between(recorded(data / one[0], *one[1:]), recorded(data / two[0], *two[1:]))


def no_odometry(make: Callable[[Path, int], Drive]) -> Callable[[Path, int], Drive]:
    return lambda data, seed: make(data, seed).without_odometry()


def dead(begin: float, make: Callable[[Path, int], Drive]) -> Callable[[Path, int], Drive]:
    return lambda data, seed: make(data, seed).dead_wheels(begin)


INNS = 2, 3, 4, 7, 12, 13, *range(15, 24), *range(25, 34), 36, *range(38, 41)
"""Hotels through whose doors ways of rounded corners lead (:func:`carried_through`), up to 40."""
INTEL, ACES, CSAIL = "slam/intel.clf.gz", "slam/aces.clf.gz", "slam/mit-csail.clf.gz"
WEAN1, WEAN3 = "wean/wean1.clf.gz", "wean/wean3.clf.gz"
CASES = {
    "recesses-no-odometry": Case("no odometry", no_odometry(partial(round_block, 24, 1.3))),
    "bare-no-odometry": Case("no odometry", no_odometry(partial(round_block, 0, 1.3))),
    "aces-no-odometry": Case("no odometry", no_odometry(partial(log, ACES, 0.0, 0.6))),
    "recesses-dead-third": Case("dead wheels", dead(0.3, partial(round_block, 24, 1.3))),
    "bare-dead-third": Case("dead wheels", dead(0.3, partial(round_block, 0, 1.3))),
    "recesses-dead": Case("dead wheels", dead(0.0, partial(round_block, 24, 1.3))),
    "aces-dead-third": Case("dead wheels", dead(0.3, partial(log, ACES, 0.0, 0.6))),
    "hotel": Case("symmetric", partial(along_hotel, 4)),
    "hotel-no-odometry": Case("symmetric", no_odometry(partial(along_hotel, 2))),
    "office-carried": Case("carried", partial(office_carried, 11)),
    "office-carried-2": Case("carried", partial(office_carried, 7)),
    "hotel-carried": Case("carried", hotel_carried),
    **{f"inn-{number}-carried": Case("carried", partial(inn_carried, number)) for number in INNS},
    "intel-carried": Case("carried", partial(logs_carried, (INTEL, 0.0, 0.3), (INTEL, 0.62, 0.7))),
    "intel-carried-2": Case("carried", partial(logs_carried, (INTEL, 0.3, 0.55), (INTEL, 0.1, 0.2))),
    "wean-carried": Case("carried", partial(logs_carried, (WEAN1, 0.0, 0.8), (WEAN3, 0.1, 0.4))),
    "wings": Case("two-way loop", through_wings),
    "wings-carried": Case("carried", wings_carried),
    "wings-dead-third": Case("two-way loop", dead(0.3, through_wings)),
    "infinite-corridor": Case("two-way loop", partial(log, "slam_large/infinite-corridor-drift-hard.clf.gz", 0.0, 0.5)),
    "campus": Case("two-way loop", partial(log, "slam_large/freiburg-campus-raw.clf.gz", 0.0, 0.5)),
}  # fmt: skip


def run(drive: Drive, particles: int, seed: int) -> dict[str, float]:
    """Map a drive and return its errors and its cost."""
    mapper = rbpf.Mapper(rbpf.MapperConfig(particles=particles, threads=1), seed=seed)
    health, used = [], []
    begin = time.process_time()
    for k, reading in enumerate(drive.readings):
        info = mapper.update(reading.scan, reading.T_odom_base)
        if info.reason is None:
            used.append(k)
            health.append(info.health)
    finished, online = mapper.trajectory().T_map_base, mapper.online_trajectory().T_map_base
    cpu_s = time.process_time() - begin
    truth, doubted = drive.truth[used], np.array(health) < DOUBTFUL_BELOW
    known = np.isfinite(truth[:, 0])
    truth, doubted, finished, online = truth[known], doubted[known], finished[known], online[known]
    flagged, false = flags(truth, online, doubted)
    rms = [float(np.sqrt(np.mean(absolute_errors(ours, truth)[0] ** 2))) for ours in (finished, online)]
    return {
        "finished": rms[0], "online": rms[1], "flagged": flagged, "false": false,
        "cpu_s": cpu_s, "loops": mapper.stats.loops_closed,
    }  # fmt: skip


def flags(truth: NDArray[np.float64], online: NDArray[np.float64], doubted: NDArray[np.bool_]) -> tuple[float, float]:
    """Return which share of the way reported far off was doubted, NaN where there is none, and which of the rest."""
    begun = max(2, int(BEGUN * len(truth)))
    T_truth_map = se2.fit_rigid(truth[:begun, :2], online[:begun, :2])
    off_m = np.hypot(*(se2.compose(T_truth_map, online) - truth)[:, :2].T)
    way_m = np.concatenate([[0.0], np.hypot(*np.diff(truth[:, :2], axis=0).T)])
    way_m[way_m > CARRIED_M] = 0.0
    far = off_m > FAR_OFF_M
    far_m, near_m = way_m[far].sum(), way_m[~far].sum()
    flagged = way_m[far & doubted].sum() / far_m if far_m > 0.0 else np.nan
    return float(flagged), float(way_m[~far & doubted].sum() / near_m) if near_m > 0.0 else np.nan


def row(name: str, counts: list[int], seeds: list[int], data: Path) -> dict[str, Any]:
    """Return a case's figures with each number of particles: medians over the seeds."""
    case = CASES[name]
    line: dict[str, Any] = {"case": name, "kind": case.kind, "seeds": len(seeds)}
    drives = {seed: case.make(data, seed) for seed in seeds}
    line["scans"] = len(drives[seeds[0]].readings)
    for count in counts:
        line[str(count)] = medians([run(drives[seed], count, seed) for seed in seeds])
    return line


def medians(runs: list[dict[str, float]]) -> dict[str, float | None]:
    """Return the median of each figure, None where it is not a number."""
    return {
        key: None if np.isnan(value := float(np.median([one[key] for one in runs]))) else round(value, 3)
        for key in runs[0]
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=list(CASES), default=list(CASES))
    parser.add_argument("--particles", nargs="+", type=int, default=[1, 5, 30])
    parser.add_argument("--seeds", nargs="+", type=int, default=[1])
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("MRSLAM_DATA", "data")))
    args = parser.parse_args()
    load_kernels(["rbpf", "sim_driver.feeds"])
    rbpf.warm_up()
    for name in args.only:
        print(json.dumps(row(name, args.particles, args.seeds, args.data)), flush=True)


if __name__ == "__main__":
    main()
