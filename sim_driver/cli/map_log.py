"""``mrslam map``: one log, one mapper."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import typer
from numpy.typing import NDArray

from mrslam import rbpf
from mrslam.sim_driver.cli.console import say
from mrslam.sim_driver.cli.progress import progress_bar
from mrslam.sim_driver.evaluate.doubtful import find_doubts
from mrslam.sim_driver.evaluate.relations import Relations, own_errors, read_relations
from mrslam.sim_driver.feeds import Reading, open_feed
from mrslam.sim_driver.kernels import ensure_compiled
from mrslam.sim_driver.missions.locate import locate
from mrslam.sim_driver.missions.run_files import MAP_FILE, METRICS_FILE
from mrslam.sim_driver.missions.settings import build, with_overrides
from mrslam.sim_driver.missions.usage import peak_kb
from mrslam.sim_driver.view import watch_mapper
from mrslam.sim_driver.view.files import start_viewer
from mrslam.spatial import se2, write_map
from mrslam.spatial.files.atomic import make_folder, write_text
from mrslam.spatial.files.images import write_image
from mrslam.spatial.files.map_files import pixels
from mrslam.spatial.files.tum import write_tum

if TYPE_CHECKING:
    from mrslam.sim_driver.view.watch import MapperWatcher


def map_log(
    log: Path,
    particles: int,
    seed: int,
    out: Path,
    no_odometry: bool,
    assignments: list[str],
    as_json: bool,
    rrd: Path | None,
    view: bool,
    relations: Path | None = None,
    salvage: bool = False,
) -> None:
    """Map the log and write ``trajectory.tum``, ``trajectory_online.tum``, ``map.*`` and ``metrics.json``.

    Interrupted, it writes what it has by then.
    """
    table = {"particles": particles, **({"use_odometry": False} if no_odometry else {})}
    config = build(rbpf.MapperConfig, with_overrides({"rbpf": table}, assignments)["rbpf"], "rbpf")
    truth = None if relations is None else read_relations(locate(str(relations)))
    feed = open_feed(locate(str(log)), salvage=salvage)
    for note in feed.notes:
        say(f"{log.name}: {note}")
    make_folder(out)
    compile_s = ensure_compiled(say, ("rbpf",))
    rbpf.hand_over_quickly()
    wall, cpu = time.monotonic(), time.process_time()
    mapper = rbpf.Mapper(config, seed=seed)
    show = watch_mapper(mapper, rrd, start_viewer() if view else None, log.stem) if rrd is not None or view else None
    way = _feed_all(mapper, feed.readings, log.name, show)
    grid = mapper.snapshot().map.to_grid()
    trajectory, online = mapper.trajectory(), mapper.online_trajectory()
    metrics: dict[str, Any] = {
        "log": log.name,
        "seed": seed,
        "particles": config.particles,
        "wall_s": round(time.monotonic() - wall, 3),
        "cpu_s": round(time.process_time() - cpu, 3),
        "compile_s": round(compile_s, 3),
        "scans": way.fed,
        "scans_dropped": way.fed - len(way.accepted),
        "scans_processed": mapper.stats.processed,
        "ms_per_processed_p50": _percentile(way.processed_ms, 50),
        "ms_per_processed_p95": _percentile(way.processed_ms, 95),
        "peak_rss_mb": round(peak_kb() / 1024, 1),
        "neff_min": round(min(mapper.stats.neff_min, float(config.particles)), 3),
        "resamplings": mapper.stats.resamplings,
        "known_area_m2": round(grid.known_area_m2(), 1),
    }
    doubts = find_doubts(trajectory.stamps_ns, np.array(way.health))
    metrics["doubtful"] = asdict(doubts)
    if way.fed < len(feed.readings):
        metrics["interrupted_after_scans"] = way.fed
    for name, known in (("trajectory", trajectory), ("trajectory_online", online)):
        poses = _laser_poses(feed.readings[: way.fed], way.accepted, known.T_map_base)
        write_tum(out / f"{name}.tum", *poses)
        if truth is not None:
            metrics.setdefault("relations", {})[name] = _relation_errors(truth, *poses)
    write_map(out / MAP_FILE, grid)
    if grid.cells.size:
        write_image(out / "map.png", pixels(grid))
    write_text(out / METRICS_FILE, json.dumps(metrics, indent=1, allow_nan=False) + "\n")
    _report(metrics, out, as_json)
    if doubts.scans:
        say(doubts.text)
    if way.fed < len(feed.readings):
        say(f"interrupted after {way.fed} of {len(feed.readings)} scans: these are the results so far")
        raise typer.Exit(130)


@dataclass
class _Way:
    """How mapping went, scan by scan."""

    fed: int = 0
    accepted: list[int] = field(default_factory=list)
    """Scans that the mapper could use, by their place in the log."""
    health: list[float] = field(default_factory=list)
    """What the mapper thought of its pose at each scan that it could use, 0..1."""
    processed_ms: list[float] = field(default_factory=list)
    """What each scan took that the particles took, wall time."""


def _feed_all(mapper: rbpf.Mapper, readings: Sequence[Reading], name: str, show: MapperWatcher | None) -> _Way:
    """Map all readings, or those until Ctrl-C."""
    way = _Way()
    with suppress(KeyboardInterrupt), progress_bar(f"mapping {name}", len(readings)) as advance:
        for index, reading in enumerate(readings):
            start = time.perf_counter()
            info = mapper.update(reading.scan, reading.T_odom_base)
            way.fed = index + 1
            if info.processed:
                way.processed_ms.append((time.perf_counter() - start) * 1e3)
            if info.reason is None:
                way.accepted.append(index)
                way.health.append(info.health)
            if show is not None:
                show.on_scan(reading.scan)
            advance()
    if show is not None:
        show.close()
    return way


def _relation_errors(
    truth: Relations, stamps_ns: NDArray[np.int64], poses: NDArray[np.float64]
) -> dict[str, float | int | None]:
    """Return mean errors over the relations whose two stamps are in the trajectory, and how many of all those are."""
    errors = own_errors(truth, stamps_ns, poses)
    mean_m, mean_deg = errors.mean(axis=0).tolist() if len(errors) else (None, None)
    return {"relations": len(errors), "relations_given": len(truth[0]), "mean_m": mean_m, "mean_deg": mean_deg}


def _percentile(values: list[float], share: float) -> float:
    return round(float(np.percentile(values, share)), 3) if values else 0.0


def _laser_poses(
    readings: Sequence[Reading], accepted: Sequence[int], T_map_base: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return stamps and laser poses of all scans; scans the mapper could not use are carried on by odometry."""
    poses = np.zeros((len(readings), 3))
    poses[list(accepted)] = T_map_base
    usable = set(accepted)
    for i in range(1, len(readings)):
        T_odom_before, T_odom_now = readings[i - 1].T_odom_base, readings[i].T_odom_base
        if i in usable:
            continue
        poses[i] = poses[i - 1]
        if T_odom_before is not None and T_odom_now is not None:
            poses[i] = se2.compose(poses[i - 1], se2.between(T_odom_before, T_odom_now))
    stamps_ns = np.array([reading.scan.stamp_ns for reading in readings], dtype=np.int64)
    return stamps_ns, se2.compose(poses, np.array([reading.scan.T_base_laser for reading in readings]))


def _report(metrics: dict[str, Any], out: Path, as_json: bool) -> None:
    if as_json:
        print(json.dumps(metrics))
        return
    say(
        f"{metrics['scans']} scans, {metrics['scans_processed']} filter updates, {metrics['known_area_m2']:g} m2 in "
        f"{metrics['wall_s']:.1f} s ({metrics['cpu_s']:.1f} s of CPU, {metrics['peak_rss_mb']:.0f} MB)"
    )
    for name, found in metrics.get("relations", {}).items():
        used, given = found["relations"], found["relations_given"]
        text = f"none of {given} relations lies within it"
        if used:
            text = f"{found['mean_m']:.4f} m, {found['mean_deg']:.3f} deg over {used} of {given} relations"
        say(f"{name}: {text}")
    say(f"{out}/map.png, map.yaml, trajectory.tum, metrics.json")
