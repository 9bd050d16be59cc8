"""The files of ``mrslam map``: metrics, trajectories and the map of one log."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf import Mapper, Stats
from mrslam.sim_driver.evaluate.doubtful import Doubts, find_doubts
from mrslam.sim_driver.evaluate.relations import Relations, own_errors
from mrslam.sim_driver.feeds import Reading
from mrslam.sim_driver.missions.run_files import KEYFRAMES_FILE, MAP_FILE, METRICS_FILE
from mrslam.sim_driver.missions.usage import peak_kb
from mrslam.spatial import Keyframes, LocalMap, OccupancyGrid, se2, write_map
from mrslam.spatial.files.atomic import write_text
from mrslam.spatial.files.images import write_image
from mrslam.spatial.files.keyframes import write_keyframes
from mrslam.spatial.files.trinary import pixels
from mrslam.spatial.files.tum import write_tum

Metrics = dict[str, Any]


@dataclass
class Way:
    """How mapping went, scan by scan."""

    fed: int = 0
    accepted: list[int] = field(default_factory=list)
    """Scans that the mapper could use, by their place in the log."""
    health: list[float] = field(default_factory=list)
    """Health that the mapper reported with each scan that it could use, 0..1."""
    refused: Counter[str] = field(default_factory=Counter)
    """Number of scans that the mapper could not use, by the reason it gave."""
    processed_ms: list[float] = field(default_factory=list)
    """Wall time of each scan at which the filter was updated, milliseconds."""


@dataclass(frozen=True, eq=False)
class Mapped:
    """What a mapper knows at the end."""

    local: LocalMap
    grid: OccupancyGrid
    trajectory: Keyframes
    online: Keyframes
    """Each pose as it was estimated when its scan came."""
    stats: Stats
    particles: int

    @classmethod
    def by(cls, mapper: Mapper) -> Mapped:
        """Take it from a mapper."""
        local, particles = mapper.snapshot(), mapper.config.particles
        grid = local.map.to_grid()
        return cls(local, grid, mapper.trajectory(), mapper.online_trajectory(), mapper.stats, particles)


@dataclass(frozen=True, eq=False)
class Results:
    """The results of mapping a log."""

    local: LocalMap
    grid: OccupancyGrid
    metrics: Metrics
    trajectories: dict[str, tuple[NDArray[np.int64], NDArray[np.float64]]]
    """By file name: stamps ``(N,)`` ns and poses of the laser ``(N, 3)`` of all scans."""
    doubts: Doubts

    def write(self, out: Path) -> None:
        """Write ``map.*``, its keyframes, the trajectories and ``metrics.json``."""
        for name, poses in self.trajectories.items():
            write_tum(out / f"{name}.tum", *poses)
        write_map(out / MAP_FILE, self.grid)
        write_keyframes(out / KEYFRAMES_FILE, self.local.keyframes, self.local.key_scans)
        if self.grid.cells.size:
            write_image(out / "map.png", pixels(self.grid))
        write_text(out / METRICS_FILE, json.dumps(self.metrics, indent=1, allow_nan=False) + "\n")


def results_of(
    mapped: Mapped, readings: Sequence[Reading], way: Way, truth: Relations | None, known: Metrics
) -> Results:
    """Return the results after ``way.fed`` of the readings; ``known`` metrics come first."""
    doubts = find_doubts(mapped.trajectory.stamps_ns, np.array(way.health), readings[0].scan.stamp_ns)
    metrics = {**known, **_counts(mapped, way), "doubtful": asdict(doubts)}
    if way.fed < len(readings):
        metrics["interrupted_after_scans"] = way.fed
    fed = readings[: way.fed]
    trajectories = {
        name: _laser_poses(fed, way.accepted, found.T_map_base)
        for name, found in (("trajectory", mapped.trajectory), ("trajectory_online", mapped.online))
    }
    if truth is not None:
        metrics["relations"] = {name: _relation_errors(truth, *poses) for name, poses in trajectories.items()}
    return Results(mapped.local, mapped.grid, metrics, trajectories, doubts)


def _counts(mapped: Mapped, way: Way) -> Metrics:
    """Return how many scans were used and what they took."""
    return {
        "scans": way.fed,
        "scans_dropped": way.fed - len(way.accepted),
        "scans_processed": mapped.stats.processed,
        "ms_per_processed_p50": _percentile(way.processed_ms, 50),
        "ms_per_processed_p95": _percentile(way.processed_ms, 95),
        "peak_rss_mb": round(peak_kb() / 1024, 1),
        "neff_min": round(min(mapped.stats.neff_min, float(mapped.particles)), 3)
        if mapped.stats.processed > 1
        else 1.0,
        "resamplings": mapped.stats.resamplings,
        "known_area_m2": round(mapped.grid.known_area_m2(), 1),
    }


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
