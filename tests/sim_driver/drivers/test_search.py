from itertools import pairwise

import numpy as np
import pytest
from scipy import ndimage
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from mrslam.sim_driver.drivers.config import DriverConfig
from mrslam.sim_driver.drivers.costmap import make_costmap, pool
from mrslam.sim_driver.drivers.search import frontiers, nearer, trace, travel
from mrslam.spatial import OccupancyGrid


def random_weight(seed, shape=(25, 31), blocked=0.25):
    rng = np.random.default_rng(seed)
    weight = rng.uniform(1.0, 5.0, shape).astype(np.float32)
    weight[rng.random(shape) < blocked] = np.inf
    return weight, rng


def naive_costs(weight, sources):
    """The same graph, spelled out edge by edge, by scipy."""
    height, width = weight.shape
    rows, cols, costs = [], [], []
    for r in range(height):
        for c in range(width):
            for dr in (-1, 0, 1):
                for dc in (-1, 0, 1):
                    nr, nc = r + dr, c + dc
                    if (dr or dc) and 0 <= nr < height and 0 <= nc < width:
                        if not np.isfinite([weight[r, c], weight[nr, nc], weight[r, nc], weight[nr, c]]).all():
                            continue
                        rows.append(r * width + c)
                        cols.append(nr * width + nc)
                        costs.append(np.hypot(dr, dc) * 0.5 * (weight[r, c] + weight[nr, nc]))
    graph = csr_matrix((costs, (rows, cols)), shape=(height * width,) * 2)
    return dijkstra(graph, indices=[r * width + c for r, c in sources]).reshape(len(sources), height, width)


@pytest.mark.parametrize("seed", range(6))
def test_costs_and_nearest_sources_are_dijkstras(seed):
    weight, rng = random_weight(seed)
    sources = rng.permutation(np.argwhere(np.isfinite(weight)))[:3].astype(np.int32)
    expected = naive_costs(weight, sources)
    cost, before, source = travel(weight, *sources.T.copy(), -1, -1)
    assert np.allclose(cost, expected.min(axis=0), rtol=1e-4)
    reached = np.isfinite(cost)
    assert reached.sum() > 50
    assert (source[~reached] == -1).all()
    own = np.take_along_axis(expected, np.maximum(source, 0)[None], axis=0)[0]
    assert np.allclose(own[reached], cost[reached], rtol=1e-4)
    for r, c in rng.permutation(np.argwhere(reached))[:20]:
        path = trace(before, r, c)
        assert (path[-1] == (r, c)).all()
        assert path[0].tolist() in sources.tolist()
        steps = np.abs(np.diff(path, axis=0))
        assert steps.max(initial=0) <= 1
        way = sum(np.hypot(*(a - b)) * 0.5 * (weight[tuple(a)] + weight[tuple(b)]) for a, b in pairwise(path))
        assert way == pytest.approx(cost[r, c], rel=1e-4)


@pytest.mark.parametrize("seed", range(6))
def test_cells_nearer_to_others_are_those_that_they_reach_at_less_cost(seed):
    weight, rng = random_weight(seed)
    sources = rng.permutation(np.argwhere(np.isfinite(weight)))[:4].astype(np.int32)
    own, *others = naive_costs(weight, sources)
    rows, cols = sources.T.copy()
    cost = travel(weight, rows[:1], cols[:1], -1, -1)[0]
    before = cost.tobytes()
    found = nearer(weight, rows[1:], cols[1:], cost)
    least = np.min(others, axis=0)
    is_clear = ~np.isclose(least, own, atol=1e-3)
    assert np.array_equal(found[is_clear], (least < own)[is_clear]) and found.any() and not found.all()
    assert cost.tobytes() == before and not nearer(weight, rows[:0], cols[:0], cost).any()


@pytest.mark.parametrize("seed", range(6))
def test_a_star_finds_what_dijkstra_finds(seed):
    weight, rng = random_weight(seed, (40, 40))
    start, goal = rng.permutation(np.argwhere(np.isfinite(weight)))[:2].astype(np.int32)
    full = travel(weight, start[:1], start[1:], -1, -1)[0]
    cost = travel(weight, start[:1], start[1:], goal[0], goal[1])[0]
    assert cost[tuple(goal)] == pytest.approx(full[tuple(goal)], rel=1e-5)


def test_corners_are_not_cut():
    weight = np.ones((2, 2), dtype=np.float32)
    weight[0, 1] = np.inf
    cost = travel(weight, np.zeros(1, np.int32), np.zeros(1, np.int32), -1, -1)[0]
    assert cost[1, 1] == pytest.approx(2.0)
    weight[1, 0] = np.inf
    cost = travel(weight, np.zeros(1, np.int32), np.zeros(1, np.int32), -1, -1)[0]
    assert np.isinf(cost[1, 1])


def test_a_blocked_source_reaches_nothing():
    weight = np.full((3, 3), np.inf, dtype=np.float32)
    cost, _, source = travel(weight, np.zeros(1, np.int32), np.zeros(1, np.int32), -1, -1)
    assert np.isinf(cost).all()
    assert (source == -1).all()


@pytest.mark.parametrize("seed", range(4))
def test_frontiers_are_the_connected_groups(seed):
    rng = np.random.default_rng(seed)
    candidate = rng.random((30, 40)) < 0.15
    cost = np.where(rng.random((30, 40)) < 0.5, rng.uniform(0, 9, (30, 40)), np.inf).astype(np.float32)
    labels, count = ndimage.label(candidate, structure=np.ones((3, 3)))
    sizes, goals = frontiers(candidate, cost, 2)
    assert sorted(sizes) == sorted(np.bincount(labels.ravel())[1:])
    assert len(goals) == count
    near = ndimage.binary_dilation(candidate, structure=np.ones((5, 5)))
    for r, c in goals[goals[:, 0] >= 0]:
        assert near[r, c]
        assert np.isfinite(cost[r, c])


def test_the_place_to_go_is_the_middle_of_the_group():
    candidate = np.zeros((9, 31), dtype=bool)
    candidate[4, 5:26] = True
    cost = np.zeros((9, 31), dtype=np.float32)
    cost[4] = np.inf  # not on the frontier itself
    sizes, goals = frontiers(candidate, cost, 2)
    assert sizes.tolist() == [21]
    assert abs(goals[0, 1] - 15) <= 1
    assert abs(goals[0, 0] - 4) == 1
    assert frontiers(candidate, np.full((9, 31), np.inf, dtype=np.float32), 2)[1].tolist() == [[-1, -1]]


def test_pooling():
    cells = np.array([[0, 0, -1, -1], [0, 100, -1, 0], [50, 50, 0, 0]], dtype=np.int8)
    occupied, free, unknown = pool(cells, 2, 35, 65)
    assert occupied.tolist() == [[True, False], [False, False]]
    assert free.tolist() == [[False, False], [False, True]]
    assert unknown.tolist() == [[False, True], [False, False]]  # undecided cells are none of the three


def test_the_body_must_fit():
    cells = np.zeros((40, 60), dtype=np.int8)
    cells[:, 30] = 100
    cells[18:22, 30] = 0  # a gap of 0.2 m
    config = DriverConfig()
    narrow = make_costmap(OccupancyGrid(cells, 0.05), config)
    cells[12:28, 30] = 0  # of 0.8 m
    wide = make_costmap(OccupancyGrid(cells, 0.05), config)
    start = np.array([20], dtype=np.int32), np.array([10], dtype=np.int32)
    assert np.isinf(travel(narrow.weight, *start, -1, -1)[0][20, 50])
    assert np.isfinite(travel(wide.weight, *start, -1, -1)[0][20, 50])
    assert wide.weight[20, 10] < wide.weight[20, 30]  # doors are dearer than halls


def test_frontiers_lie_between_free_and_unknown_only():
    cells = np.full((40, 40), -1, dtype=np.int8)
    cells[10:30, 10:30] = 0
    cells[10:30, 29] = 50  # undecided: no frontier
    cells[10, 10:30] = 100
    costmap = make_costmap(OccupancyGrid(cells, 0.05), DriverConfig())
    rows, cols = np.nonzero(costmap.is_frontier)
    assert set(rows) | set(cols) <= set(range(10, 30))
    assert (cols == 10).any()
    assert (rows == 29).any()
    assert not (cols >= 28).any() or (rows[cols >= 28] == 29).all()
    assert rows.min() >= 10 + 3  # too near a wall to be worth it


def test_obstacles_seen_now_block_and_big_maps_get_coarser():
    cells = np.zeros((100, 100), dtype=np.int8)
    config = DriverConfig(max_plan_cells=3000)
    costmap = make_costmap(OccupancyGrid(cells, 0.05), config, np.array([[2.5, 2.5], [99.0, 99.0]]))
    assert costmap.weight.size <= 3000
    assert costmap.resolution_m == pytest.approx(0.1)
    assert np.isinf(costmap.weight[costmap.cell(np.array([2.5, 2.5]))])
    assert np.isfinite(costmap.weight[costmap.cell(np.array([1.0, 1.0]))])


def test_a_pocket_between_obstacles_is_no_place_to_set_out_from():
    cells = np.full((100, 100), 100, dtype=np.int8)
    cells[10:90, 40:90] = 0  # a room
    cells[45:56, 20:31] = 0  # and a nook in which the body just fits, nearer to the robot
    costmap = make_costmap(OccupancyGrid(cells, 0.05), DriverConfig())
    robot_m = np.array([1.55, 2.5])
    nook = costmap.cell(np.array([1.25, 2.5]))
    assert np.isfinite(costmap.weight[nook])
    row, col = costmap.nearest_open(robot_m, 0.8)
    assert col >= 40 and np.isfinite(costmap.weight[row, col])
    assert costmap.nearest_open(robot_m, 0.71)[1] <= 30  # the room is a cell too far
    assert costmap.nearest_open(robot_m, 0.05) is None
