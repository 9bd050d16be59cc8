"""Accuracy, CPU and memory of the mapper on recorded logs: one JSON line per (log, particles, seed).

    python bench/mapper.py LOG [LOG ...] [--particles 30] [--seeds 1 2 3] [--out DIR] [--no-odometry] [--threads 0]
                           [--beams 30]

A file LOG.relations beside LOG.clf.gz adds relation errors (Kuemmerle et al. 2009) of the finished and of the online
trajectory. ``--beams`` maps with this number of each scan's beams, evenly spread, the others without return.
``doubtful`` is the share of scans at which the pose was in doubt. CPU seconds are of the whole process from reading the
log on, without compiling.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam import rbpf
from mrslam.sim_driver.evaluate.doubtful import DOUBTFUL_BELOW
from mrslam.sim_driver.feeds import open_feed
from mrslam.sim_driver.kernels import load_kernels
from mrslam.sim_driver.missions.usage import peak_kb
from mrslam.spatial import Keyframes, Scan, se2
from mrslam.spatial.files import map_files
from mrslam.spatial.files.atomic import write_text
from mrslam.spatial.files.images import write_image


def thinned(scan: Scan, beams: int) -> Scan:
    """Return a scan of which only this number of beams, evenly spread, have a return."""
    ranges_m = np.full_like(scan.ranges_m, np.inf)
    kept = np.linspace(0, ranges_m.size - 1, beams).round().astype(np.int64)
    ranges_m[kept] = scan.ranges_m[kept]
    return replace(scan, ranges_m=ranges_m)


def run(
    log: Path, particles: int, seed: int, threads: int, odometry: bool, out: Path | None, beams: int
) -> dict[str, Any]:
    """Map one log and return its figures; ``beams`` : those of a scan that have a return, 0 = all."""
    load_kernels(["rbpf", "sim_driver.feeds"])
    rbpf.hand_over_quickly()
    wall, cpu = time.perf_counter(), time.process_time()
    readings = open_feed(log).readings
    parsed = time.process_time()
    config = rbpf.MapperConfig(particles=particles, threads=threads, use_odometry=odometry)
    mapper = rbpf.Mapper(config, seed=seed, clock=time.thread_time if threads == 1 else time.perf_counter)
    lasers, each, doubtful = [], [], 0
    for reading in readings:
        begin = time.perf_counter()
        info = mapper.update(thinned(reading.scan, beams) if beams else reading.scan, reading.T_odom_base)
        doubtful += info.health < DOUBTFUL_BELOW
        if info.processed:
            each.append(1e3 * (time.perf_counter() - begin))
        if info.reason is None:
            lasers.append(reading.scan.T_base_laser)
    finished, online = mapper.trajectory(), mapper.online_trajectory()
    result: dict[str, Any] = {
        "log": log.name.split(".")[0], "particles": particles, "seed": seed,
        "scans": mapper.stats.scans, "processed": mapper.stats.processed, "dropped": mapper.stats.dropped,
        "cpu_s": round(time.process_time() - cpu, 2), "parse_cpu_s": round(parsed - cpu, 2),
        "wall_s": round(time.perf_counter() - wall, 2),
        "ms_per_processed_p50": round(float(np.percentile(each, 50)), 2),
        "ms_per_processed_p95": round(float(np.percentile(each, 95)), 2),
        "peak_rss_mb": peak_kb() // 1024,
        "neff_min": round(mapper.stats.neff_min, 1), "resamplings": mapper.stats.resamplings,
        "loops_closed": mapper.stats.loops_closed, "doubtful": round(doubtful / mapper.stats.scans, 4),
        "stages_s": {stage: round(value, 2) for stage, value in mapper.stopwatch.seconds.items()},
    }  # fmt: skip
    relations = log.with_name(log.name.split(".")[0] + ".relations")
    for name, keyframes in (("finished", finished), ("online", online)):
        T_map_laser = se2.compose(keyframes.T_map_base, np.stack(lasers))
        if relations.exists():
            result[name] = relation_errors(relations, keyframes.stamps_ns, T_map_laser)
        if out is not None:
            suffix = "" if name == "finished" else "_online"
            write_tum(out / f"{result['log']}_{seed}" / f"trajectory{suffix}.tum", keyframes, T_map_laser)
    if out is not None:
        folder = out / f"{result['log']}_{seed}"
        write_image(folder / "map.png", map_files.pixels(mapper.snapshot().map.to_grid()))
    return result


def relation_errors(path: Path, stamps_ns: NDArray[np.int64], poses: NDArray[np.float64]) -> dict[str, float]:
    """Return mean translation (m) and rotation (deg) error over relations ``t1 t2 x y z roll pitch yaw``."""
    # imported here: it brings along what maps are judged by, and the peak of memory taken before is the mapper's
    from mrslam.sim_driver.evaluate.relations import own_errors, read_relations

    mean_m, mean_deg = own_errors(read_relations(path), stamps_ns, poses).mean(axis=0)
    return {"translation_m": round(float(mean_m), 4), "rotation_deg": round(float(mean_deg), 3)}


def write_tum(path: Path, keyframes: Keyframes, poses: NDArray[np.float64]) -> None:
    """Write ``t x y z qx qy qz qw`` lines."""
    lines = (
        f"{stamp / 1e9:.6f} {x:.6f} {y:.6f} 0 0 0 {np.sin(theta / 2):.8f} {np.cos(theta / 2):.8f}\n"
        for stamp, (x, y, theta) in zip(keyframes.stamps_ns, poses, strict=True)
    )
    write_text(path, "".join(lines))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", nargs="+", type=Path)
    parser.add_argument("--particles", nargs="+", type=int, default=[30])
    parser.add_argument("--seeds", nargs="+", type=int, default=[1])
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--no-odometry", action="store_true")
    parser.add_argument("--beams", type=int, default=0, help="of each scan that have a return; 0 = all")
    parser.add_argument("--out", type=Path, help="folder for trajectories and maps")
    args = parser.parse_args()
    rbpf.warm_up()
    context = multiprocessing.get_context("spawn")  # a process a run: peak memory is the run's own
    for log in args.logs:
        for particles in args.particles:
            for seed in args.seeds:
                with context.Pool(1) as pool:
                    job = (log, particles, seed, args.threads, not args.no_odometry, args.out, args.beams)
                    print(json.dumps(pool.apply(run, job)), flush=True)


if __name__ == "__main__":
    main()
