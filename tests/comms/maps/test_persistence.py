from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.comms import CommsNode, restore_store, store_state
from mrslam.comms.maps.snapshots import published
from mrslam.spatial import LocalMap, Tile, TiledMap
from tests.comms.team import QUICK, Team, big_map, fingerprint


def test_what_a_lost_life_published_after_its_last_saving_does_not_stay_with_teammates():
    for seed in range(5):
        team = Team("b")
        team.start("a", boot_id=50 + seed)
        team.publish("a")
        assert team.run_until_agreed(10)
        state = store_state(team.nodes["a"].store)
        saved = team.maps["a"]
        tiles, revision, stamps, poses = dict(saved.tiles), saved.revision, list(saved.stamps), list(saved.poses)
        team.publish("a")  # lost here, but b has it
        assert team.run_until_agreed(10)
        team.crash("a")
        team.run(5)
        team.start("a", boot_id=90)
        again = team.maps["a"]
        again.tiles, again.revision, again.stamps, again.poses = tiles, revision + 1000, stamps, poses
        restore_store(team.nodes["a"].store, state, 1000)
        team._record("a")
        assert team.run_until_agreed(20)
        for _ in range(2):
            held = [fingerprint(node.store.maps["a"]) for node in team.nodes.values()]
            assert held[0] == held[1]
            team.publish("a")
            assert team.run_until_agreed(20)


def test_a_map_begun_after_a_restart_has_no_number_that_the_lost_life_may_have_used():
    lost, again = CommsNode("a", "team", 5, QUICK), CommsNode("a", "team", 9, QUICK)
    lost.publish(big_map(200), 0)
    restore_store(again.store, store_state(lost.store), 1000)
    assert again.store.own_epoch == 5  # the map goes on
    again.begin_map()
    assert again.store.own_epoch == 9  # 6 may be another map's


@pytest.mark.parametrize("is_given_up", [False, True])
def test_above_an_earlier_life_goes_the_map_that_is_current_and_none_that_was_given_up(is_given_up: bool):
    node = CommsNode("a", "team", 5, QUICK)
    node.publish(big_map(200), 0)
    if is_given_up:
        node.begin_map()
    assert node.store.outrank((40, 3)) and node.store.own_epoch == 41
    assert node.store.version("a")[0] == (5 if is_given_up else 41)
    assert not node.store.outrank((40, 9))


def test_a_saved_map_that_a_robot_is_given_is_not_replaced_by_one_it_once_had_from_a_teammate():
    team = Team("ab", config=replace(QUICK, window_tiles=64))
    team.truth["office@monday", 77, 1] = fingerprint(team.nodes["a"].give_saved("office@monday", big_map(200), 77))
    held = team.nodes["b"].store
    assert team.run_until(lambda: held.version("office@monday") == (77, 1))
    again = CommsNode("b", "team", 9, QUICK)
    again.give_saved("office@monday", big_map(200, seed=1), 66)
    restore_store(again.store, store_state(held), 1000)
    assert again.store.version("office@monday") == (66, 1)
    assert list(store_state(held)["maps"]) == ["office@monday"] and not store_state(again.store)["maps"]


def test_a_state_with_a_map_that_spans_more_than_memory_holds_is_refused():
    node, far = CommsNode("a", "team", 1, QUICK), np.full((64, 64), 100, dtype=np.int8)
    node.publish(LocalMap(TiledMap(0.05, {(0, 0): Tile(1, far), (1, 1): Tile(1, far)}, 1)), 0)
    state = store_state(node.store)
    state["maps"]["a"]["places"] = np.array([[0, 0], [10**6, 10**6]])
    with pytest.raises(ValueError, match="too wide"):
        restore_store(CommsNode("a", "team", 2, QUICK).store, state, 1000)


def test_what_is_published_of_an_older_state_is_sent_where_it_differs():
    """A map may fall back: its tiles bear older revisions then, and teammates hold what they were since."""
    before, gone, same = (np.full((64, 64), value, dtype=np.int8) for value in (0, 50, 100))
    held = published(LocalMap(TiledMap(0.05, {(0, 0): Tile(3, gone), (0, 1): Tile(3, same)}, 3)), None, 5)
    back = published(LocalMap(TiledMap(0.05, {(0, 0): Tile(2, before), (0, 1): Tile(2, same)}, 4)), held, 5)
    assert {index: tile.revision for index, tile in back.map.tiles.items()} == {(0, 0): 4, (0, 1): 3}


def test_a_map_of_another_resolution_is_another_map():
    node = CommsNode("a", "team", 5, QUICK)
    node.publish(big_map(200), 0)
    coarse = TiledMap(0.1, big_map(200, seed=1).map.tiles, 2)
    node.publish(LocalMap(coarse), 0)
    assert node.store.version("a") == (6, 2)
    assert node.store.maps["a"].map.tiles.keys() == coarse.tiles.keys()


def test_of_maps_that_have_not_changed_nothing_is_copied_for_the_next_checkpoint():
    node = CommsNode("a", "team", 5, QUICK)
    node.publish(big_map(200), 0)
    node.give_saved("office@monday", big_map(200, seed=1), 77)
    first, second = (store_state(node.store)["maps"]["a"] for _ in range(2))
    assert first is second
    assert not first["cells"].flags.writeable and not first["scans"]["polar"].flags.writeable
    newer = big_map(200, seed=2)
    node.publish(replace(newer, map=TiledMap(newer.map.resolution_m, newer.map.tiles, 9)), 0)
    third = store_state(node.store)["maps"]["a"]
    assert third["revision"] == 9 and third["cells"].tobytes() != first["cells"].tobytes()


def test_a_tile_that_left_the_map_is_sent_once_and_not_with_every_version():
    floor = {index: np.zeros((64, 64), dtype=np.int8) for index in ((0, 0), (0, 1))}
    held = published(LocalMap(TiledMap(0.05, {index: Tile(1, cells) for index, cells in floor.items()}, 1)), None, 5)
    for revision in (2, 3, 4):
        held = published(LocalMap(TiledMap(0.05, {(0, 0): Tile(1, floor[0, 0])}, revision)), held, 5)
        assert {index: tile.revision for index, tile in held.map.tiles.items()} == {(0, 0): 1, (0, 1): 2}
