import numpy as np
import pytest

from mrslam.merge import fuse, warp
from mrslam.merge.config import FUSIONS
from mrslam.merge.grids.fusion_tree import FusionTree
from mrslam.merge.grids.layers import Layer
from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.spatial import TILE_CELLS, UNKNOWN, OccupancyGrid, se2
from tests.merge.plans import building

ROBOTS = [f"r{i:02}" for i in range(8)]


def noisy(seed: int) -> OccupancyGrid:
    """Return a small building as one robot may have seen it."""
    rng = np.random.default_rng(seed)
    cells = building(1, rooms=3).cells.copy()
    cells[rng.random(cells.shape) < 0.3] = UNKNOWN
    return OccupancyGrid(cells, 0.05)


def layers_of(grids, places):
    layers = {}
    for robot_id, grid in grids.items():
        layers[robot_id] = Layer()
        layers[robot_id].update(TiledGrid.of(grid), places[robot_id], 0.05)
    return layers


@pytest.fixture
def team():
    grids = {robot_id: noisy(i) for i, robot_id in enumerate(ROBOTS)}
    places = {robot_id: se2.transform(0.01 * i, 0.02 * i, 0.01 * i) for i, robot_id in enumerate(ROBOTS)}
    return grids, places


@pytest.mark.parametrize("method", FUSIONS)
def test_the_tree_gives_what_fusing_all_at_once_gives(team, method):
    grids, places = team
    tree = FusionTree(method)
    tree.update(layers_of(grids, places))
    wanted = fuse([warp(grids[x], places[x]) for x in ROBOTS], method)
    row0, col0 = wanted.cell0
    for (i, j), tile in tree.cells.items():
        for r, c in np.argwhere(tile != UNKNOWN):
            assert wanted.cells[i * TILE_CELLS + r - row0, j * TILE_CELLS + c - col0] == tile[r, c]
    assert sum((tile != UNKNOWN).sum() for tile in tree.cells.values()) == np.count_nonzero(wanted.is_known)


def test_one_changed_map_fuses_only_its_branch_anew(team):
    grids, places = team
    layers = layers_of(grids, places)
    tree = FusionTree("log-odds")
    tree.update(layers)
    everything = tree.fusions
    cells = grids["r03"].cells.copy()
    cells[10:14, 10:14] = 100
    layers["r03"].update(TiledGrid.of(OccupancyGrid(cells, 0.05)), places["r03"], 0.05)
    made = tree.update(layers)
    assert 1 <= len(made) <= 4
    assert tree.fusions - everything == 3 * len(made)  # eight robots: three fusions from the leaf to the root
    assert tree.update(layers) == []
    anew = FusionTree("log-odds")
    anew.update(layers)
    assert {k: v.tobytes() for k, v in anew.cells.items()} == {k: v.tobytes() for k, v in tree.cells.items()}


def test_robots_come_and_go(team):
    grids, places = team
    layers = layers_of(grids, places)
    tree = FusionTree("log-odds")
    for some in (ROBOTS[:3], ROBOTS, ROBOTS[2:5], [], ROBOTS[1:2], ROBOTS):
        present = {x: layers[x] for x in some}
        tree.update(present)
        anew = FusionTree("log-odds")
        anew.update(present)
        assert {k: v.tobytes() for k, v in anew.cells.items()} == {k: v.tobytes() for k, v in tree.cells.items()}


def test_no_more_nodes_are_kept_than_there_may_be_and_tiles_without_are_fused_the_same(team, monkeypatch):
    grids, places = team
    layers = layers_of(grids, places)
    bounded, unbounded = FusionTree("log-odds"), FusionTree("log-odds")
    for changed in (None, "r03", "r05"):
        if changed is not None:
            layers[changed].update(TiledGrid.of(noisy(77)), places[changed], 0.05)
        with monkeypatch.context() as patch:
            patch.setattr("mrslam.merge.grids.fusion_tree.MOST_NODES", 20)
            bounded.update(layers)
        unbounded.update(layers)
        assert sum(map(len, bounded._nodes.values())) == bounded._kept <= 20
        assert len(bounded._nodes) >= 2  # the last fused: each has seven, of eight robots
        assert {k: v.tobytes() for k, v in bounded.cells.items()} == {
            k: v.tobytes() for k, v in unbounded.cells.items()
        }
    assert sum(map(len, unbounded._nodes.values())) == unbounded._kept > 20
    bounded.update({})
    unbounded.update({})
    assert not bounded._nodes and bounded._kept == unbounded._kept == 0
