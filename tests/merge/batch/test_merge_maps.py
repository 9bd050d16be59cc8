import json

import numpy as np
import pytest

from mrslam import alignment
from mrslam.merge import MergeConfig, merge_maps, warp
from mrslam.merge.graph.nodes import node_of
from mrslam.spatial import InputError, OccupancyGrid, read_map, se2
from tests.merge.plans import building, part

PLAN = building(11, rooms=7)
WIDTH = PLAN.shape[1]


@pytest.fixture(scope="module", autouse=True)
def compiled():
    alignment.warm_up()


def team(count: int, seed: int = 0, plan: OccupancyGrid = PLAN, share: float = 0.5):
    """Return overlapping parts of a building with their true places ``T_plan_map``."""
    rng = np.random.default_rng(seed)
    maps, poses = {}, {}
    for i in range(count):
        col0 = round(i * (1 - share) * plan.shape[1] / max(count - 1, 1))
        poses[f"m{i}"] = se2.transform(*rng.uniform(-5, 5, 2), rng.uniform(-3, 3))
        maps[f"m{i}"] = part(plan, col0, col0 + round(share * plan.shape[1]), se2.inverse(poses[f"m{i}"]))
    return maps, poses


def assert_placed_right(result, maps, poses, names, within_m=0.1):
    found = result.team_map.T_team_map
    assert list(found) == sorted(names)
    first = sorted(names)[0]
    T_team_plan = se2.compose(found[first], se2.inverse(poses[first]))
    for name in names:
        true, centre = se2.compose(T_team_plan, poses[name]), node_of(maps[name]).centre_m
        apart = se2.apply(found[name], centre) - se2.apply(true, centre)
        assert np.hypot(*apart) < within_m, name


def test_why_a_map_is_not_placed_is_told_by_its_best_try():
    maps, _ = team(3)
    maps["stranger"] = building(91, rooms=4)
    result = merge_maps(maps)
    tries = {a: found for (a, b), found in result.rejections.items() if b == "stranger"}
    nearest = max(tries, key=lambda a: tries[a].confidence)
    said = f"no accepted alignment; nearest was {nearest}: {tries[nearest].reason}"
    assert nearest == "m1" and result.team_map.unplaced["stranger"] == said


def test_of_two_maps_that_do_not_fit_neither_is_the_nearest():
    result = merge_maps({"one": building(91, rooms=4), "two": building(99, rooms=4)})
    (reason,) = result.team_map.unplaced.values()
    (tried,) = result.rejections.values()
    assert reason == f"no accepted alignment: {tried.reason}"


def fingerprint(result) -> bytes:
    poses = b"".join(x.encode() + T.tobytes() for x, T in result.team_map.T_team_map.items())
    return result.team_map.grid.cells.tobytes() + poses + repr(result.team_map.unplaced).encode()


def test_parts_of_a_building_come_together_and_a_stranger_stays_out():
    maps, poses = team(3)
    maps["stranger"] = building(99, rooms=4)
    seen = []
    result = merge_maps(maps, progress=lambda done, total: seen.append((done, total)), workers=2)
    assert_placed_right(result, maps, poses, ["m0", "m1", "m2"])
    assert list(result.team_map.unplaced) == ["stranger"]
    assert result.team_map.unplaced["stranger"].startswith("no accepted alignment; nearest was m")
    assert result.team_map.anchor == "m0"
    assert ("m0", "m1") in result.edges
    assert ("m0", "stranger") in result.rejections
    assert seen == [(i, 6) for i in range(1, 7)]
    assert result.tried >= 6


def test_neither_order_nor_workers_change_a_byte():
    maps, _ = team(3, seed=1)
    one = merge_maps(maps, workers=1)
    two = merge_maps(dict(reversed(maps.items())), workers=2)
    assert fingerprint(one) == fingerprint(two)


def test_the_anchor_gives_the_frame():
    maps, _ = team(2, seed=2, share=0.7)
    result = merge_maps(maps, anchor="m1")
    assert (result.team_map.T_team_map["m1"] == 0.0).all()
    assert "m0" in result.team_map.T_team_map


def test_known_poses_place_maps_that_share_nothing_and_far_pairs_are_not_even_tried():
    poses = {"a": se2.IDENTITY, "b": se2.transform(100.0, 0.0, 0.3)}
    maps = {name: part(PLAN, 0, WIDTH // 3, se2.IDENTITY) for name in poses}
    result = merge_maps(maps, known_poses=poses)
    assert result.tried == 0
    for name, pose in poses.items():
        np.testing.assert_allclose(result.team_map.T_team_map[name], pose, atol=1e-9)
    assert result.team_map.grid.known_area_m2() == pytest.approx(2 * maps["a"].known_area_m2(), rel=0.02)


def test_known_poses_that_memory_cannot_hold_are_refused():
    poses = {"a": se2.IDENTITY, "b": se2.transform(12_000.0, 15_000.0, 0.0)}
    maps = {name: part(PLAN, 0, WIDTH // 3, se2.IDENTITY) for name in poses}
    with pytest.raises(InputError, match=r"the team map would be 120\d\d x 150\d\d m of 0.05 m cells, .* in metres"):
        merge_maps(maps, known_poses=poses)


def test_known_poses_a_little_off_are_corrected_where_maps_overlap():
    maps, poses = team(2, seed=3, share=0.7)
    given = {"m0": poses["m0"], "m1": poses["m1"] + np.array([0.15, -0.1, 0.01])}
    result = merge_maps(maps, known_poses=given)
    found = result.team_map.T_team_map
    centre = node_of(maps["m1"]).centre_m
    true = se2.apply(se2.between(poses["m0"], poses["m1"]), centre)
    assert np.hypot(*(se2.apply(se2.between(found["m0"], found["m1"]), centre) - true)) < 0.05


@pytest.mark.parametrize("far", ["m0", "m1"])
def test_a_known_pose_far_from_its_maps_content_has_a_lever_arm(far):
    """A heading that is wrong by 0.05 rad, which known poses may be, lays a map 200 m from its origin 10 m off."""
    maps, poses = team(2, seed=3, share=0.7)
    T_far_map = se2.transform(200.0, 0.0, 0.0)
    maps[far] = warp(maps[far], T_far_map)
    poses[far] = se2.compose(poses[far], se2.inverse(T_far_map))
    given = poses | {far: poses[far] + np.array([0.0, 0.0, 0.05])}
    result = merge_maps(maps, known_poses=given)
    assert [edge.pair for edge in result.team_map.edges] == [("m0", "m1")]
    found, centre = result.team_map.T_team_map, node_of(maps["m1"]).centre_m
    true = se2.apply(se2.between(poses["m0"], poses["m1"]), centre)
    assert np.hypot(*(se2.apply(se2.between(found["m0"], found["m1"]), centre) - true)) < 0.1


def test_many_maps_are_clustered_without_trying_every_pair():
    """Twelve parts of one building under names that tell nothing, among maps of three others."""
    parts, poses = team(12, seed=4, plan=building(21, rooms=12), share=0.35)
    order = np.random.default_rng(0).permutation(15)
    names = {f"m{i}": f"n{order[i]:02}" for i in range(12)}
    maps = {names[x]: grid for x, grid in parts.items()}
    poses = {names[x]: pose for x, pose in poses.items()}
    for i in range(3):
        maps[f"n{order[12 + i]:02}"] = building(50 + i, rooms=3 + i)
    result = merge_maps(maps, workers=2)
    assert_placed_right(result, maps, poses, list(names.values()))
    assert len(result.team_map.unplaced) == 3
    assert result.tried < 105
    # Loops: more alignments than a tree needs.
    assert len(result.team_map.edges) > 12
    again = merge_maps(dict(reversed(maps.items())), workers=1)
    assert fingerprint(again) == fingerprint(result)


def test_recorded_maps_merge_where_they_truly_lie(data_dir):
    pairs = json.loads((data_dir / "pairs" / "index.json").read_text())["pairs"]
    pair = next(p for p in pairs if p["bin"] == 0.7)
    path = data_dir / "pairs" / pair["file"]
    maps = {"a": read_map(path, "a"), "b": read_map(path, "b")}
    result = merge_maps(maps)
    true = se2.transform(pair["gt"]["tx"], pair["gt"]["ty"], pair["gt"]["theta"])
    centre = node_of(maps["b"]).centre_m
    apart = se2.apply(result.team_map.T_team_map["b"], centre) - se2.apply(true, centre)
    assert np.hypot(*apart) < 0.15


def test_empty_and_single_maps():
    empty = OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05)
    result = merge_maps({"a": PLAN, "nothing": empty})
    assert list(result.team_map.T_team_map) == ["a"]
    assert result.team_map.unplaced["nothing"] == "it shows 0.0 m2, at least 2 m2 are needed"
    alone = merge_maps({"a": PLAN})
    np.testing.assert_array_equal(alone.team_map.grid.cells, PLAN.cells)


def test_the_component_of_most_maps_or_of_most_area():
    small, large = building(31, rooms=3, room_cells=40), building(32, rooms=9)
    maps = {f"s{i}": part(small, 0, small.shape[1], se2.transform(i, 2 * i, 0.3 * i)) for i in range(3)}
    maps |= {f"x{i}": part(large, 0, large.shape[1], se2.transform(i, 0.5, 0.4 * i)) for i in range(2)}
    assert list(merge_maps(maps).team_map.T_team_map) == ["s0", "s1", "s2"]
    assert list(merge_maps(maps, config=MergeConfig(component="area")).team_map.T_team_map) == ["x0", "x1"]


def test_nonsense_is_refused_in_words():
    with pytest.raises(InputError, match="no maps given"):
        merge_maps({})
    with pytest.raises(InputError, match="there is no map 'z' among a"):
        merge_maps({"a": PLAN}, known_poses={"z": se2.IDENTITY})
    with pytest.raises(InputError, match="there is no map 'z' among a"):
        merge_maps({"a": PLAN}, anchor="z")
    with pytest.raises(InputError, match="alignment method must be one of"):
        merge_maps({"a": PLAN, "b": PLAN}, method="magic")


def test_a_map_is_not_said_to_be_nearest_to_itself():
    maps, _ = team(3)
    maps["a stranger"] = building(90, rooms=4)
    assert "nearest was m" in merge_maps(maps).team_map.unplaced["a stranger"]


def test_one_map_with_a_known_pose_places_those_that_fit_it():
    maps, poses = team(3)
    result = merge_maps(maps, {"m0": poses["m0"]})
    assert {"m0", "m1"} <= result.team_map.T_team_map.keys()
    np.testing.assert_allclose(result.team_map.T_team_map["m0"], poses["m0"], atol=1e-9)
