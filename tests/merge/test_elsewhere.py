"""What other maps show of the floor that one map lies on."""

import numpy as np

from mrslam.merge.elsewhere import Elsewhere
from mrslam.merge.grids.shown import Shown
from mrslam.merge.joint.bend import Bend
from mrslam.spatial import TILE_CELLS, se2

EDGE_M = 0.05


def wall_at(*points_m: tuple[float, float]) -> Shown:
    """Return maps whose only walls are in the cells of these points of the team frame."""
    tiles: dict = {}
    for x, y in points_m:
        row, col = int(y // EDGE_M), int(x // EDGE_M)
        tile = tiles.setdefault((row // TILE_CELLS, col // TILE_CELLS), np.full((TILE_CELLS,) * 2, -1, np.int8))
        tile[row % TILE_CELLS, col % TILE_CELLS] = 100
    return Shown([tiles], 2)


def test_points_are_looked_up_where_their_map_lies() -> None:
    T_team_map = se2.transform(4.0, -3.0, np.pi / 2)
    elsewhere = Elsewhere(wall_at((2.51, -1.99)), EDGE_M, T_team_map, None)
    points = np.array([[1.01, 1.49], [1.49, 1.01]])
    assert elsewhere.count(points, np.array([True, True])).tolist() == [1, 0]
    assert not elsewhere.count(points, np.array([False, False])).any()


def test_points_of_a_bent_map_are_looked_up_where_it_is_bent_to() -> None:
    T_map_key = np.stack([np.arange(0.0, 20.0, 0.5), np.zeros(40), np.zeros(40)], axis=1)
    T_team_key = T_map_key.copy()
    T_team_key[:, 1] += 0.05 * (T_map_key[:, 0] - 10.0) ** 2 / 10.0  # up to half a metre
    bend = Bend(T_map_key, T_team_key)
    ends = np.array([[0.01, 0.01], [10.01, 0.01]])
    at = T_team_key[[0, 20], :2] + 0.01
    elsewhere = Elsewhere(wall_at(*at.tolist()), EDGE_M, se2.IDENTITY, bend)
    assert elsewhere.count(ends, np.array([True, True])).all()
    rigid = Elsewhere(wall_at(*at.tolist()), EDGE_M, se2.IDENTITY, None)
    assert rigid.count(ends, np.array([True, True])).tolist() == [0, 1]
