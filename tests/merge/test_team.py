import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrslam.merge import MergeConfig, TeamMapper, fuse, warp
from mrslam.spatial import UNKNOWN, LocalMap, OccupancyGrid, TiledMap, se2
from tests.merge.plans import alignment, truth
from tests.merge.trio import EDGES, MAPS, PLAN, POSES, WIDTH, Mapper, fingerprint, mapper_of


def test_the_team_map_is_the_building():
    team_map = mapper_of().team_map()
    assert list(team_map.T_team_map) == ["r1", "r2", "r3"]
    assert team_map.anchor == "r1"
    wanted = warp(PLAN, se2.inverse(POSES["r1"]))
    assert team_map.grid.known_area_m2() == pytest.approx(wanted.known_area_m2(), rel=0.02)
    T_team_plan = se2.inverse(POSES["r1"])
    for robot_id, T_team_map in team_map.T_team_map.items():
        metres, radians = se2.difference(T_team_map, se2.compose(T_team_plan, POSES[robot_id]))
        assert metres < 0.1
        assert radians < 0.01


@settings(max_examples=15, deadline=None)
@given(st.permutations(["r1", "r2", "r3", ("r1", "r2"), ("r2", "r3"), "look", "old r2", "revoke"]))
def test_any_order_of_arrival_gives_the_same_bytes(order):
    """Maps, alignments, looks, an older map of r2 and an alignment taken back may come at any time before."""
    mapper = Mapper()
    old = OccupancyGrid(MAPS["r2"].cells[:80], 0.05, MAPS["r2"].origin_m)
    for what in order:
        if what == "look":
            mapper.team_map()
        elif what == "old r2":
            mapper.set_map("r2", old)
        elif what == "revoke":
            mapper.found["r1", "r3"] = alignment(se2.IDENTITY)
            mapper.team_map()
            del mapper.found["r1", "r3"]
        elif isinstance(what, tuple):
            mapper.found[what] = EDGES[what]
        else:
            mapper.set_map(what, MAPS[what])
    mapper.set_map("r2", MAPS["r2"])
    assert fingerprint(mapper.team_map()) == fingerprint(mapper_of().team_map())


def test_every_anchor_sees_its_own_map_unmoved():
    for anchor in MAPS:
        team_map = mapper_of(anchor=anchor).team_map()
        assert (team_map.T_team_map[anchor] == 0.0).all()
        row0, col0 = np.subtract(MAPS[anchor].cell0, team_map.grid.cell0)
        height, width = MAPS[anchor].shape
        own = team_map.grid.cells[row0 : row0 + height, col0 : col0 + width]
        both = MAPS[anchor].is_known
        assert (own[both] != UNKNOWN).all()


def test_a_map_grown_a_hundred_times_moves_no_landmark():
    """The anchor's map grows to all sides, its alignment with the other is found anew each time, a little different."""
    rng = np.random.default_rng(3)
    T_r1_r2 = truth(POSES, "r1", "r2")
    landmark_r2 = np.array([-2.0, 1.0])
    mapper = Mapper("r1")
    mapper.set_map("r2", MAPS["r2"])
    seen = []
    for step in range(100):
        share = 0.3 + 0.7 * step / 99
        rows, cols = (round(n * share) for n in MAPS["r1"].shape)
        row0, col0 = MAPS["r1"].shape[0] - rows, (MAPS["r1"].shape[1] - cols) // 2
        cells = MAPS["r1"].cells[row0:, col0 : col0 + cols]
        r, c = MAPS["r1"].cell0
        mapper.set_map("r1", OccupancyGrid.at_cell(cells, 0.05, r + row0, c + col0))
        mapper.found["r1", "r2"] = alignment(T_r1_r2 + rng.normal(size=3) * [0.003, 0.003, 0.0005])
        team_map = mapper.team_map()
        assert (team_map.T_team_map["r1"] == 0.0).all()
        assert team_map.grid.on_lattice
        seen.append(se2.apply(team_map.T_team_map["r2"], landmark_r2))
    assert np.ptp(np.array(seen), axis=0).max() < 0.05


def test_a_wall_stays_in_its_cell_while_the_map_grows():
    plan = PLAN.cells
    mapper = Mapper("r1")
    wall = None
    for step in range(100):
        margin = 100 - step
        grown = OccupancyGrid.at_cell(plan[:, margin : WIDTH - margin], 0.05, 0, margin)
        mapper.set_map("r1", grown)
        grid = mapper.team_map().grid
        here = {(r + grid.cell0[0], c + grid.cell0[1]) for r, c in np.argwhere(grid.is_occupied)}
        if wall is not None:
            assert wall <= here
        wall = here


def test_dropping_an_edge_unmerges_and_setting_it_merges_again():
    mapper = mapper_of(anchor="r1")
    whole = fingerprint(mapper.team_map())
    del mapper.found["r2", "r3"]
    apart = mapper.team_map()
    assert list(apart.T_team_map) == ["r1", "r2"]
    assert apart.unplaced == {"r3": "no accepted alignment"}
    without = {x: MAPS[x] for x in ("r1", "r2")}
    assert apart.grid.cells.tobytes() == mapper_of(without, EDGES, "r1").team_map().grid.cells.tobytes()
    mapper.found["r2", "r3"] = EDGES["r2", "r3"]
    assert fingerprint(mapper.team_map()) == whole


def test_an_edge_shown_wrong_by_a_third_robot_is_dropped_and_the_map_heals():
    wrong = {("r1", "r3"): alignment(np.add(truth(POSES, "r1", "r3"), [3.0, 0.0, 0.0]), 0.55)}
    mapper = mapper_of({x: MAPS[x] for x in ("r1", "r3")}, wrong, anchor="r1")
    before = mapper.team_map()
    assert list(before.T_team_map) == ["r1", "r3"]
    mapper.set_map("r2", MAPS["r2"])
    mapper.found |= EDGES
    healed = mapper.team_map()
    assert list(healed.dropped) == [("r1", "r3")]
    assert healed.grid.cells.tobytes() == mapper_of(anchor="r1").team_map().grid.cells.tobytes()


def test_an_edge_is_dropped_once_the_maps_grow_to_contradict_it():
    """As long as the maps say nothing against it a wrong alignment stands; what they see later takes it back."""
    wrong = alignment(np.add(truth(POSES, "r1", "r2"), [0.0, 0.0, np.pi / 2]))
    young = OccupancyGrid(MAPS["r2"].cells[:30, :30], 0.05, MAPS["r2"].origin_m)
    mapper = mapper_of({"r1": MAPS["r1"], "r2": young}, {("r1", "r2"): wrong}, anchor="r1")
    assert "r2" in mapper.team_map().T_team_map
    mapper.set_map("r2", MAPS["r2"])
    team_map = mapper.team_map()
    assert list(team_map.T_team_map) == ["r1"]
    assert "contradicted" in team_map.dropped["r1", "r2"]
    assert "% is on the other's free space" in team_map.unplaced["r2"].replace(" %)", " %")


def test_contradiction_on_the_way_drops_the_weakest_edge():
    """r1 and r3 never aligned, but placed through r2 they lie on each other: one of the two edges is wrong."""
    young = OccupancyGrid(MAPS["r2"].cells[:40, :40], 0.05, MAPS["r2"].origin_m)
    maps = {"r1": MAPS["r1"], "r2": young, "r3": MAPS["r1"]}
    T_r1_r2 = truth(POSES, "r1", "r2")
    turned = se2.compose(se2.inverse(T_r1_r2), se2.transform(0.5, 0.5, 0.5))
    edges = {("r1", "r2"): alignment(T_r1_r2, 0.9), ("r2", "r3"): alignment(turned, 0.6)}
    mapper = mapper_of(maps, edges, anchor="r1")
    team_map = mapper.team_map()
    assert list(team_map.dropped) == [("r2", "r3")]
    assert "placed through it" in team_map.dropped["r2", "r3"]


def test_only_what_changed_is_done_again():
    mapper = mapper_of(anchor="r1")
    mapper.team_map()
    tiles, fusions = mapper.tiles_warped, mapper.fusions
    mapper.team_map()
    assert (mapper.tiles_warped, mapper.fusions) == (tiles, fusions)
    cells = MAPS["r2"].cells.copy()
    cells[100:104, 100:104] = 100
    mapper.set_map("r2", OccupancyGrid(cells, 0.05, MAPS["r2"].origin_m))
    mapper.team_map()
    assert 0 < mapper.tiles_warped - tiles < tiles / 4
    assert 0 < mapper.fusions - fusions < fusions / 2


def test_what_others_show_is_asked_without_drawing_the_own_map() -> None:
    mapper = mapper_of(anchor="r1")
    shown = mapper.elsewhere("r1", ["r2"], EDGES).shown
    drawn = mapper.tiles_warped
    layers = mapper.team_map().layers
    cells = np.array(
        [[64 * i + r, 64 * j + c] for (i, j), tile in layers["r2"].items() for r, c in np.argwhere(tile == 100)]
    )
    assert shown.count(cells, np.ones(len(cells), dtype=np.bool_)).all() and len(cells) > 100
    assert 0 < drawn < mapper.tiles_warped and mapper.fusions > 0


def test_a_map_of_the_same_content_changes_nothing():
    mapper = mapper_of(anchor="r1")
    mapper.team_map()
    fusions = mapper.fusions
    copy = OccupancyGrid(MAPS["r2"].cells.copy(), 0.05, MAPS["r2"].origin_m)
    mapper.set_map("r2", copy)
    mapper.team_map()
    assert mapper.fusions == fusions


@pytest.mark.parametrize("method", ["log-odds", "max", "mean"])
def test_the_team_map_is_the_fusion_of_the_warped_layers(method):
    mapper = mapper_of(config=MergeConfig(fusion=method))
    team_map = mapper.team_map()
    wanted = fuse([warp(MAPS[x], T, 0.05) for x, T in team_map.T_team_map.items()], method).cropped()
    assert team_map.grid.cells.tobytes() == wanted.cells.tobytes()
    assert team_map.grid.origin_m == wanted.origin_m


def test_maps_of_different_resolutions_meet_on_the_finest_lattice():
    maps = MAPS | {"r2": warp(MAPS["r2"], se2.IDENTITY, 0.1)}
    team_map = mapper_of(maps).team_map()
    assert team_map.grid.resolution_m == 0.05
    assert list(team_map.T_team_map) == ["r1", "r2", "r3"]
    coarse = mapper_of(maps, config=MergeConfig(resolution_m=0.1)).team_map()
    assert coarse.grid.resolution_m == 0.1
    assert coarse.grid.known_area_m2() == pytest.approx(team_map.grid.known_area_m2(), rel=0.02)


def test_a_removed_robot_is_forgotten():
    mapper = mapper_of(anchor="r1")
    mapper.team_map()
    mapper.remove_map("r2")
    team_map = mapper.team_map()
    assert list(team_map.T_team_map) == ["r1"]
    assert "r2" not in team_map.unplaced
    mapper.set_map("r2", MAPS["r3"])
    mapper.found = {("r1", "r2"): alignment(truth(POSES, "r1", "r3"))}
    maps, edges = {"r1": MAPS["r1"], "r2": MAPS["r3"]}, {("r1", "r2"): alignment(truth(POSES, "r1", "r3"))}
    anew = mapper_of(maps, edges, "r1")
    assert mapper.team_map().grid.cells.tobytes() == anew.team_map().grid.cells.tobytes()


def test_empty_maps_and_no_maps_are_no_trouble():
    empty = OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05)
    assert Mapper().team_map().grid.shape == (0, 0)
    mapper = mapper_of({"r1": empty, "r2": MAPS["r2"]}, {})
    assert list(mapper.team_map().T_team_map) == ["r2"]
    assert mapper_of({"r1": empty}, {}, "r1").team_map().grid.shape == (0, 0)


def test_all_pairs_of_edges_give_one_answer_whichever_way_they_are_given():
    full = {pair: alignment(truth(POSES, *pair)) for pair in itertools.combinations(MAPS, 2)}
    turned = {(b, a): alignment(truth(POSES, b, a)) for a, b in full}
    one, two = mapper_of(edges=full).team_map(), mapper_of(edges=turned).team_map()
    for robot_id in MAPS:
        np.testing.assert_allclose(one.T_team_map[robot_id], two.T_team_map[robot_id], atol=1e-6)


def test_a_kept_frame_stays_while_its_map_is_in_the_largest_component():
    mapper = Mapper(keeps_frame=True)
    for robot_id in ("r2", "r3"):
        mapper.set_map(robot_id, MAPS[robot_id])
        assert mapper.team_map().anchor == "r2"  # r3's map is larger
    mapper.found["r2", "r3"] = EDGES["r2", "r3"]
    mapper.set_map("r1", MAPS["r1"])
    mapper.found["r1", "r2"] = EDGES["r1", "r2"]
    whole = mapper.team_map()
    assert whole.anchor == "r2" and list(whole.T_team_map) == ["r1", "r2", "r3"]  # r1 would be first by id
    assert not whole.T_team_map["r2"].any()
    mapper.found = {("r1", "r3"): alignment(truth(POSES, "r1", "r3"))}
    assert mapper.team_map().anchor == "r1"  # r2 is alone now
    mapper.remove_map("r1")
    mapper.remove_map("r3")
    assert mapper.team_map().anchor == "r2"
    mapper.remove_map("r2")
    assert mapper.team_map().anchor is None and mapper.team_map().grid.cells.size == 0


@dataclass(frozen=True, eq=False)
class InTiles:
    """A map in tiles."""

    local: LocalMap

    @cached_property
    def grid(self) -> OccupancyGrid:
        return self.local.map.to_grid()


def test_maps_in_tiles_give_the_team_map_of_grids_as_they_grow_and_change():
    """One grows on new ground, on ground that it knows, and by nothing; tiles that are as they were are one object."""
    rng, before = np.random.default_rng(0), {name: TiledMap.from_grid(grid) for name, grid in MAPS.items()}
    by_tiles, by_grids = TeamMapper("r1"), TeamMapper("r1")
    for rows in (40, 80, 80, 160):
        for name, grid in MAPS.items():
            seen = np.full(grid.shape, UNKNOWN, dtype=np.int8)
            seen[:rows] = grid.cells[:rows]
            if rows == 160:
                seen[rng.integers(0, 30, 50), rng.integers(0, 60, 50)] = 100
            now = OccupancyGrid(seen, grid.resolution_m, grid.origin_m)
            tiles = {
                index: held if held is not None and np.array_equal(held.cells, tile.cells) else tile
                for index, tile in TiledMap.from_grid(now).tiles.items()
                for held in [before[name].tiles.get(index)]
            }
            before[name] = TiledMap(grid.resolution_m, tiles)
            by_tiles.set_map(name, InTiles(LocalMap(before[name])))
            by_grids.set_map(name, now)
        one, two = by_tiles.team_map(EDGES), by_grids.team_map(EDGES)
        assert list(one.T_team_map) == list(MAPS)
        assert one.grid.origin_m == two.grid.origin_m and np.array_equal(one.grid.cells, two.grid.cells)
        placement, area_m2 = by_tiles.team_area(EDGES)
        assert area_m2 == pytest.approx(one.grid.known_area_m2()) and list(placement.T_team_map) == list(MAPS)


def test_a_map_of_other_cells_is_another_map():
    mapper, cells = TeamMapper("r1"), np.zeros((20, 20), dtype=np.int8)
    for resolution_m in (0.05, 0.1):
        mapper.set_map("r1", OccupancyGrid(cells, resolution_m))
        assert mapper.team_map({}).grid.known_area_m2() == pytest.approx((20 * resolution_m) ** 2)
