"""Kernels against slow, obvious twins."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.rbpf.crew import Crew
from mrslam.rbpf.filter.trajectory import spread
from mrslam.rbpf.loops.graph import Edges, relax
from mrslam.rbpf.match.correlative import Lattice, search
from mrslam.rbpf.match.gauss_newton import match
from mrslam.rbpf.match.nearest import nearest
from mrslam.rbpf.match.scan_points import UNSURE, scan_points, spaced
from mrslam.rbpf.tiles.cells import add_hit, add_pass, hits_of, visits_of
from mrslam.rbpf.tiles.publisher import EDGES, LEVELS, quantise
from mrslam.rbpf.tiles.store import TileStore
from mrslam.spatial import se2
from mrslam.spatial.poses import between, compose
from tests.rbpf.rooms import make_scan


def seen_room(noise: float = 0.0) -> tuple[TileStore, np.ndarray]:
    scan = make_scan(np.zeros(3), 0, beams=360, fov=2 * np.pi, rng=np.random.default_rng(1) if noise else None)
    buffer = np.zeros((360, 5))
    angles = scan.angles_rad
    n = scan_points(scan.ranges_m, np.cos(angles), np.sin(angles), scan.T_base_laser, 40.0, buffer)
    store = TileStore(1, 0.05)
    store.cover(np.full(2, -20.0), np.full(2, 20.0))
    store.draw(0, np.zeros((1, 2)), np.zeros((1, 3)), [buffer[:n]], 0.1)
    return store, buffer[:n].copy()


def word_at(store: TileStore, row: int, col: int) -> int:
    table = store.tables[0]
    return int(store.pool[table[(row >> 5) - store.row0, (col >> 5) - store.col0], ((row & 31) << 5) | (col & 31)])


def test_cells_count_and_average() -> None:
    rng = np.random.default_rng(0)
    cell, xs, ys = 0, rng.uniform(0.2, 0.6, 25), rng.uniform(0.5, 0.9, 25)
    for x, y in zip(xs, ys, strict=True):
        cell = add_hit(np.int64(cell), x, y, 0.0, 1.0, 0.9)
    for _ in range(10):
        cell = add_pass(np.int64(cell))
    assert hits_of(np.int64(cell)) == 25 and visits_of(np.int64(cell)) == 35
    assert ((cell >> 11) & 0x3F) / 64 == pytest.approx(xs.mean(), abs=0.04)
    assert ((cell >> 17) & 0x3F) / 64 == pytest.approx(ys.mean(), abs=0.04)
    assert abs(((cell >> 23) & 0xFF) - 64) <= 1  # 90 degrees


def test_counts_never_overflow_and_what_went_away_fades() -> None:
    cell = 0
    for _ in range(1000):
        cell = add_hit(np.int64(cell), 0.5, 0.5, 1.0, 0.0, 1.0)
        assert 0 < hits_of(np.int64(cell)) <= visits_of(np.int64(cell)) < 64
    for _ in range(300):
        cell = add_pass(np.int64(cell))
        assert visits_of(np.int64(cell)) < 64
    assert hits_of(np.int64(cell)) == 0
    assert 0 <= cell < 2**32


def test_beams_clear_what_a_slow_walk_along_them_passes() -> None:
    store, points = seen_room()
    res = store.resolution_m
    hit_cells = {(math.floor(y / res), math.floor(x / res)) for x, y in points[:, :2]}
    assert all(hits_of(np.int64(word_at(store, *cell))) > 0 for cell in hit_cells)
    for x, y in points[::7, :2]:
        length = math.hypot(x, y)
        for t in np.arange(0.02, length - 0.2, 0.02):
            cell = math.floor(y * t / length / res), math.floor(x * t / length / res)
            # The slow walk may cut a corner that the exact one takes on the other side.
            assert visits_of(np.int64(word_at(store, *cell))) > 0
    outside = [(row, col) for row in (-200, 200) for col in (-200, 250)]
    assert all(word_at(store, *cell) == 0 for cell in outside)


def naive_nearest(store: TileStore, x: float, y: float, radius: int) -> float:
    best = math.inf
    for row in range(math.floor(y) - radius, math.floor(y) + radius + 1):
        for col in range(math.floor(x) - radius, math.floor(x) + radius + 1):
            word = word_at(store, row, col)
            hits, visits = word & 0x1F, (word >> 5) & 0x3F
            if hits and hits * 5 >= visits:
                mx, my = (((word >> 11) & 0x3F) + 0.5) / 64, (((word >> 17) & 0x3F) + 0.5) / 64
                best = min(best, (col + mx - x) ** 2 + (row + my - y) ** 2)
    return best


def test_nearest_is_the_nearest_or_within_half_a_cell() -> None:
    store, points = seen_room()
    rng = np.random.default_rng(4)
    found = 0
    for x, y in points[rng.integers(0, len(points), 200), :2] / store.resolution_m + rng.normal(0, 1.0, (200, 2)):
        for radius in (1, 2, 3):
            word, _, _, d2, _ = nearest(store.tiles(0), x, y, 0.0, 0.0, 0.0, radius)
            truth = naive_nearest(store, x, y, radius)
            assert (word == 0) == math.isinf(truth)
            if word != 0:
                found += 1
                assert d2 == pytest.approx(truth) or truth <= d2 < 0.25
    assert found > 200


def test_match_finds_the_pose_from_a_poor_start() -> None:
    store, points = seen_room(noise=0.01)
    for start in ((0.06, -0.05, 0.02), (-0.08, 0.03, -0.03), (0.0, 0.1, 0.0)):
        T = np.array(start)
        found = match(store.tiles(0), points, T, T, np.zeros((3, 3)), 0.03, 15)
        assert np.abs(found.pose[:2]).max() < 0.006 and abs(found.pose[2]) < 0.002
        assert found.inliers > 0.95 and found.conflicts < 0.02
        assert (np.linalg.eigvalsh(found.information) > 0).all()


def test_match_keeps_to_a_strong_prior_and_survives_an_empty_map() -> None:
    store, points = seen_room()
    T = np.array([0.05, 0.0, 0.0])
    held = match(store.tiles(0), points, T, T, np.diag([1e9] * 3), 0.03, 10)
    assert np.abs(held.pose - T).max() < 1e-3
    lost = match(TileStore(1, 0.05).tiles(0), points, T, T, np.diag([1.0] * 3), 0.03, 10)
    assert np.allclose(lost.pose, T) and lost.inliers == 0.0


def test_a_bare_corridor_tells_nothing_of_the_way_along_it() -> None:
    angles = np.radians(np.arange(-90.0, 91.0, 1.0))
    ranges = np.minimum(1.2 / np.maximum(np.abs(np.sin(angles)), 1e-3), 5.6)
    ranges = np.where(ranges < 5.6, ranges + np.random.default_rng(2).normal(0.0, 0.02, angles.size), np.nan)
    points = np.zeros((angles.size, 5))
    n = scan_points(ranges.astype(np.float32), np.cos(angles), np.sin(angles), np.zeros(3), 30.0, points)
    store = TileStore(1, 0.05)
    store.add_points(0, np.zeros(3), points[:n])
    few = np.zeros_like(points)
    few = few[: spaced(points[:n], np.zeros(2), 0.03, 180, few)]
    moved = np.array([0.15, 0.04, 0.02])
    prior = np.diag([1.0 / 0.05**2] * 3)
    found = match(store.tiles(0), few, moved, moved, prior, 0.03, 12)
    assert found.blind > 0.9 and abs(found.blind_direction[0]) > 0.99
    assert abs(found.pose[0] - 0.15) < 0.02 and abs(found.pose[1]) < 0.01 and abs(found.pose[2]) < 0.005
    assert found.information[0, 0] < 0.02 * found.information[1, 1]
    store, points = seen_room()
    assert match(store.tiles(0), points, np.zeros(3), np.zeros(3), prior, 0.03, 12).blind == 0.0


def test_search_finds_what_descent_cannot() -> None:
    store, points = seen_room()
    found = search(store.tiles(0), points, np.array([0.3, -0.2, 0.3]), Lattice(0.4, 0.02, 0.4, 0.1, 90))
    assert found.score > 0.5 * 90
    assert np.hypot(found.pose[0], found.pose[1]) < 0.15 and abs(found.pose[2]) < 0.04


@pytest.mark.parametrize("share", [1.0, 0.5, 0.0])
def test_a_search_shared_by_two_threads_finds_the_same_pose(share: float) -> None:
    store, points = seen_room()
    points = points[: int(share * len(points))]  # of no points at all every pose is worth the same
    for k in range(8):
        centre = np.array([0.1 * k - 0.3, 0.2 - 0.1 * k, 0.1 * k])
        lattice = Lattice(0.05 * k, 0.02, 0.3, 0.1, 60)
        alone = search(store.tiles(0), points, centre, lattice)
        shared = search(store.tiles(0), points, centre, lattice, Crew(2))
        assert alone.score == shared.score and np.array_equal(alone.pose, shared.pose)


def test_normals_look_at_the_laser_and_stand_on_walls() -> None:
    _, points = seen_room()
    good = points[points[:, 4] > 0.8]
    assert good.shape[0] > 200
    assert ((good[:, :2] * good[:, 2:4]).sum(axis=1) < 0).all()
    along_an_axis = np.abs(good[:, 2:4]).max(axis=1) > 0.97
    assert along_an_axis.mean() > 0.9


def test_spacing_is_measured_across_the_beams() -> None:
    arc = np.zeros((500, 5))
    angles = np.arange(500) * 0.005
    arc[:, 0], arc[:, 1] = 2.0 * np.cos(angles) + 0.3, 2.0 * np.sin(angles)
    origin, out = np.array([0.3, 0.0]), np.zeros((500, 5))
    count = spaced(arc, origin, 0.05, 500, out)
    gaps = np.hypot(*np.diff(out[:count, :2], axis=0).T)
    assert 80 < count <= 101 and gaps.min() >= 0.045
    assert 20 < spaced(arc, origin, 0.05, 40, out) <= 40
    arc[::2, 4] = UNSURE
    count = spaced(arc, origin, 0.001, 500, out)
    assert count == 250 and (out[:count, 4] == 0.0).all()


def test_spacing_does_not_choose_points_by_their_noise() -> None:
    rng = np.random.default_rng(3)
    angles = np.radians(np.arange(-120.0, 120.0, 0.35))
    walls = 1.2 / np.maximum(np.abs(np.sin(angles)), 0.25)
    out, left, right = np.zeros((angles.size, 5)), [], []
    for _ in range(60):
        noise = rng.normal(0.0, 0.03, angles.size)
        ranges = walls + noise
        points = np.stack([ranges * np.cos(angles), ranges * np.sin(angles), *np.zeros((3, angles.size))], axis=1)
        kept = out[: spaced(points, np.zeros(2), 0.03, 400, out)]
        at = np.round((np.arctan2(kept[:, 1], kept[:, 0]) - angles[0]) / (angles[1] - angles[0])).astype(int)
        front = np.abs(angles[at]) < np.pi / 2
        left += noise[at[front & (angles[at] > 0.3)]].tolist()
        right += noise[at[front & (angles[at] < -0.3)]].tolist()
    assert abs(np.mean(left) - np.mean(right)) < 0.002


def test_sparse_points_of_a_wall_are_no_things_of_their_own() -> None:
    angles = np.radians(np.arange(-90.0, 91.0, 1.0))
    ranges = (1.2 / np.maximum(np.abs(np.sin(angles)), 1e-3)).astype(np.float32)
    ranges[ranges > 30.0] = np.nan
    ranges[105] = 2.0  # a pillar before the wall
    points = np.zeros((angles.size, 5))
    n = scan_points(ranges, np.cos(angles), np.sin(angles), np.zeros(3), 30.0, points)
    far = points[:n][np.hypot(points[:n, 0], points[:n, 1]) > 6.0]
    lines = far[far[:, 4] > 0.0]
    assert lines.shape[0] > 8 and (far[:, 4] == 0.0).sum() <= 2
    assert (np.abs(lines[:, 3]) > 0.99).all() and (lines[:, 1] * lines[:, 3] < 0.0).all()
    pillar = points[:n][np.abs(np.hypot(points[:n, 0], points[:n, 1]) - 2.0).argmin()]
    assert pillar[4] == 0.0


def test_scalar_poses_are_those_of_se2() -> None:
    rng = np.random.default_rng(1)
    for a, b in rng.uniform(-4, 4, (50, 2, 3)):
        assert np.allclose(compose(a, b), se2.compose(a, b))
        assert np.allclose(between(a, b), se2.between(a, b))


def test_relaxation_spreads_a_loops_error() -> None:
    steps = np.tile([1.0, 0.0, np.pi / 10], (20, 1))
    truth = [np.zeros(3)]
    for step in steps:
        truth.append(se2.compose(truth[-1], step))
    drifted = [np.zeros(3)]
    for step in steps:
        drifted.append(se2.compose(drifted[-1], step + np.array([0.02, 0.01, 0.01])))
    poses, chain = np.stack(drifted), np.arange(20)
    T = np.concatenate([se2.between(poses[:-1], poses[1:]), [np.zeros(3)]])
    info = np.concatenate([np.tile(np.eye(3) * 100.0, (20, 1, 1)), [np.eye(3) * 1e6]])
    first, second = np.append(chain, 0), np.append(chain + 1, 20)
    robust = np.zeros(21, dtype=bool)
    relaxed = relax(poses, Edges(first, second, T, info, robust))
    assert np.abs(relaxed[-1]).max() < 1e-2
    assert np.hypot(*(relaxed - truth)[:, :2].T).max() < 0.4 * np.hypot(*(poses - truth)[:, :2].T).max()
    robust[-1] = True
    assert np.isfinite(relax(poses, Edges(first, second, T, info, robust))).all()


def test_scans_between_keyframes_join_both() -> None:
    T_key = np.array([[0.0, 0.0, 0.0], [1.2, 0.1, 0.0]])
    key = np.array([0, 0, 0, 1])
    motion = np.array([[0.0, 0, 0], [0.5, 0, 0], [0.999999, 0, 0], [0, 0, 0]])
    way = np.array([0.0, 0.5, 0.999999, 0.0])
    arrival = np.array([[0.0, 0, 0, 0], [1.0, 0, 0, 1.0]])
    poses = spread(T_key, key, motion, way, arrival)
    assert np.allclose(poses[0], T_key[0]) and np.allclose(poses[3], T_key[1])
    assert np.allclose(poses[1, :2], [0.6, 0.05]) and np.allclose(poses[2], T_key[1], atol=1e-4)


def test_levels_have_hysteresis() -> None:
    out = np.full((32, 32), -1, dtype=np.int8)
    words = np.zeros(1024, dtype=np.uint32)
    assert not quantise(words, EDGES, 0.3, LEVELS, out)
    words[0] = 3 | (10 << 5)
    assert quantise(words, EDGES, 0.3, LEVELS, out) and out[0, 0] == 75
    words[0] = 5 | (22 << 5)  # 0.227: below the edge of 0.25, but not by enough
    assert not quantise(words, EDGES, 0.3, LEVELS, out)
    words[0] = 2 | (22 << 5)
    assert quantise(words, EDGES, 0.3, LEVELS, out) and out[0, 0] < 65
