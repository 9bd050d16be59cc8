from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from mrslam.comms import ExchangeDone, MapSeal, load_keys, make_team_keys, own_keys, restore_store, store_state
from mrslam.comms.maps.manifests import make_manifest
from mrslam.comms.maps.seal import PURPOSE
from mrslam.comms.maps.snapshots import Snapshot, published
from mrslam.comms.maps.staged_maps import StagedMaps
from mrslam.comms.maps.store import MapStore
from mrslam.comms.wire import messages as m
from mrslam.comms.wire.frames import WireError
from mrslam.spatial import InputError, Keyframes, LocalMap, Tile, TiledMap
from tests.comms.sealed import SealedTeam, seal, team_keys
from tests.comms.team import QUICK, Team, big_map, fingerprint

IDS = ["a", "b", "c"]


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    return team_keys(tmp_path_factory.mktemp("keys"), IDS)


def sealed_team(keys, **options) -> Team:
    return SealedTeam(keys, IDS, config=replace(QUICK, window_tiles=64), **options)


def meet_one_by_one(team: Team) -> None:
    """Let a meet b, then b meet c; a and c never meet."""
    team.groups = {"c": 1}
    team.run(6)
    team.groups = {"a": 2}
    team.run(6)


def test_signed_maps_spread_also_through_third_robots(keys):
    team = sealed_team(keys)
    for robot in IDS:
        team.publish(robot)
    meet_one_by_one(team)
    held = team.nodes["c"].store
    assert fingerprint(held.maps["a"]) == fingerprint(team.nodes["a"].store.maps["a"])
    for _ in range(3):  # differences are signed too
        team.groups = {}
        team.publish("a")
        assert team.run_until_agreed(20)
    assert not any(node.dropped for node in team.nodes.values())


def spoil(snapshot: Snapshot, how: str) -> Snapshot:
    """Return the snapshot as a liar would pass it on."""
    tiles, blocks = dict(snapshot.map.tiles), snapshot.blocks
    index = min(tiles)
    if how == "a cell":
        cells = tiles[index].cells.copy()
        cells[3, 4] = 100 if cells[3, 4] != 100 else 0
        tiles[index] = Tile(tiles[index].revision, cells)
    elif how == "a tile missing":
        del tiles[index]
    elif how == "a tile moved":
        tiles[index[0] - 7, index[1]] = tiles.pop(index)
    elif how == "a pose":
        poses = blocks[0].poses.copy()
        poses[0, 0] += 1
        blocks = (replace(blocks[0], poses=poses), *blocks[1:])
    elif how == "resolution":
        return replace(snapshot, map=TiledMap(0.1, tiles, snapshot.map.revision))
    elif how == "revision":
        return replace(snapshot, map=TiledMap(0.05, tiles, snapshot.map.revision + 1))
    elif how == "no proof":
        return replace(snapshot, proof=None)
    return replace(snapshot, map=TiledMap(0.05, tiles, snapshot.map.revision), blocks=blocks)


def test_a_restarted_robot_can_still_pass_signed_maps_on(keys):
    team = sealed_team(keys)
    team.publish("a")
    assert team.run_until_agreed(20)
    state = store_state(team.nodes["b"].store)
    team.crash("b")
    team.crash("a")
    team.crash("c")
    team.start("c", boot_id=90)
    team.start("b", boot_id=91)
    restore_store(team.nodes["b"].store, state, 10)
    team.run(10)
    assert "a" in team.nodes["c"].store.maps
    assert not team.nodes["c"].dropped


LIES = ["a cell", "a tile missing", "a tile moved", "a pose", "resolution", "revision", "no proof"]


@pytest.mark.parametrize("how", LIES)
def test_a_certified_robot_cannot_change_anothers_map(keys, how):
    team = sealed_team(keys)
    team.nodes["a"].publish(big_map(300), 0)
    team._record("a")
    team.groups = {"c": 1}
    team.run(6)
    liar = team.nodes["b"].store
    liar._newest["a"] = spoil(liar._newest["a"], how)
    liar._history.pop("a", None)
    team.seen.clear()
    team.groups = {"a": 2}
    team.run(6)
    honest = team.nodes["c"]
    assert honest.dropped["forged"] >= 1
    assert "a" not in honest.store.maps
    assert team.of(ExchangeDone, "c")  # the rest of the meeting goes on
    team.groups = {"b": 3}  # and the robot itself is believed
    team.run(6)
    assert fingerprint(honest.store.maps["a"]) == fingerprint(team.nodes["a"].store.maps["a"])


def test_a_certified_robot_cannot_make_up_anothers_map(keys):
    team = sealed_team(keys)
    team.nodes["b"].publish(big_map(300), 0)
    own = team.nodes["b"].store._newest["b"]
    # b's own map, signed by b, under the name of a.
    team.nodes["b"].store._newest["a"] = own
    team.groups = {"a": 2}
    team.run(6)
    assert team.nodes["c"].dropped["forged"] >= 1
    assert sorted(team.nodes["c"].store.maps) == ["b"]


def test_strangers_and_wrong_statements_are_refused(keys, tmp_path):
    make_team_keys(tmp_path, "team", ["a"])  # the same names, another authority
    good, foreign = seal(keys, "a"), MapSeal.load(load_keys(tmp_path / "a", "a", "team"), "team", "a")
    snapshot = published(big_map(200), None, 5)
    proof = good.sign("a", snapshot)
    judge = seal(keys, "c")
    judge.check("a", snapshot.version, proof)
    for robot, version, lie in [
        ("b", snapshot.version, proof),
        ("a", (5, 2), proof),
        ("a", (6, 1), proof),
        ("a", snapshot.version, replace(proof, root=b"0" * 16)),
        ("a", snapshot.version, replace(proof, signature=b"")),
        ("a", snapshot.version, replace(proof, certificate=b"")),
        ("a", snapshot.version, foreign.sign("a", snapshot)),
        ("a", snapshot.version, replace(proof, certificate=proof.certificate[:-1])),
        ("a", snapshot.version, seal(keys, "b").sign("b", snapshot)),
    ]:
        with pytest.raises(WireError, match="forged"):
            judge.check(robot, version, lie)
    other_team = MapSeal.load(load_keys(keys / "a", "a", "team"), "rivals", "a")
    with pytest.raises(WireError, match="forged"):
        judge.check("a", snapshot.version, other_team.sign("a", snapshot))


def test_tiles_hashed_before_give_the_same_root(keys):
    rng = np.random.default_rng(0)
    warm = seal(keys, "a")
    snapshot = None
    for revision in range(1, 6):
        tiles = {} if snapshot is None else dict(snapshot.map.tiles)
        tiles[int(rng.integers(4)), 0] = Tile(revision, rng.integers(-1, 101, (64, 64)).astype(np.int8))
        snapshot = published(LocalMap(TiledMap(0.05, tiles, revision), Keyframes.empty()), snapshot, 1)
        assert warm.root_of("a", snapshot) == seal(keys, "a").root_of("a", snapshot)


def test_the_certificate_travels_once(keys):
    team = sealed_team(keys)
    sizes = []
    for robot in "ab":
        end = team.ends[robot]

        def send(effect, send=end.send):
            message = m.decode(effect.payload, team.nodes["a"].team_tag, 1 << 20)
            if isinstance(message, m.Manifest):
                sizes.append((type(message), message.base, len(getattr(message, "certificate", b"x" * 999))))
            send(effect)

        end.send = send
    for _ in range(2):
        team.publish("a")
        assert team.run_until_agreed(20)
    assert all(kind is m.SignedManifest for kind, _, _ in sizes)
    assert {base == 0: size > 300 for _, base, size in sizes} == {True: True, False: False}


def test_without_keys_nothing_on_the_wire_changes():
    team = Team("ab")
    kinds = set()
    for robot in "ab":
        end = team.ends[robot]

        def send(effect, send=end.send):
            kinds.add(msgspec.msgpack.decode(effect.payload[11:])[0])
            send(effect)

        end.send = send
    team.publish("a")
    assert team.run_until_agreed(20)
    assert 6 in kinds
    assert 11 not in kinds


def test_the_documented_statement(keys):
    judge = seal(keys, "a")
    expected = PURPOSE + b"team\na\n" + (5).to_bytes(8, "little") + (1).to_bytes(8, "little") + b"r" * 16
    assert judge._statement("a", (5, 1), b"r" * 16) == expected


def test_a_key_folder_tells_whose_it_is(keys, tmp_path):
    team, loaded = own_keys(keys / "b")
    assert team == "team"
    assert loaded.key == keys / "b" / "key.pem"
    with pytest.raises(InputError, match="not a robot's key folder"):
        own_keys(tmp_path)


def test_a_map_is_passed_on_with_its_robots_new_certificate(tmp_path):
    folder = team_keys(tmp_path, "abc")
    first = published(big_map(200), None, 5)
    second = published(big_map(200, seed=1, revision=2), first, 5)
    first = replace(first, proof=seal(folder, "a").sign("a", first))
    (folder / "a" / "key.pem").unlink()  # the robot got another key, and goes on with its map
    make_team_keys(folder, "team", ["a"])
    second = replace(second, proof=seal(folder, "a").sign("a", second))
    giver, taker = (MapStore(name, 1, QUICK) for name in "bc")
    giver.remember("a", first)
    giver.put("a", second)
    taker.use_seal(seal(folder, "c"))
    taker.put("a", first)
    manifest = make_manifest(giver, "b", 1, "a", first.version, None)
    assert manifest.base == 1
    StagedMaps(taker, QUICK).check_proof(manifest)
