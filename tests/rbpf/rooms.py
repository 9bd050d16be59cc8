"""A made-up room and a laser in it, for tests."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf import Mapper, MapperConfig
from mrslam.rbpf.front_end.motion import Keyframe
from mrslam.rbpf.front_end.sight import Sight
from mrslam.spatial import Scan, se2
from mrslam.spatial.hits.store import TileStore
from mrslam.spatial.hits.views import NO_ENDS, Beams
from mrslam.spatial.matching.scan_points import scan_points

SMALL = MapperConfig(particles=6, threads=1)

WALLS = np.array(
    [
        [0, 0, 10, 0], [10, 0, 10, 6], [10, 6, 0, 6], [0, 6, 0, 0],
        [3, 0, 3, 1.5], [3, 1.5, 4.5, 1.5], [7, 6, 7, 4], [6, 3, 6.6, 3.4], [1, 5, 1.8, 5],
    ],
    dtype=float,
)  # fmt: skip
T_WORLD_START = np.array([1.5, 3.0, np.pi / 2])


def ranges_at(T_world_laser: NDArray[np.float64], angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances to the nearest wall along each beam."""
    directions = angles + T_world_laser[2]
    dx, dy = np.cos(directions)[:, None], np.sin(directions)[:, None]
    x0, y0, x1, y1 = WALLS.T
    ex, ey = x1 - x0, y1 - y0
    det = dx * -ey + dy * ex
    with np.errstate(divide="ignore", invalid="ignore"):
        ax, ay = x0 - T_world_laser[0], y0 - T_world_laser[1]
        t = (ax * -ey + ay * ex) / det
        u = (dx * ay - dy * ax) / det
    hit = (np.abs(det) > 1e-12) & (t > 0) & (u >= 0) & (u <= 1)
    return np.where(hit, t, np.inf).min(axis=1)


def make_scan(
    T_map_base: NDArray[np.float64],
    stamp_ns: int,
    beams: int = 180,
    fov: float = np.pi,
    rng: np.random.Generator | None = None,
    T_base_laser: tuple[float, float, float] = (0.0, 0.0, 0.0),
    clockwise: bool = False,
) -> Scan:
    """A scan from a pose given relative to the start."""
    first, step = -fov / 2, fov / beams
    if clockwise:
        first, step = first + step * (beams - 1), -step
    angles = first + step * np.arange(beams)
    T_world_laser = se2.compose(se2.compose(T_WORLD_START, T_map_base), np.array(T_base_laser))
    ranges = ranges_at(T_world_laser, angles)
    if rng is not None:
        ranges = ranges + rng.normal(0.0, 0.01, ranges.size)
    return Scan(
        stamp_ns=stamp_ns, ranges_m=ranges.astype(np.float32), angle_min_rad=first, angle_increment_rad=step,
        range_max_m=30.0, T_base_laser=np.array(T_base_laser),
    )  # fmt: skip


def keyframe(
    motion: NDArray[np.float64], T_map_base: NDArray[np.float64], rng: np.random.Generator | None, blind_m: float = 0.0
) -> Keyframe:
    """A keyframe after this local motion, in truth at this pose from the start; without ``rng`` it sees nothing.

    ``blind_m`` : error of the motion to expect along it.
    """
    points = np.empty((0, 5))
    if rng is not None:
        points = Sight(MapperConfig()).points(make_scan(T_map_base, 0, rng=rng)).copy()
    arrival = np.array([*motion, np.hypot(*motion[:2]), blind_m, 0.0, 0.0, 0.0, 0.0])
    return Keyframe(beams=Beams(np.zeros(2), points, NO_ENDS), arrival=arrival, inliers=1.0)


def drive(steps: int) -> NDArray[np.float64]:
    """Poses of a round through the room, relative to the start: out along x, and back turned round."""
    s = np.linspace(0.0, 1.0, steps)
    theta = 2.0 * np.pi * s
    x = 3.0 - 3.0 * np.cos(theta)
    y = 0.9 * np.sin(theta)
    heading = np.unwrap(np.arctan2(0.9 * np.cos(theta), 3.0 * np.sin(theta)))
    poses = np.stack([x, y, se2.wrap(heading)], axis=1)
    return se2.between(poses[0], poses)


def feed(mapper: Mapper, poses: np.ndarray, odometry: np.ndarray | None = None, start: int = 0, **kw: object) -> None:
    rng = np.random.default_rng(9)
    odometry = poses if odometry is None else odometry
    for k, pose in enumerate(poses):
        scan = make_scan(pose, k * 10**8, rng=rng, **kw)  # type: ignore[arg-type]
        if k >= start:
            mapper.update(scan, odometry[k])


def errors(mapper: Mapper, truth: np.ndarray) -> tuple[float, float]:
    gap = se2.between(truth, mapper.trajectory().T_map_base)
    return float(np.hypot(gap[:, 0], gap[:, 1]).max()), float(np.abs(gap[:, 2]).max())


def seen_room(noise: float = 0.0) -> tuple[TileStore, np.ndarray]:
    """A map with one scan of the room in it, and the scan's points ``(N, 5)``."""
    points = seen_from(np.zeros(3), noise)
    return drawn(points, np.zeros(3)), points


def seen_from(T_map_base: NDArray[np.float64], noise: float = 0.0) -> np.ndarray:
    """Points ``(N, 5)`` of a scan all round from a pose relative to the start."""
    scan = make_scan(T_map_base, 0, beams=360, fov=2 * np.pi, rng=np.random.default_rng(1) if noise else None)
    buffer = np.zeros((360, 5))
    angles = scan.angles_rad
    n = scan_points(scan.ranges_m, np.cos(angles), np.sin(angles), scan.T_base_laser, 40.0, buffer)
    return buffer[:n]


def drawn(points: np.ndarray, *T_map_base: np.ndarray) -> TileStore:
    """A map with a scan's ``points (N, 5)`` in it, seen from each of the poses ``(3,)``."""
    store = TileStore(1, 0.05)
    store.cover(np.full(2, -20.0), np.full(2, 20.0))
    for pose in T_map_base:
        store.draw(0, np.zeros((1, 2)), pose[None], [points], 0.1)
    return store


def word_at(store: TileStore, row: int, col: int) -> int:
    """The word of one cell of a store's only map."""
    table = store.tables[0]
    return int(store.pool[table[(row >> 5) - store.row0, (col >> 5) - store.col0], ((row & 31) << 5) | (col & 31)])
