import itertools
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrslam.merge import Bend, MergeConfig, TeamMap, TeamMapper, Trail, fuse, warp
from mrslam.merge.joint.bent_team import BentTeam
from mrslam.merge.joint.consistent import KeyMatch
from mrslam.merge.joint.ties import Tie
from mrslam.merge.joint.ways import HELD_M, Ways
from mrslam.spatial import UNKNOWN, KeyScans, LocalMap, OccupancyGrid, TiledMap, se2
from tests.merge.plans import alignment, building, part, truth

PLAN = building(7)
WIDTH = PLAN.shape[1]
POSES = {  # T_plan_map: where each robot's frame lies in the plan
    "r1": se2.transform(1.0, 2.0, 0.4),
    "r2": se2.transform(6.0, 3.0, -2.0),
    "r3": se2.transform(12.0, 1.0, 1.3),
}
MAPS = {
    "r1": part(PLAN, 0, WIDTH // 2, se2.inverse(POSES["r1"])),
    "r2": part(PLAN, WIDTH // 4, 3 * WIDTH // 4, se2.inverse(POSES["r2"])),
    "r3": part(PLAN, WIDTH // 2, WIDTH, se2.inverse(POSES["r3"])),
}
EDGES = {(a, b): alignment(np.add(truth(POSES, a, b), [0.01, -0.01, 0.001])) for a, b in (("r1", "r2"), ("r2", "r3"))}


class Mapper(TeamMapper):
    """A team mapper with the alignments that a test has accepted so far."""

    def __init__(self, *args, **kwargs) -> None:
        super().__init__(*args, **kwargs)
        self.found = {}

    def team_map(self) -> TeamMap:
        return super().team_map(self.found)


def mapper_of(maps=MAPS, edges=EDGES, anchor=None, config=None) -> Mapper:
    mapper = Mapper(anchor, config)
    for robot_id, grid in maps.items():
        mapper.set_map(robot_id, grid)
    mapper.found = dict(edges)
    return mapper


def fingerprint(team_map) -> bytes:
    poses = b"".join(x.encode() + T.tobytes() for x, T in team_map.T_team_map.items())
    grid = team_map.grid
    head = f"{grid.origin_m} {grid.resolution_m} {grid.shape} {team_map.unplaced} {team_map.dropped} {team_map.anchor}"
    return grid.cells.tobytes() + poses + head.encode()


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


KEYS = np.array([[float(x), 1.0, 0.0] for x in range(4)])
SCANNED = Trail(KEYS, KeyScans.of_points([np.ones((5, 2))] * 4, np.zeros((4, 2))), 1_000_000_000 * np.arange(4))


def scanned(edges=EDGES, anchor="r1") -> Mapper:
    mapper = mapper_of({}, edges, anchor)
    for robot_id, grid in MAPS.items():
        mapper.set_map(robot_id, grid, SCANNED)
    return mapper


def test_maps_with_scans_are_held_against_each_other_once_they_were_joined_and_not_before():
    """Rigidly laid over each other, bent maps contradict each other though their alignment is right."""
    turned = np.add(truth(POSES, "r1", "r2"), [0.0, 0.0, np.pi / 2])
    mapper = scanned({("r1", "r2"): alignment(turned)})
    assert list(mapper.team_map().T_team_map) == ["r1", "r2"]
    mapper.bent = BentTeam(joined=frozenset(MAPS), T_a_b={("r1", "r2"): turned})
    team_map = mapper.team_map()
    assert list(team_map.T_team_map) == ["r1"] and "contradicted" in team_map.dropped["r1", "r2"]


def test_nobody_is_bent_by_a_solution_with_one_who_was_unmerged():
    mapper = scanned()
    T_team_map = mapper.team_map().T_team_map
    shift = {"r1": se2.IDENTITY, "r2": se2.transform(0.1, 0.0, 0.0), "r3": se2.transform(0.0, 0.2, 0.0)}
    bends = {x: Bend(KEYS, se2.compose(shift[x], se2.compose(T, KEYS))) for x, T in T_team_map.items()}
    stamps = dict.fromkeys(MAPS, SCANNED.stamps_ns)
    T_a_b = {pair: found.T_a_b for pair, found in EDGES.items()}
    mapper.bent = BentTeam(bends=bends, joined=frozenset(MAPS), T_a_b=T_a_b, stamps_ns=stamps)
    placement = mapper.placement(mapper.found)
    assert placement.bends.keys() == set(MAPS)
    assert placement.T_team_map["r2"] == pytest.approx(se2.compose(shift["r2"], T_team_map["r2"]))
    without = mapper.placement({("r1", "r2"): EDGES["r1", "r2"]})
    assert not without.bends and list(without.T_team_map) == ["r1", "r2"]
    assert without.T_team_map["r2"] == pytest.approx(T_team_map["r2"], abs=0.02)


def test_a_map_that_moved_in_its_frame_is_drawn_where_it_is_now():
    mapper = mapper_of()
    mapper.team_map()
    x_m, y_m = MAPS["r2"].origin_m
    moved = OccupancyGrid(MAPS["r2"].cells, 0.05, (x_m + 0.5, y_m))
    mapper.set_map("r2", moved)
    assert fingerprint(mapper.team_map()) == fingerprint(mapper_of({**MAPS, "r2": moved}).team_map())


def solution(shift_m: float, keys: np.ndarray = KEYS) -> BentTeam:
    """Return a joint solution that moves r2 sideways from where alignments place it; it was at its ``keys (K, 3)``."""
    bends = {}
    for x, T in mapper_of(anchor="r1").team_map().T_team_map.items():
        own = keys if x == "r2" else KEYS
        bends[x] = Bend(own, se2.compose(se2.transform(0.0, shift_m if x == "r2" else 0.0, 0.0), se2.compose(T, own)))
    T_a_b = {pair: found.T_a_b for pair, found in EDGES.items()}
    stamps = dict.fromkeys(MAPS, SCANNED.stamps_ns)
    return BentTeam(bends=bends, joined=frozenset(MAPS), T_a_b=T_a_b, stamps_ns=stamps)


def test_another_joint_solution_and_a_map_that_has_grown_are_drawn_as_from_nothing():
    mapper, grown = scanned(), MAPS["r2"].cells.copy()
    grown[60:70, 60:70] = 100
    first, second = solution(0.0), solution(0.1)
    for bent, cells in ((first, MAPS["r2"].cells), (second, MAPS["r2"].cells), (second, grown)):
        new = scanned()
        for one in (mapper, new):
            one.set_map("r2", OccupancyGrid(cells, 0.05, MAPS["r2"].origin_m), SCANNED)
            one.bent = bent
        assert fingerprint(mapper.team_map()) == fingerprint(new.team_map())


def test_another_joint_solution_is_judged_anew():
    mapper = scanned()
    mapper.bent = solution(0.0)
    assert list(mapper.team_map().T_team_map) == ["r1", "r2", "r3"]
    mapper.bent = solution(0.8)
    assert "contradicted" in mapper.team_map().dropped["r1", "r2"]
    mapper.bent = solution(0.8, KEYS + np.array([100.0, 0.0, 0.0]))  # it saw from afar what others saw
    assert list(mapper.team_map().T_team_map) == ["r1", "r2", "r3"]


@pytest.mark.parametrize(("key", "is_over"), [(0, True), (4, False)])
def test_bent_maps_are_held_against_each_other_only_where_ties_hold_them(key, is_over):
    """Far along its way from what ties it a bent map has drifted, and its walls say nothing against the tie."""
    mapper = scanned()
    mapper.bent = solution(0.8)
    longer = Trail(np.vstack([KEYS, [[3.0 + HELD_M, 1.0, 0.0]]]), SCANNED.scans)  # it went on before it met anybody
    ties = [Tie(*pair, KeyMatch(key, 0, np.zeros(3), np.eye(3)), True) for pair in (("r2", "r1"), ("r2", "r3"))]
    mapper.bent = replace(mapper.bent, ways=Ways({"r1": SCANNED, "r2": longer, "r3": SCANNED}, ties))
    assert (("r1", "r2") in mapper.team_map().dropped) is is_over


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
