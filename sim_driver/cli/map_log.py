"""``mrslam map``: one log, one mapper."""

from __future__ import annotations

import json
import resource
import time
from pathlib import Path
from typing import Any

import numpy as np

import rbpf
from sim_driver.cli.console import console, progress_bar
from sim_driver.feeds import open_feed
from sim_driver.kernels import ensure_compiled
from sim_driver.locate import locate
from sim_driver.settings import build, with_overrides
from spatial import Keyframes, Scan, se2, write_map
from spatial.files import write_text
from spatial.images import write_image
from spatial.map_files import pixels
from spatial.tum import write_tum


def map_log(log: Path, particles: int, seed: int, out: Path, no_odometry: bool, assignments: list[str], as_json: bool) -> None:
    """Map the log and write ``trajectory.tum``, ``trajectory_online.tum``, ``map.*`` and ``metrics.json``."""
    table = {"particles": particles, **({"use_odometry": False} if no_odometry else {})}
    config = build(rbpf.MapperConfig, with_overrides({"rbpf": table}, assignments)["rbpf"], "rbpf")
    feed = open_feed(locate(str(log)))
    for note in feed.notes:
        console.print(f"{log.name}: {note}", highlight=False)
    compile_s = ensure_compiled(console.print)
    wall, cpu = time.monotonic(), time.process_time()
    mapper = rbpf.Mapper(config, seed=seed)
    processed_ms: list[float] = []
    scans: list[Scan] = []
    with progress_bar(f"mapping {log.name}", len(feed.readings)) as advance:
        for reading in feed.readings:
            start = time.perf_counter()
            info = mapper.update(reading.scan, reading.T_odom_base)
            if info.processed:
                processed_ms.append((time.perf_counter() - start) * 1e3)
            scans.append(reading.scan)
            advance()
    grid = mapper.snapshot().map.to_grid()
    trajectory, online = mapper.trajectory(), mapper.online_trajectory()
    metrics = {
        "log": log.name,
        "seed": seed,
        "particles": config.particles,
        "wall_s": round(time.monotonic() - wall, 3),
        "cpu_s": round(time.process_time() - cpu, 3),
        "compile_s": round(compile_s, 3),
        "scans": len(feed.readings),
        "scans_processed": mapper.stats.processed,
        "ms_per_processed_p50": _percentile(processed_ms, 50),
        "ms_per_processed_p95": _percentile(processed_ms, 95),
        "peak_rss_mb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, 1),
        "neff_min": round(float(mapper.stats.neff_min), 3),
        "resamplings": mapper.stats.resamplings,
        "known_area_m2": round(grid.known_area_m2(), 1),
    }
    write_tum(out / "trajectory.tum", *_at_laser(trajectory, scans))
    write_tum(out / "trajectory_online.tum", *_at_laser(online, scans))
    write_map(out / "map.yaml", grid)
    if grid.cells.size:
        write_image(out / "map.png", pixels(grid))
    write_text(out / "metrics.json", json.dumps(metrics, indent=1, allow_nan=False) + "\n")
    _report(metrics, out, as_json)


def _percentile(values: list[float], share: float) -> float:
    return round(float(np.percentile(values, share)), 3) if values else 0.0


def _at_laser(trajectory: Keyframes, scans: list[Scan]) -> tuple[Any, Any]:
    """Return stamps and poses of the laser."""
    T_base_laser = np.array([scan.T_base_laser for scan in scans])
    return trajectory.stamps_ns, se2.compose(trajectory.T_map_base, T_base_laser)


def _report(metrics: dict[str, Any], out: Path, as_json: bool) -> None:
    if as_json:
        print(json.dumps(metrics))
        return
    console.print(
        f"{metrics['scans']} scans, {metrics['scans_processed']} filter updates, {metrics['known_area_m2']:g} m2 mapped in "
        f"{metrics['wall_s']:.1f} s ({metrics['cpu_s']:.1f} s of CPU, {metrics['peak_rss_mb']:.0f} MB)",
        highlight=False,
    )
    console.print(f"{out}/map.png, map.yaml, trajectory.tum, metrics.json", highlight=False)
