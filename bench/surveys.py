"""Scans of a building with their true poses, from a drive about a floor plan or from a recorded log."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numba import njit
from scipy import ndimage, sparse
from scipy.sparse.csgraph import dijkstra

from mrslam.sim_driver.feeds.carmen import CarmenFeed
from mrslam.sim_driver.worlds import office

RES = 0.05
"""Cell that plans are read at, metres."""
LATTICE_M = 0.2
"""Cell that a drive's way is searched on, metres."""


@dataclass
class Survey:
    """Scans of one building in its world frame: poses ``(N, 3)``, end points ``(B, 2)`` m and hit flags per scan."""

    name: str
    kind: str
    poses: np.ndarray
    ends: list[np.ndarray]
    hits: list[np.ndarray]


@njit(nogil=True)
def cast(wall, x, y, angle, range_cells):  # type: ignore[no-untyped-def]
    """Return the free range in cells."""
    dx, dy = math.cos(angle) * 0.25, math.sin(angle) * 0.25
    for k in range(int(range_cells * 4)):
        r, c = int(y + dy * k), int(x + dx * k)
        if r < 0 or c < 0 or r >= wall.shape[0] or c >= wall.shape[1]:
            return -1.0
        if wall[r, c]:
            return 0.25 * k
    return -1.0


def read_plan(path: Path, scale: float) -> np.ndarray:
    """Return the plan's walls ``(H, W) bool``, row 0 at the bottom, cells of ``RES``."""
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    size = (round(image.shape[1] * scale / RES), round(image.shape[0] * scale / RES))
    dark = cv2.resize((image < 90).astype(np.uint8) * 255, size, interpolation=cv2.INTER_AREA)[::-1] > 60
    return np.pad(np.ascontiguousarray(dark), 2, constant_values=False)


def free_inside(wall: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where a robot may drive, the largest connected part inside the building, and the clearance, metres."""
    room = ndimage.distance_transform_edt(~wall) * RES
    labels, count = ndimage.label((room > 0.35) & (room < 12.0))
    border = set(np.unique(np.concatenate([labels[3], labels[-4], labels[:, 3], labels[:, -4]])))
    for open_to_outside in (border, set()):
        sizes = [0 if k == 0 or k in open_to_outside else int((labels == k).sum()) for k in range(count + 1)]
        best = int(np.argmax(sizes))
        if sizes[best] * RES**2 >= 30.0:
            break
    return labels == best, room


def way_through(inside: np.ndarray, room: np.ndarray, length_m: float, rng: np.random.Generator) -> np.ndarray:
    """Return poses every 0.3 m along a drive from one random place to the next, keeping off the walls."""
    step = round(LATTICE_M / RES)
    open_, clear = inside[::step, ::step], room[::step, ::step]
    node = np.full(open_.shape, -1)
    node[open_] = np.arange(open_.sum())
    at = np.argwhere(open_)
    rows, cols, costs = [], [], []
    for dr, dc in ((0, 1), (1, 0), (1, 1), (1, -1)):
        r, c = at[:, 0] + dr, at[:, 1] + dc
        ok = (r < open_.shape[0]) & (c >= 0) & (c < open_.shape[1])
        ok[ok] = open_[r[ok], c[ok]]
        cost = math.hypot(dr, dc) * (1.0 + 1.0 / clear[r[ok], c[ok]])
        rows.append(node[at[ok, 0], at[ok, 1]])
        cols.append(node[r[ok], c[ok]])
        costs.append(cost)
    graph = sparse.coo_matrix(
        (np.concatenate(costs), (np.concatenate(rows), np.concatenate(cols))), shape=(len(at), len(at))
    ).tocsr()
    here, points, driven = int(rng.integers(len(at))), [], 0.0
    for _ in range(400):
        distance, before = dijkstra(graph, directed=False, indices=here, return_predecessors=True)
        reachable = np.flatnonzero(np.isfinite(distance))
        there = int(rng.choice(reachable))
        leg = [there]
        while leg[-1] != here:
            leg.append(int(before[leg[-1]]))
        points += leg[::-1][:-1]
        driven += len(leg) * LATTICE_M * 1.2
        here = there
        if driven > length_m:
            break
    way = (at[points] + 0.5) * LATTICE_M
    way = np.stack([ndimage.gaussian_filter1d(way[:, 1], 2.0), ndimage.gaussian_filter1d(way[:, 0], 2.0)], axis=-1)
    gone = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))])
    places = np.arange(0.0, gone[-1], 0.3)
    x, y = np.interp(places, gone, way[:, 0]), np.interp(places, gone, way[:, 1])
    return np.stack([x, y, np.arctan2(np.gradient(y), np.gradient(x))], axis=-1)


def office_walls(seed: int) -> np.ndarray:
    """Return the walls of an office floor drawn at random, as :func:`read_plan` does, between 25 and 60 m long."""
    grid = office(seed, 25.0 + 7.0 * (seed % 6))
    return np.pad(grid.is_occupied, 4, constant_values=True)


def survey_plan(name: str, wall: np.ndarray, rng: np.random.Generator) -> Survey:
    """Drive about a floor plan ``(H, W) bool``, cells of ``RES``, with a laser of random reach and field of view."""
    inside, room = free_inside(wall)
    way = way_through(inside, room, min(600.0, 0.6 * float(inside.sum()) * RES**2 + 30.0), rng)
    reach = float(rng.choice([5.6, 10.0, 20.0, 30.0]))
    field = float(rng.choice([math.pi, 1.5 * math.pi, 2 * math.pi]))
    poses, ends, hits = [], [], []
    beams = np.linspace(-0.5 * field, 0.5 * field, int(field / math.radians(1.0)))
    for x, y, heading in way:
        r, c = int(y / RES), int(x / RES)
        if not (0 <= r < wall.shape[0] and 0 <= c < wall.shape[1]) or wall[r, c]:
            continue
        ranges = np.array([cast(wall, x / RES, y / RES, heading + t, reach / RES) for t in beams]) * RES
        hit = ranges > 0
        length = np.where(hit, ranges + 0.5 * RES + rng.normal(0, 0.012, len(beams)), reach)
        keep = hit | (rng.random(len(beams)) < 0.5)
        poses.append([x, y, heading])
        ends.append(np.stack([length * np.cos(beams), length * np.sin(beams)], axis=-1)[keep])
        hits.append(hit[keep])
    return Survey(name, "sim", np.array(poses), ends, hits)


def survey_log(stem: Path) -> Survey:
    """Take a log's scans at its reference poses, at most about one every 0.3 m."""
    reference = np.loadtxt(f"{stem}.reference.tum")
    readings = CarmenFeed(Path(f"{stem}.clf.gz")).readings
    stamps = np.array([r.scan.stamp_ns for r in readings]) * 1e-9
    poses, ends, hits = [], [], []
    last = np.full(2, np.inf)
    for row in reference:
        k = int(np.argmin(np.abs(stamps - row[0])))
        pose = np.array([row[1], row[2], 2 * math.atan2(row[6], row[7])])
        if abs(stamps[k] - row[0]) > 0.02 or np.hypot(*(pose[:2] - last)) < 0.3:
            continue
        last = pose[:2]
        scan = readings[k].scan
        ranges = np.asarray(scan.ranges_m, dtype=np.float64)
        hit = np.isfinite(ranges) & (ranges < 40.0)
        angles = scan.angles_rad[hit]
        poses.append(pose)
        ends.append(np.stack([ranges[hit] * np.cos(angles), ranges[hit] * np.sin(angles)], axis=-1))
        hits.append(np.ones(int(hit.sum()), dtype=bool))
    return Survey(stem.name, "real", np.array(poses), ends, hits)
