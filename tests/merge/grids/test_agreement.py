import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mrslam.merge.grids import agreement
from mrslam.merge.grids.agreement import Walls, compare, count_near, near_walls
from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.spatial import OccupancyGrid, se2
from tests.merge.plans import RESOLUTION_M, building, part


def walls_of(grid: OccupancyGrid) -> Walls:
    return Walls(TiledGrid.of(grid))


@settings(max_examples=60, deadline=None)
@given(
    arrays(np.int8, (9, 11), elements=st.sampled_from([-1, 0, 30, 50, 100])),
    arrays(np.float64, (20, 2), elements=st.floats(-3, 13)),
    st.floats(0, 4),
    st.sampled_from([(0, 0), (60, -4), (-70, 123)]),
)
def test_counts_are_those_of_the_slow_twin(cells, points, near, cell0):
    agree = against = 0
    points = np.round(points * 1024) / 1024  # no rounding decides between two cells
    walls = np.argwhere(cells >= 65)
    for x, y in points:
        c, r = int(np.floor(x)), int(np.floor(y))
        nearest = min(((r - i) ** 2 + (c - j) ** 2 for i, j in walls), default=np.inf)
        if nearest <= near * near:
            agree += 1
        elif 0 <= r < 9 and 0 <= c < 11 and 0 <= cells[r, c] <= 35:
            against += 1
    tiled = TiledGrid.of(OccupancyGrid.at_cell(cells, 0.25, *cell0))
    points_m = (points + np.array(cell0[::-1])) * 0.25
    assert count_near(tiled, points_m, 0.25 * near) == (agree, against)


def test_true_places_agree_and_wrong_ones_contradict():
    plan = building(1)
    T_a_plan, T_b_plan = se2.transform(2.0, 1.0, 0.6), se2.transform(-4.0, 0.5, -1.1)
    width = plan.shape[1]
    a, b = part(plan, 0, 2 * width // 3, T_a_plan), part(plan, width // 3, width, T_b_plan)
    T_a_b = se2.compose(T_a_plan, se2.inverse(T_b_plan))
    right = compare(walls_of(a), walls_of(b), T_a_b, 0.15)
    assert right.share_against < 0.02
    assert right.agree_m > 20.0
    wrong = compare(walls_of(a), walls_of(b), se2.compose(T_a_b, se2.transform(1.0, 0.8, 0.5)), 0.15)
    assert wrong.share_against > 0.5
    assert wrong.against_m > 8.0


def test_walls_are_looked_for_across_several_tiles():
    cells = np.zeros((1, 400), dtype=np.int8)
    cells[0, 390] = 100
    tiled = TiledGrid.of(OccupancyGrid.at_cell(cells, 0.01, 5, -70))
    x = (np.array([180.5, 190.5, 300.5]) - 70) * 0.01
    assert count_near(tiled, np.stack([x, np.full(3, 0.055)], axis=1), 2.0) == (2, 1)


def test_both_directions_say_the_same():
    plan = building(2)
    T = se2.transform(1.0, 0.3, 0.2)
    a, b = walls_of(plan), walls_of(part(plan, 50, 200, se2.IDENTITY))
    there, back = compare(a, b, T, 0.2), compare(b, a, se2.inverse(T), 0.2)
    assert abs(there.agree_m - back.agree_m) < 2 * RESOLUTION_M
    assert abs(there.against_m - back.against_m) < 2 * RESOLUTION_M


def test_nothing_against_nothing():
    empty = walls_of(OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05))
    found = compare(empty, walls_of(building(3)), se2.IDENTITY, 0.2)
    assert (found.agree_m, found.against_m, found.share_against) == (0.0, 0.0, 0.0)


def test_what_is_near_a_maps_walls_is_marked_once_by_distance(monkeypatch):
    marked = []
    monkeypatch.setattr(agreement, "near_walls", lambda *asked: marked.append(asked[1]) or near_walls(*asked))
    tiled = TiledGrid.of(building(1))
    walls, points_m = Walls(tiled), Walls(tiled).points_m + 0.2
    counts = [walls.count(points_m, near_m) for near_m in (0.3, 0.15, 0.3, 0.15)]
    assert marked == [0.3 / RESOLUTION_M, 0.15 / RESOLUTION_M]
    assert counts[:2] == counts[2:] == [count_near(tiled, points_m, near_m) for near_m in (0.3, 0.15)]
    assert counts[0][0] > counts[1][0] > 0
