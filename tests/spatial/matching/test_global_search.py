"""Branch and bound finds what trying every pose would."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.spatial import se2
from mrslam.spatial.matching.branch_and_bound import ALIKE, CELL_M, DISTINCT_M, DISTINCT_RAD, branch_and_bound
from mrslam.spatial.matching.global_search import BESIDE, HIT, LEVELS, find, wall_grid


def walls(seed: int) -> NDArray[np.float64]:
    """Points on some straight walls within 20 m."""
    rng = np.random.default_rng(seed)
    parts = []
    for _ in range(12):
        angle = rng.choice([0.0, 0.5 * np.pi]) + rng.normal(0.0, 0.1)
        along = np.linspace(0.0, rng.uniform(3.0, 12.0), 80)[:, None]
        parts.append(rng.uniform(-20.0, 20.0, 2) + along * (math.cos(angle), math.sin(angle)))
    return np.concatenate(parts)


@pytest.mark.parametrize("seed", range(6))
def test_the_best_is_that_of_a_slow_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid = wall_grid(walls(seed))
    height, width = grid.levels.shape[1:]
    half, turns = 37, np.arange(3) * 0.1
    rows, cols = (rng.integers(0, n, (3, 40)).astype(np.int32) for n in (height, width))
    banned = np.array([[5.0, -3.0, 0.1], [-20.0, 11.0, 0.0]])

    def score(turn: int, row: int, col: int) -> int:
        if any(math.hypot(col - c, row - r) < 8.0 and abs(turns[turn] - t) < 0.3 for c, r, t in banned):
            return 0
        r, c = rows[turn] + row, cols[turn] + col
        inside = (r >= 0) & (r < height) & (c >= 0) & (c < width)
        return int(grid.levels[0][r[inside], c[inside]].astype(int).sum())

    shifts = range(-half, half + 1)
    expected = max(score(turn, row, col) for turn in range(3) for row in shifts for col in shifts)
    best = np.zeros((1, 4), dtype=np.int64)
    assert branch_and_bound(grid.levels, rows, cols, turns, half, banned, 10**9, 0, best)
    assert best[0, 0] == expected == score(*best[0, 1:])
    best[:] = 0  # nothing is better
    assert branch_and_bound(grid.levels, rows, cols, turns, half, banned, 10**9, expected, best) and not best.any()
    assert not branch_and_bound(grid.levels, rows, cols, turns, half, banned, 10, 0, best)  # no time to see all


@pytest.mark.parametrize("most", [2, 5, 40])
@pytest.mark.parametrize("seed", range(4))
def test_all_places_that_fit_about_as_well_as_the_best_are_found_at_once(seed: int, most: int) -> None:
    rng = np.random.default_rng(seed)
    grid = wall_grid(walls(seed))
    height, width = grid.levels.shape[1:]
    half, turns = 40, np.arange(3) * 0.4  # each heading is a place of its own
    rows, cols = (rng.integers(0, n, (3, 12)).astype(np.int32) for n in (height, width))
    poses = {}
    for turn in range(3):
        for row in range(-half, half + 1):
            for col in range(-half, half + 1):
                r, c = rows[turn] + row, cols[turn] + col
                inside = (r >= 0) & (r < height) & (c >= 0) & (c < width)
                poses[turn, row, col] = int(grid.levels[0][r[inside], c[inside]].astype(int).sum())
    best = max(poses.values())
    spots = np.zeros((most, 4), dtype=np.int64)
    assert branch_and_bound(grid.levels, rows, cols, turns, half, np.zeros((0, 3)), 10**9, 0, spots)
    found = spots[spots[:, 0] > int(ALIKE * best)]
    count = len(found)
    assert 1 <= count <= most
    assert found[0, 0] == best and np.all(np.diff(found[:, 0]) <= 0)
    assert all(score == poses[turn, row, col] for score, turn, row, col in found.tolist())

    def is_same(one: tuple[int, int, int], two: tuple[int, int, int]) -> bool:
        away_m = CELL_M * math.hypot(one[1] - two[1], one[2] - two[2])
        return away_m < DISTINCT_M and abs(turns[one[0]] - turns[two[0]]) < DISTINCT_RAD

    places = [(turn, row, col) for _, turn, row, col in found.tolist()]
    assert not any(is_same(one, two) for k, one in enumerate(places) for two in places[:k])
    least = max(int(ALIKE * best), found[-1, 0] if count == most else 0)
    missed = [pose for pose, score in poses.items() if score > least and not any(is_same(pose, p) for p in places)]
    # What lay next to a place that a better one drove out may be passed over: all of it lies within twice of the rest.
    away_m = [min(CELL_M * math.hypot(m[1] - p[1], m[2] - p[2]) for p in places if p[0] == m[0]) for m in missed]
    assert max(away_m, default=0.0) < 2.0 * DISTINCT_M


def test_levels_are_maxima_of_squares_and_walls_are_blurred_by_a_cell() -> None:
    grid = wall_grid(np.array([[1.0, 2.0], [9.0, -3.0]]))
    base = grid.levels[0].astype(int)
    assert base.max() == HIT and np.count_nonzero(base) == 18 and np.count_nonzero(base == BESIDE) == 16
    col, row = np.floor((np.array([1.0, 2.0]) - grid.low_m) / CELL_M).astype(int)
    assert base[row, col] == HIT
    for h in range(LEVELS):
        side = 1 << h
        r, c = row - side + 1, col - side + 1
        assert grid.levels[h][r, c] == base[r : r + side, c : c + side].max() == HIT
        assert grid.levels[h][r - 2, c] == base[r - 2 : r - 2 + side, c : c + side].max() == 0


@pytest.mark.parametrize("pose", [(9.0, -7.0, 0.4), (-12.0, 3.0, -0.3)])
def test_scans_are_found_far_from_where_they_were_expected(pose: tuple[float, float, float]) -> None:
    rng, T_map_scan = np.random.default_rng(5), np.array(pose)
    seen = se2.apply(se2.inverse(T_map_scan), walls(1))
    seen = seen[np.hypot(*seen.T) < 14.0]
    seen = seen[rng.choice(len(seen), 100)] + rng.normal(0.0, 0.03, (100, 2))
    grid = wall_grid(walls(1))
    spot = find(grid, seen, np.zeros(3), 20.0, 0.5, 0.6).spot
    assert spot is not None and spot.share > 0.7
    away_m, turned = se2.difference(spot.T_map_scan, T_map_scan)
    assert away_m < 1.5 * CELL_M and turned < 0.04
    assert find(grid, seen, np.zeros(3), 20.0, 0.5, 0.6, [spot.T_map_scan]).spot is None
    assert find(grid, seen, np.zeros(3), 4.0, 0.5, 0.6).spot is None


def test_places_are_found_together_that_fit_about_as_well_as_the_best_alone() -> None:
    seen = se2.apply(se2.inverse(np.array([0.0, 0.0, 0.3])), walls(1))[::6]
    again = walls(1) + np.array([60.0, 0.0])
    worse = again[np.random.default_rng(0).random(len(again)) < 0.25]
    for copy, count in ((again, 2), (worse, 1)):
        grid = wall_grid(np.concatenate([walls(1), copy]))
        spots = find(grid, seen, np.array([30.0, 0.0, 0.0]), 40.0, 0.5, 0.1, most=4).spots
        assert sorted(round(spot.T_map_scan[0] / 60.0) for spot in spots) == list(range(count))
        assert all(spot.share > ALIKE * spots[0].share for spot in spots)


def test_a_place_that_is_left_out_is_so_on_either_side_of_half_a_turn() -> None:
    rng, T_map_scan = np.random.default_rng(5), np.array([2.0, -1.0, math.pi - 0.02])
    seen = se2.apply(se2.inverse(T_map_scan), walls(1))
    seen = seen[np.hypot(*seen.T) < 14.0]
    seen = seen[rng.choice(len(seen), 150, replace=False)]
    beyond = T_map_scan + np.array([0.0, 0.0, 0.1 - 2.0 * math.pi])
    free, barred = (find(wall_grid(walls(1)), seen, np.zeros(3), 5.0, math.pi, 0.3, other) for other in ((), (beyond,)))
    assert free.spot is not None and se2.difference(free.spot.T_map_scan, T_map_scan)[0] < 0.5
    if barred.spot is not None:
        away_m, turned_rad = se2.difference(barred.spot.T_map_scan, T_map_scan)
        assert away_m > 1.5 or turned_rad > 0.2


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_place_is_searched_for_around_what_is_expected_as_far_as_was_asked(side: float) -> None:
    expected = np.array([30.0, -20.0, math.pi - 0.05])
    T_map_scan = expected + side * np.array([0.98, 0.98, 0.095])
    rng = np.random.default_rng(5)
    seen = se2.apply(se2.inverse(T_map_scan), walls(1) + expected[:2])
    seen = seen[rng.choice(len(seen), 200, replace=False)]
    grid = wall_grid(walls(1) + expected[:2])
    spot = find(grid, seen, expected, 0.98, 0.095, 0.6).spot
    assert spot is not None and 0.8 < spot.share <= 1.0
    assert np.abs(spot.T_map_scan[:2] - T_map_scan[:2]).max() < 0.2  # a step less is 0.23
    assert -math.pi <= spot.T_map_scan[2] <= math.pi
    assert abs(se2.wrap(spot.T_map_scan[2] - T_map_scan[2])) < 0.0101
    assert find(grid, seen, expected, 0.98, 0.095, 0.6, [spot.T_map_scan]).spot is None
