"""Kernels against slow twins."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.kernels import agreement as agreement_kernels
from mrslam.alignment.kernels import correlation as correlate_kernels
from mrslam.alignment.kernels import walls as wall_kernels
from mrslam.alignment.prepared import PreparedMap, prepare, working_resolution
from mrslam.alignment.proposals import correlate, ransac
from mrslam.alignment.proposals.dissimilarity import Dissimilarity, mean_distance
from mrslam.alignment.proposals.hough import hough_spectrum
from mrslam.alignment.verification import structure
from mrslam.alignment.verification.refine import equations, refine
from mrslam.alignment.verification.verify import judge_walls
from mrslam.spatial import OccupancyGrid, se2


@pytest.fixture(scope="module")
def sides(pair):
    a, b = pair[0].cropped(), pair[1].cropped()
    res = working_resolution(a, b, AlignmentConfig())
    return prepare(a, res), prepare(b, res)


def test_normals_point_to_the_free_side():
    state = np.zeros((40, 40), dtype=np.uint8)
    state[10:30, 10:30] = wall_kernels.FREE
    state[10:30, 10] = wall_kernels.OCCUPIED
    state[30, 10:30] = wall_kernels.OCCUPIED
    cells, normals = wall_kernels.wall_points(state)
    left = (cells[:, 1] == 10) & (cells[:, 0] > 13) & (cells[:, 0] < 25)
    np.testing.assert_allclose(normals[left], np.tile([1.0, 0.0], (left.sum(), 1)), atol=1e-6)
    top = (cells[:, 0] == 30) & (cells[:, 1] > 15) & (cells[:, 1] < 25)
    np.testing.assert_allclose(normals[top], np.tile([0.0, -1.0], (top.sum(), 1)), atol=1e-6)


def test_thin_wall_seen_from_both_sides_has_two_normals():
    state = np.zeros((40, 40), dtype=np.uint8)
    state[5:35, 5:35] = wall_kernels.FREE
    state[5:35, 20] = wall_kernels.OCCUPIED
    cells, normals = wall_kernels.wall_points(state)
    at = normals[(cells[:, 0] == 20) & (cells[:, 1] == 20)]
    assert sorted(np.round(at[:, 0]).tolist()) == [-1.0, 1.0]


def test_specks_are_told_from_walls_and_from_dotted_walls():
    cells = np.zeros((80, 80), dtype=np.int8)
    cells[10, 10:70] = 100
    cells[40, 10:70:2] = 100
    cells[60:63, 30:33] = 100
    side = prepare(OccupancyGrid(cells, 0.05), 0.05)
    rows = np.round((side.points[:, 1] - 0.025) / 0.05).astype(int)
    assert side.solid[rows == 10].all() and side.solid[rows == 40].all()
    assert not side.solid[rows >= 60].any() and (rows >= 60).any()


def test_what_a_speck_lies_on_speaks_neither_for_nor_against():
    free = np.zeros((80, 80), dtype=np.int8)
    free[0], free[-1] = 100, 100
    person = free.copy()
    person[40:43, 40:43] = 100
    table = free.copy()
    table[40:43, 30:60] = 100
    target = prepare(OccupancyGrid(free, 0.05), 0.05)
    against = [
        judge_walls(prepare(OccupancyGrid(one, 0.05), 0.05), target, se2.IDENTITY, 0.15)[1][2]
        for one in (person, table)
    ]
    assert against[0] == 0 and against[1] >= 30


def test_nearest_labels_like_its_twin():
    rng = np.random.default_rng(1)
    cells = rng.integers(0, 30, (40, 2)).astype(np.int32)
    angles = rng.uniform(-math.pi, math.pi, 40)
    normals = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    normals[:3] = 0.0
    label = wall_kernels.nearest_labels(30, 30, cells, normals, 6)
    facing = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    for q in range(4):
        member = (normals @ facing[q] > 0.42) | (normals == 0).all(axis=1)
        for r in range(30):
            for c in range(30):
                d2 = np.where(member, ((cells - (r, c)) ** 2).sum(axis=1), 10_000)
                expected = d2.min() if d2.min() <= 36 else None
                got = label[q, r, c]
                assert (None if got == wall_kernels.NOTHING else d2[got]) == expected


def test_extents_like_their_twin():
    occupied = np.random.default_rng(3).random((60, 70)) < 0.03
    occupied[[0, 59], 5:30:3] = True
    rows, cols = np.nonzero(occupied)
    chosen = np.flatnonzero(np.random.default_rng(4).random(len(rows)) < 0.5)
    got = wall_kernels.extents(rows, cols, 3, np.stack([rows, cols], axis=-1)[chosen].astype(np.int32))
    near = (abs(rows[:, None] - rows) <= 3) & (abs(cols[:, None] - cols) <= 3)
    label = connected_components(near)[1]
    things = [label == label[k] for k in chosen]
    expected = [max(np.ptp(rows[thing]), np.ptp(cols[thing])) + 1 for thing in things]
    assert got.tolist() == expected and len(set(expected)) > 5


def test_products_of_spectra_like_their_twin():
    rng = np.random.default_rng(5)
    one, two = ((rng.normal(size=(5, 6, 4)) + 1j * rng.normal(size=(5, 6, 4))).astype(np.complex64) for _ in range(2))
    out = np.empty((2, 6, 4), dtype=np.complex64)
    correlate_kernels.multiply(one, two, out)
    np.testing.assert_allclose(out[0], (one * two.conj()).sum(axis=0), rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(out[1], (one * two[[2, 3, 0, 1, 4]]).sum(axis=0), rtol=1e-4, atol=1e-4)


def test_spectrum_of_the_rows_in_use_is_that_of_the_picture(sides):
    side = sides[1]
    free = correlate.free_points(side, 0.1) - side.centre
    picture = correlate.Picture(side.points - side.centre, side.normals, free)
    whole = np.zeros((5, 400, 405), dtype=np.float32)
    cos, sin = math.cos(0.3), math.sin(0.3)
    correlate_kernels.cyclic_splat(picture.points, picture.normals, cos, sin, 0.2, 0, whole[:4])
    correlate_kernels.soft_cap(whole[:4], 3.0)
    correlate_kernels.cyclic_count(picture.free, cos, sin, 0.2, 0.5, 0, whole[4])
    got = picture.spectra(0.3, 0.2, (400, 405), 3.0, 0.5)
    np.testing.assert_allclose(got, np.fft.rfft2(whole), atol=1e-3 * np.abs(got).max())


def test_maps_that_share_only_their_far_ends_are_proposed():
    cells = np.full((100, 1400), -1, dtype=np.int8)
    cells[:, 4:-4] = 0
    rng = np.random.default_rng(0)
    for left in [*rng.integers(10, 90, 300), *rng.integers(1310, 1390, 300)]:  # most of their walls
        row = int(rng.integers(8, 90))
        cells[row : row + 2, left : left + 2] = 100
    for left in (650, 683, 690):  # what they share
        cells[20 : left - 600, left : left + 4] = 100
    a = prepare(OccupancyGrid(cells[:, :770].copy(), 0.05), 0.05)
    b = prepare(OccupancyGrid(cells[:, 620:].copy(), 0.05), 0.05)
    found = correlate.correlate(a, b, [0.0], 0.2, per_angle=40, against=2.0)
    assert min(np.hypot(*(c.T_a_b[:2] - (31.0, 0.0))) for c in found) < 0.2


def agreement_twin(source: PreparedMap, target: PreparedMap, T: se2.Transform, tolerance: float) -> list[int]:
    verdicts = []
    at = se2.apply(T, source.points)
    facing = se2.apply(np.array([0, 0, T[2]]), source.normals)
    reach = (round(0.6 / target.res) * target.res) ** 2
    quadrants = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    for p, n, solid in zip(at, facing, source.solid, strict=True):
        c, r = np.floor((p - (target.x0, target.y0)) / target.res).astype(int)
        if not (0 < r < target.state.shape[0] - 1 and 0 < c < target.state.shape[1] - 1):
            verdicts.append(0)
            continue
        centre = np.array([target.x0 + (c + 0.5) * target.res, target.y0 + (r + 0.5) * target.res])
        found = 0
        own = int(np.argmax([n @ q for q in quadrants]))
        for k in range(4):
            q = quadrants[(own + k) % 4]
            member = (target.normals @ q > 0.42) | (target.normals == 0).all(axis=1)
            d2 = np.where(member, ((target.points - centre) ** 2).sum(axis=1), np.inf)
            j = int(np.argmin(d2))
            if d2[j] > reach + 1e-9 or np.hypot(*(target.points[j] - p)) > tolerance:
                continue
            found = 2
            if not n.any() or not target.normals[j].any() or (k == 0 and n @ target.normals[j] > 0.7):
                found = 1
                break
        if found == 0:
            block = target.state[r - 1 : r + 2, c - 1 : c + 2]
            found = 3 if (block == wall_kernels.FREE).sum() >= 6 and solid else 0
        verdicts.append(found)
    return verdicts


def test_agreement_like_its_twin(sides, pair):
    a, b = sides
    T = se2.compose(pair[2], np.array([0.07, -0.04, 0.001]))
    step = 9
    thin = PreparedMap(b.state, b.x0, b.y0, b.res)
    verdict, counts = judge_walls(b, a, T, 0.15, step)
    chosen = slice(0, None, step)
    thin.__dict__["points"] = b.points[chosen]
    thin.__dict__["_walls"] = (b._walls[0][chosen], b.normals[chosen])
    expected = agreement_twin(thin, a, T, 0.15)
    same = np.mean(np.array(expected) == verdict[chosen])
    assert same > 0.99, "ties between equally near walls may fall either way"
    assert sum(counts) == len(expected)
    assert counts[0] > 0.15 * len(expected)


def test_gradient_is_the_slope_of_the_cost(sides, pair):
    a, b = sides
    pivot = se2.apply(pair[2], b.centre)
    # Near the truth no point changes its partner, and with a wide kernel the cost is the plain sum of squares.
    T = se2.compose(pair[2], np.array([0.01, 0.005, 0.001]))
    scale = 50.0
    _, g, _, _ = equations(a, b, T, pivot, 0.6, scale)
    away = np.zeros(3)
    for k in range(3):
        costs = []
        for sign in (1, -1):
            shift = np.zeros(3)
            shift[k] = sign * 1e-8
            forth = np.array([pivot[0] + shift[0], pivot[1] + shift[1], shift[2]])
            moved = se2.compose(se2.compose(forth, [-pivot[0], -pivot[1], 0.0]), T)
            costs.append(equations(a, b, moved, pivot, 0.6, scale)[3] * scale**2)
        away[k] = (costs[0] - costs[1]) / 2e-8 / 2.0
    np.testing.assert_allclose(away, g, rtol=0.1, atol=0.05 * np.abs(g).max())


@pytest.mark.parametrize("off", [(0.2, -0.15, 0.02), (-0.3, 0.2, -0.03)])
def test_refinement_comes_back(sides, pair, off):
    a, b = sides
    pivot = se2.apply(pair[2], b.centre)
    forth = np.array([pivot[0] + off[0], pivot[1] + off[1], off[2]])
    start = se2.compose(se2.compose(forth, [-pivot[0], -pivot[1], 0.0]), pair[2])
    found = refine(a, b, start)
    assert np.hypot(*(se2.apply(found, b.centre) - pivot)) < 0.03
    assert abs(se2.wrap(found[2] - pair[2][2])) < math.radians(0.2)


def test_ransac_finds_the_inliers():
    rng = np.random.default_rng(5)
    T = se2.transform(3.0, -1.0, 2.0)
    p_b = rng.uniform(-10, 10, (60, 2))
    p_a = se2.apply(T, p_b) + rng.normal(0, 0.02, (60, 2))
    p_a[20:] = rng.uniform(-10, 10, (40, 2))
    fit = ransac.rigid(p_a, p_b, 3000, 0.2, np.random.default_rng(0))
    assert fit is not None
    np.testing.assert_allclose(fit[0], T, atol=0.03)
    assert fit[1][:20].all() and fit[1].sum() < 25


def test_ransac_gives_up_on_nothing():
    assert ransac.rigid(np.zeros((2, 2)), np.zeros((2, 2)), 10, 0.2, np.random.default_rng(0)) is None
    assert ransac.rigid(np.zeros((9, 2)), np.zeros((9, 2)), 10, 0.2, np.random.default_rng(0)) is None


def test_best_draw_like_its_twin():
    rng = np.random.default_rng(2)
    p_a, p_b = rng.uniform(0, 6, (25, 2)), rng.uniform(0, 6, (25, 2))
    draws = rng.integers(0, 25, (300, 2))
    k, most = ransac.best_draw(p_a, p_b, draws, 0.5)
    counts = []
    for i, j in draws:
        lengths = np.hypot(*(p_a[j] - p_a[i])), np.hypot(*(p_b[j] - p_b[i]))
        if lengths[1] < 2.5 or abs(lengths[0] - lengths[1]) > 1.0:
            counts.append(0)
            continue
        T = se2.fit_rigid(p_a[[i, j]], p_b[[i, j]])
        counts.append(int((np.hypot(*(se2.apply(T, p_b) - p_a).T) <= 0.5).sum()))
    assert most == max(counts)
    assert counts[k] == most


def test_distinct_walls_of_a_rectangle_and_of_a_corner():
    t = np.linspace(0.0, 4.0, 81)
    sides = [(np.stack([t, 0 * t], -1), (0, 1)), (np.stack([t, 0 * t + 3], -1), (0, -1))]
    sides += [(np.stack([0 * t, t], -1), (1, 0)), (np.stack([0 * t + 5, t], -1), (-1, 0))]
    points = np.concatenate([p for p, _ in sides])
    normals = np.concatenate([np.tile(np.array(n, dtype=float), (81, 1)) for _, n in sides])
    assert structure.distinct_walls(points, normals, 10, 0.3, 20).tolist() == [81] * 4
    corner = np.concatenate([points[:81], points[162:243]]), np.concatenate([normals[:81], normals[162:243]])
    assert len(structure.distinct_walls(*corner, 10, 0.3, 20)) == 2
    assert len(structure.distinct_walls(points[:0], normals[:0], 10, 0.3, 20)) == 0


def test_hough_spectrum_like_its_twin():
    points = np.random.default_rng(0).normal(0, 2, (50, 2))
    got = hough_spectrum(points, 24, 0.25)
    for k in range(24):
        rho = np.floor(points @ [math.cos(k * math.pi / 24), math.sin(k * math.pi / 24)] / 0.25)
        assert got[k] == (np.unique(rho, return_counts=True)[1] ** 2).sum()


def test_peaks_like_sorting():
    score = np.random.default_rng(0).normal(0, 1, (40, 50)).astype(np.float32)
    where, value = correlate_kernels.peaks(score, 5, 2)
    assert (np.diff(value) <= 0).all()
    assert value[0] == score.max()
    assert tuple(where[0]) == np.unravel_index(int(score.argmax()), score.shape)
    for i in range(5):
        for j in range(i):
            gap = np.abs(where[i] - where[j])
            assert np.minimum(gap, np.array(score.shape) - gap).max() > 2


def test_mean_distance_like_its_twin():
    rng = np.random.default_rng(4)
    field = rng.integers(0, 9, (12, 15)).astype(np.int32)
    points = rng.uniform(-2, 5, (30, 2))
    T = np.array([0.3, -0.2, 0.7])
    total = 0.0
    for p in se2.apply(T, points):
        c, r = int(math.floor((p[0] - 0.1) / 0.2)), int(math.floor((p[1] + 0.3) / 0.2))
        rr, cc = min(max(r, 0), 11), min(max(c, 0), 14)
        total += abs(r - rr) + abs(c - cc) + field[rr, cc]
    assert math.isclose(mean_distance(points, T, field, 0.1, -0.3, 0.2), total / 30)


def test_dissimilarity_is_symmetric_and_least_at_the_truth(house):
    whole = house.part(slice(0, 400), slice(0, 520), np.zeros(3)).cropped()
    side = prepare(whole, 0.05)
    psi = Dissimilarity(side, side)
    off = np.array([0.7, -0.4, 0.3])
    assert psi(np.zeros(3)) < 0.1 < psi(np.array([0.4, 0.0, 0.0])) < psi(np.array([3.0, 0.0, 0.0]))
    assert math.isclose(psi(off), psi(se2.inverse(off)), rel_tol=1e-9)


def test_free_overlap_like_its_twin():
    rng = np.random.default_rng(6)
    s, t = rng.integers(0, 3, (14, 11)).astype(np.uint8), rng.integers(0, 3, (13, 17)).astype(np.uint8)
    T = np.array([0.11, -0.07, 0.4])
    got = agreement_kernels.free_overlap(s, 0.0, 0.0, 1, T, t, -0.1, 0.1, 0.1)
    free = both = differ = known = 0
    for r in range(14):
        for c in range(11):
            if s[r, c] == 0:
                continue
            known += 1
            x, y = se2.apply(T, [(c + 0.5) * 0.1, (r + 0.5) * 0.1])
            ct, rt = math.floor((x + 0.1) / 0.1), math.floor((y - 0.1) / 0.1)
            if not (0 <= rt < 13 and 0 <= ct < 17) or t[rt, ct] == 0:
                continue
            free += s[r, c] == t[rt, ct] == 1
            both += s[r, c] == t[rt, ct] == 2
            differ += s[r, c] != t[rt, ct]
    assert got == (free, both, differ, known)


def test_acceptance_index_of_a_map_with_itself(pair):
    from mrslam import alignment

    a = pair[0]
    assert alignment.acceptance_index(a, a, np.zeros(3)) == 1.0
    assert alignment.acceptance_index(a, a, np.array([0.5, 0.0, 0.0])) < 0.98
    assert alignment.acceptance_index(a, a, np.array([500.0, 0.0, 0.0])) == 0.0
    empty = OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05)
    assert alignment.acceptance_index(a, empty, np.zeros(3)) == 0.0
