"""Verdicts on walls and cells against slow twins."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.alignment.kernels import agreement as agreement_kernels
from mrslam.alignment.kernels import walls as wall_kernels
from mrslam.alignment.prepared import PreparedMap, prepare
from mrslam.alignment.verification.verify import judge_walls
from mrslam.spatial import OccupancyGrid, se2


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
            for k in range(1, round(tolerance / target.res) + 1 if n.any() else 1):
                c, r = np.floor((p - k * target.res * n - (target.x0, target.y0)) / target.res).astype(int)
                inside = 0 <= r < target.state.shape[0] and 0 <= c < target.state.shape[1]
                found = found if inside and target.state[r, c] != wall_kernels.UNKNOWN else 0
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


WALL, FACED, CROSSED, SPECK = [0.0, 1.0], [0.5, 0.866], [1.0, 0.0], [0.0, 0.0]


@pytest.mark.parametrize(
    ("source", "target", "verdict"),
    [
        (WALL, WALL, agreement_kernels.MATCHED), (WALL, FACED, agreement_kernels.MATCHED),
        (WALL, CROSSED, agreement_kernels.OPPOSED), (WALL, [0.0, -1.0], agreement_kernels.OPPOSED),
        (WALL, [0.75, 0.66], agreement_kernels.OPPOSED), (SPECK, WALL, agreement_kernels.MATCHED),
        (WALL, SPECK, agreement_kernels.MATCHED), (SPECK, SPECK, agreement_kernels.MATCHED),
    ],
)  # fmt: skip
def test_walls_match_that_face_the_same_way_and_specks_match_anything(
    source: list[float], target: list[float], verdict: int
) -> None:
    found = np.empty(1, dtype=np.uint8)
    agreement_kernels.agreement(one_point(source), one_point(target), np.zeros(3), 1, 0.15, found)
    assert found[0] == verdict


def one_point(normal: list[float]) -> wall_kernels.WallMap:
    """A map of one wall point with this normal, on free floor."""
    state, at = np.full((41, 41), wall_kernels.FREE, dtype=np.uint8), np.array([[20, 20]], dtype=np.int32)
    state[20, 20] = wall_kernels.OCCUPIED
    normals = np.array([normal])
    label = wall_kernels.nearest_labels(41, 41, at, normals, 6)
    return wall_kernels.WallMap(state, label, (at + 0.5) * 0.1, normals, np.ones(1, dtype=bool), 0.0, 0.0, 0.1)


@pytest.mark.parametrize(
    ("known_behind_m", "normal", "verdict"),
    [
        (0.0, WALL, agreement_kernels.UNSEEN), (0.3, WALL, agreement_kernels.CONTRADICTED),
        (0.0, [0.0, -1.0], agreement_kernels.CONTRADICTED), (0.0, SPECK, agreement_kernels.CONTRADICTED),
    ],
)  # fmt: skip
def test_a_wall_contradicts_only_where_the_other_map_looks_through_it(
    known_behind_m: float, normal: list[float], verdict: int
) -> None:
    found, floor = np.empty(1, dtype=np.uint8), one_point(WALL)
    floor.state[: 20 - round(known_behind_m / 0.1)] = wall_kernels.UNKNOWN
    floor.state[20, 20] = wall_kernels.FREE
    floor.label[:] = wall_kernels.NOTHING
    agreement_kernels.agreement(one_point(normal), floor, np.zeros(3), 1, 0.15, found)
    assert found[0] == verdict


def test_a_wall_at_the_rim_of_what_a_map_knows_is_not_looked_through() -> None:
    found, floor = np.empty(1, dtype=np.uint8), one_point(WALL)
    floor.state[20, 20] = wall_kernels.FREE
    floor.label[:] = wall_kernels.NOTHING
    for first, verdict in ((18, agreement_kernels.CONTRADICTED), (19, agreement_kernels.UNSEEN)):
        cut = floor._replace(state=floor.state[first:].copy(), label=floor.label[:, first:].copy(), y0=0.1 * first)
        agreement_kernels.agreement(one_point(WALL), cut, np.zeros(3), 1, 0.21, found)
        assert found[0] == verdict


@pytest.mark.parametrize("seed", range(6, 10))
def test_free_overlap_like_its_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
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
