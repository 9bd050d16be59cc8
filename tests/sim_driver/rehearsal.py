"""A mission without the rest of the system: robots that know their true pose, and a map drawn by plain ray tracing."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numba import njit

from mrslam.sim_driver.drivers import Driver, DriverConfig, Explorer
from mrslam.sim_driver.robots import LASERS, Fleet, SimulatedRobot
from mrslam.sim_driver.worlds import World
from mrslam.spatial import OccupancyGrid, se2
from mrslam.spatial.traversal import traverse

STEP_NS = 100_000_000


@njit(cache=True, nogil=True)
def draw(hits, misses, x, y, ends, is_hit):
    rows, cols = np.empty(20_000, dtype=np.int32), np.empty(20_000, dtype=np.int32)
    for i in range(ends.shape[0]):
        count = traverse(x, y, ends[i, 0], ends[i, 1], rows, cols)
        for j in range(count):
            r, c = rows[j], cols[j]
            if 0 <= r < hits.shape[0] and 0 <= c < hits.shape[1]:
                if j == count - 1 and is_hit[i]:
                    hits[r, c] += 1
                else:
                    misses[r, c] += 1


class TrueMapper:
    """A map by counting hits and misses from known poses, in a frame that is the robot's start pose."""

    def __init__(self, world: World, T_world_map, resolution_m=0.05):
        self.T_world_map, self.resolution_m = T_world_map, resolution_m
        reach = int(np.hypot(*world.size_m) / resolution_m) + 20
        self.cell0 = -reach
        self.hits = np.zeros((2 * reach, 2 * reach), dtype=np.int32)
        self.misses = np.zeros_like(self.hits)

    def update(self, T_world_base, scan):
        T_map_laser = se2.compose(se2.between(self.T_world_map, T_world_base), scan.T_base_laser)
        ranges, angles = scan.ranges_m, scan.angles_rad
        valid = ~np.isnan(ranges)
        is_hit = np.isfinite(ranges[valid])
        length = np.where(is_hit, ranges[valid], min(scan.range_max_m, 10.0))
        ends = np.stack([length * np.cos(angles[valid]), length * np.sin(angles[valid])], axis=-1)
        ends = se2.apply(T_map_laser, ends) / self.resolution_m - self.cell0
        x, y = T_map_laser[:2] / self.resolution_m - self.cell0
        draw(self.hits, self.misses, x, y, ends, is_hit)

    def grid(self) -> OccupancyGrid:
        total = self.hits + self.misses
        share = np.round(100 * self.hits / np.maximum(total, 1))
        cells = np.where(total > 0, share, -1).astype(np.int8)
        return OccupancyGrid.at_cell(cells, self.resolution_m, self.cell0, self.cell0).cropped(2)


@dataclass
class Outcome:
    finished_s: dict[str, float] = field(default_factory=dict)
    coverage: list[tuple[float, float]] = field(default_factory=list)
    collisions: dict[str, int] = field(default_factory=dict)
    tracks: dict[str, list] = field(default_factory=dict)
    fleet: Fleet | None = None


def rehearse(
    world: World,
    robots: int,
    seed: int,
    duration_s: float,
    laser: str = "lidar-360",
    share_map: bool = True,
    config: DriverConfig | None = None,
    drivers: dict[str, Driver] | None = None,
) -> Outcome:
    """Robots explore the world; with ``share_map`` they draw one map together and know of each other."""
    rng = np.random.default_rng(seed)
    starts: dict[str, np.ndarray] = {}
    for i in range(robots):
        taken = np.array([start[:2] for start in starts.values()]).reshape(-1, 2)
        starts[f"r{i}"] = world.free_start(rng, 0.3, taken)
    fleet = Fleet(
        {name: SimulatedRobot(world, start, LASERS[laser], rng.spawn(1)[0]) for name, start in starts.items()}
    )
    drivers = drivers or {name: Explorer(config, seed=i) for i, name in enumerate(fleet.robots)}
    one = TrueMapper(world, starts["r0"])
    mappers = {name: one if share_map else TrueMapper(world, starts[name]) for name in fleet.robots}
    outcome = Outcome(fleet=fleet, tracks={name: [] for name in fleet.robots})
    commands = {}
    for step in range(round(duration_s * 10)):
        now_ns = step * STEP_NS
        for seen in fleet.observe(now_ns):
            name, mapper = seen.robot_id, mappers[seen.robot_id]
            if step % 5 == 0:
                mapper.update(seen.T_world_base, seen.scan)
            poses = {other: se2.between(mapper.T_world_map, T) for other, T in fleet.T_world_base().items()}
            T_map_base = poses.pop(name)
            grid = mapper.grid() if step % 10 == 0 else None
            latest = outcome.__dict__.setdefault("_grids", {})
            if grid is not None:
                latest[name] = grid
            commands[name] = drivers[name].command(
                now_ns, T_map_base, latest[name], poses if share_map else {}, seen.scan
            )
            outcome.tracks[name].append(seen.T_world_base)
            if drivers[name].finished and name not in outcome.finished_s:
                outcome.finished_s[name] = now_ns / 1e9
            elif not drivers[name].finished:
                outcome.finished_s.pop(name, None)
        if step % 50 == 0:
            outcome.coverage.append((now_ns / 1e9, coverage(world, list(mappers.values()))))
        fleet.step(commands)
        if len(outcome.finished_s) == robots:
            break
    outcome.coverage.append((now_ns / 1e9, coverage(world, list(mappers.values()))))
    outcome.collisions = {name: robot.collisions for name, robot in fleet.robots.items()}
    return outcome


def coverage(world: World, mappers: list[TrueMapper]) -> float:
    """Return the share of the world's reachable floor that is free in any of the maps."""
    points = world.grid.centres(world.reachable)
    known = np.zeros(len(points), dtype=bool)
    for mapper in {id(m): m for m in mappers}.values():
        col, row = np.floor(se2.apply(se2.inverse(mapper.T_world_map), points) / mapper.resolution_m).astype(int).T
        known |= mapper.misses[row - mapper.cell0, col - mapper.cell0] > 0
    return float(known.mean())
