"""Every search reaches a minimum that is known; what a search is made for, it does better than one without."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.alignment.proposals import walks
from mrslam.alignment.proposals.walks.log import F64, Log, Search
from mrslam.spatial import se2

LOW, HIGH = np.array([-10.0, -10.0, -math.pi]), np.array([10.0, 10.0, math.pi])
MINIMUM, START = np.array([3.0, -4.0, 0.7]), np.array([-6.0, 5.0, -1.5])
SCALE = np.array([1.0, 1.0, 0.2])
SEEDS = range(5)


def bowl(s: F64) -> float:
    """Distance to the minimum, whose value is 0.1."""
    return 0.1 + float(np.linalg.norm((s - MINIMUM) / SCALE))


def valley(s: F64) -> float:
    """A narrow valley, diagonal in x and y: who steps alike in all directions hardly descends."""
    x, y, theta = s - MINIMUM
    return 0.1 + 0.2 * abs(x + y) + 3.5 * abs(x - y) + 10.0 * abs(theta)


def trap(s: F64) -> float:
    """A shallow minimum at the start; wherever the lower one draws, it is worse there first."""
    here, there = (float(np.linalg.norm((s - place) / SCALE)) for place in (START, MINIMUM))
    return min(1.0 + 0.3 * min(here, 1.0), 1.3 * math.sqrt(min(there, 6.0) / 6.0) + 0.05)


def pit(s: F64) -> float:
    """The bowl, with a pit at the start that hardly anything about it is as low as."""
    return 0.5 if float(np.linalg.norm((s - START) / SCALE)) < 0.01 else bowl(s)


def reached(search: Search, objective: walks.Objective, start: F64, evaluations: int = 2000) -> list[float]:
    """Return the least value visited, by seed."""
    return [
        float(search(objective, start, LOW, HIGH, evaluations, np.random.default_rng(seed))[:, 3].min())
        for seed in SEEDS
    ]


@pytest.mark.parametrize(
    ("search", "within"),
    [
        (walks.adaptive_walk, 0.05),
        (walks.plain_walk, 0.6),
        (walks.hill_climb, 0.02),
        (walks.annealing, 0.05),
        (walks.brute_force, 1.5),
    ],
)
def test_the_minimum_is_reached_from_afar(search, within):
    assert max(reached(search, bowl, START)) < 0.1 + within


@pytest.mark.parametrize("search", [walks.multi_point_hill_climb, walks.simulated_annealing])
def test_algorithms_2_and_3_reach_the_minimum_next_to_where_they_start(search):
    start = MINIMUM + np.array([1.6, -1.2, 0.1])
    assert bowl(start) > 2.0
    assert max(reached(search, bowl, start)) < 0.1 + 0.5


def test_the_walk_that_adapts_follows_a_valley_where_the_plain_one_does_not():
    adaptive, plain = reached(walks.adaptive_walk, valley, START), reached(walks.plain_walk, valley, START)
    assert max(adaptive) < 0.2 < min(plain) and np.mean(plain) > 4.0 * np.mean(adaptive)


@pytest.mark.parametrize("search", [walks.annealing, walks.adaptive_walk])
def test_a_search_that_accepts_what_is_worse_leaves_a_shallow_minimum(search):
    assert sum(value < 0.3 for value in reached(search, trap, START)) >= 4


def test_a_climb_that_ends_in_a_shallow_minimum_begins_elsewhere() -> None:
    assert sum(value < 0.3 for value in reached(walks.hill_climb, trap, START)) >= 4


def test_a_walk_that_cannot_narrow_any_more_begins_elsewhere() -> None:
    assert max(reached(walks.adaptive_walk, pit, START)) < 0.3


def test_brute_force_looks_everywhere_at_angles_twice_as_dense_as_shifts() -> None:
    visited = walks.brute_force(bowl, START, LOW, HIGH, 2000, np.random.default_rng(0))
    xs, ys, turns = (np.unique(visited[:, k]) for k in range(3))
    assert len(xs) == len(ys) == 10 and len(turns) == 20 and len(visited) == 2000
    assert (xs[0], xs[-1], ys[0], ys[-1]) == (-10.0, 10.0, -10.0, 10.0)
    np.testing.assert_allclose(np.diff(turns), math.pi / 10.0)


@pytest.mark.parametrize("search", [walks.multi_point_hill_climb, walks.simulated_annealing])
def test_algorithms_2_and_3_end_where_nothing_improves(search):
    visited = search(lambda s: 1.0, START, LOW, HIGH, 2000, np.random.default_rng(0))
    assert len(visited) == 10 + 6 * 10  # the first samples, and all changes of them


def slope(s: F64) -> float:
    """Falls towards -x on the line y = theta = 0, level elsewhere: there is one way down."""
    return float(s[0]) - 100.0 if abs(s[1]) + abs(s[2]) < 1e-9 else 0.0


@pytest.mark.parametrize(
    ("search", "steps"),
    [
        (walks.multi_point_hill_climb, [0.4, 0.4, 0.4, 0.4]),
        (walks.simulated_annealing, [2.0, 1.0, 2.0 / 3.0, 0.5]),  # a tenth of the range, divided by 1, 2, 3, 4
    ],
)
def test_algorithm_2_keeps_its_step_and_algorithm_3_divides_it(search, steps):
    visited = search(slope, np.zeros(3), LOW, HIGH, 200, np.random.default_rng(1))
    lowest = np.unique(np.minimum.accumulate(np.where(visited[:, 3] < 0, visited[:, 0], 0.0)))[::-1]
    np.testing.assert_allclose(-np.diff(lowest)[:4], steps)


@pytest.mark.parametrize(
    "search", [getattr(walks, name) for name in walks.__all__ if name.endswith(("walk", "climb", "annealing", "force"))]
)
def test_no_search_exceeds_its_evaluations_or_its_bounds_and_all_repeat_themselves(search):
    asked: list[F64] = []

    def objective(s: F64) -> float:
        asked.append(s)
        return valley(s)

    visited = search(objective, START, LOW, HIGH, 300, np.random.default_rng(2))
    assert 0 < len(visited) == len(asked) <= 300
    assert (visited[:, :3] >= LOW - 1e-9).all() and (visited[:, :3] <= HIGH + 1e-9).all()
    np.testing.assert_array_equal(visited, search(valley, START, LOW, HIGH, 300, np.random.default_rng(2)))


def test_bounds_about_half_a_turn_are_one_range():
    log = Log(lambda s: abs(float(se2.wrap(s[2] - 3.25))), np.array([-1.0, -1.0, 2.9]), np.array([1.0, 1.0, 3.3]), 9)
    assert log(log.clip(np.array([0.0, 0.0, 3.25]))) < 1e-9
