"""Two robots in one building of rooms and corridors: what they see, and maps of it that are bent in their own ways."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mrslam.merge import Trail
from mrslam.spatial import Keyframes, KeyScans, LocalMap, OccupancyGrid, TiledMap, se2

BEAMS, RANGE_M = 180, 15.0


def walls(seed: int = 0) -> np.ndarray:
    """Segments ``(S, 4)`` x0 y0 x1 y1 of a ring of corridors, 30 x 20 m, 2.5 m wide, with niches of random width."""
    rng = np.random.default_rng(seed)
    out = []
    for x0, y0, x1, y1 in ((0.0, 0.0, 30.0, 20.0), (2.5, 2.5, 27.5, 17.5)):
        corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]
        for (ax, ay), (bx, by) in pairwise(corners):
            out += niched(rng, np.array([ax, ay]), np.array([bx, by]), outward=(x0 == 0.0))
    return np.array(out)


def niched(rng, a, b, outward: bool) -> list:
    length = float(np.hypot(*(b - a)))
    along = (b - a) / length
    across = np.array([along[1], -along[0]]) * (1.0 if outward else -1.0)
    at, points = 0.5, [a]
    while at < length - 2.5:
        at += rng.uniform(0.8, 2.5)
        wide, deep = rng.uniform(0.5, 1.2), rng.uniform(0.3, 0.7)
        if at + wide > length - 0.5:
            break
        for s, d in ((at, 0.0), (at, deep), (at + wide, deep), (at + wide, 0.0)):
            points.append(a + s * along + d * across)
        at += wide
    points.append(b)
    return [(*p, *q) for p, q in pairwise(points)]


def scan(segments: np.ndarray, pose: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Points ``(n, 2)`` that a full turn of beams hits from ``pose``, base frame, with 1 cm of noise."""
    angles = np.linspace(-np.pi, np.pi, BEAMS, endpoint=False)
    d = np.stack([np.cos(angles + pose[2]), np.sin(angles + pose[2])], axis=1)
    p, e = segments[:, :2] - pose[:2], segments[:, 2:] - segments[:, :2]
    cross = d[:, None, 0] * e[None, :, 1] - d[:, None, 1] * e[None, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (p[None, :, 0] * e[None, :, 1] - p[None, :, 1] * e[None, :, 0]) / cross
        u = (p[None, :, 0] * d[:, None, 1] - p[None, :, 1] * d[:, None, 0]) / cross
    ranges = np.where((t > 0.05) & (u >= 0.0) & (u <= 1.0), t, np.inf).min(axis=1)
    hit = ranges < RANGE_M
    ranges = ranges + rng.normal(0.0, 0.01, ranges.shape)
    return (ranges[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1))[hit]


def around(start_m: float, way_m: float, step_m: float = 0.5) -> np.ndarray:
    """True poses ``(K, 3)`` along the middle of the ring, counterclockwise, from ``start_m`` on for ``way_m``."""
    corners = np.array([(1.25, 1.25), (28.75, 1.25), (28.75, 18.75), (1.25, 18.75), (1.25, 1.25)])
    lengths = np.hypot(*np.diff(corners, axis=0).T)
    ends = np.cumsum(lengths)
    poses = []
    for s in np.arange(start_m, start_m + way_m, step_m) % ends[-1]:
        side = int(np.searchsorted(ends, s, side="right"))
        along = np.diff(corners, axis=0)[side] / lengths[side]
        place = corners[side] + (s - (ends[side] - lengths[side])) * along
        poses.append((*place, np.arctan2(along[1], along[0])))
    return np.array(poses)


@dataclass
class Drive:
    """One robot's way: where it was, and what its map makes of it."""

    truth: np.ndarray
    trail: Trail


def drive(start_m: float, way_m: float, turn_per_m: float = 0.0, seed: int = 0) -> Drive:
    """A robot whose map turns by ``turn_per_m`` (rad/m) too much along its way; its frame is its first pose."""
    rng, segments = np.random.default_rng(seed), walls()
    truth = around(start_m, way_m)
    steps = se2.between(truth[:-1], truth[1:])
    steps[:, 2] += turn_per_m * 0.5
    own = np.zeros_like(truth)
    for k, step in enumerate(steps):
        own[k + 1] = se2.compose(own[k], step)
    scans = KeyScans.of_points([thinned(scan(segments, pose, rng)) for pose in truth], np.zeros((len(truth), 2)))
    return Drive(truth, Trail(own, scans))


def thinned(points: np.ndarray) -> np.ndarray:
    """At most 60 of the points, evenly."""
    return points[np.linspace(0, len(points) - 1, min(60, len(points))).astype(int)]


def errors_m(a: Drive, b: Drive, T_team_a: np.ndarray, T_team_b: np.ndarray) -> np.ndarray:
    """Error of every keyframe of b as seen from the nearest true one of a, ``(K,)`` metres."""
    away = np.hypot(*(a.truth[:, None, :2] - b.truth[None, :, :2]).transpose(2, 0, 1))
    near = away.argmin(axis=0)
    error = se2.between(a.truth[near], b.truth) - se2.between(T_team_a[near], T_team_b)
    return np.hypot(error[:, 0], error[:, 1])[away.min(axis=0) < 1.0]


def local_map(drive_: Drive, revision: int = 1, keyframes: int | None = None) -> LocalMap:
    """The robot's map of its way, as it would publish it."""
    trail = drive_.trail
    count = len(trail) if keyframes is None else keyframes
    poses, scans = trail.T_map_key[:count], trail.scans.part(0, count)
    stamps = np.arange(count) * 1_000_000_000
    tiles = TiledMap.from_grid(drawn(trail, count), revision)
    return LocalMap(tiles, Keyframes(stamps, poses), scans)


def drawn(trail: Trail, count: int, resolution_m: float = 0.05) -> OccupancyGrid:
    """Free space along the beams of the scans, walls where they end."""
    cells = np.full((1400, 1400), -1, dtype=np.int8)
    hits = []
    for k in range(count):
        pose, points = trail.T_map_key[k], trail.scans.of(k).astype(float)
        ends = se2.apply(pose, points)
        for share in np.linspace(0.0, 0.98, 300):
            at = np.floor((pose[:2] + share * (ends - pose[:2])) / resolution_m).astype(int) + 700
            cells[at[:, 1], at[:, 0]] = 0
        hits.append(np.floor(ends / resolution_m).astype(int) + 700)
    wall = np.concatenate(hits)
    cells[wall[:, 1], wall[:, 0]] = 100
    return OccupancyGrid.at_cell(cells, resolution_m, -700, -700).cropped()
