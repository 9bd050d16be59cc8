"""What has arrived replaces what is held only where it is newer."""

from dataclasses import replace

import numpy as np
import pytest

from mrslam.comms.maps.manifests import make_manifest
from mrslam.comms.maps.snapshots import Snapshot
from mrslam.comms.maps.staged_maps import StagedMaps
from mrslam.comms.maps.store import NOTHING, MapStore
from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.keyframe_codec import BLOCK, KeyframeBlock
from mrslam.spatial import KeyScans, LocalMap, TiledMap, key_scans
from tests.comms.team import QUICK


def test_an_older_snapshot_that_is_whole_replaces_nothing():
    theirs, mine = MapStore("a", 1, QUICK), MapStore("b", 1, QUICK)
    manifests = []
    for revision in (1, 2):
        theirs.publish(LocalMap(TiledMap(0.05, {}, revision)))
        manifests.append(make_manifest(theirs, "a", 7, "a", NOTHING, None))
    staged = StagedMaps(mine, QUICK)
    older, newer = manifests
    assert staged.try_commit(newer) == () and mine.version("a") == (1, 2)
    assert staged.try_commit(older) is None and staged.try_commit(newer) is None
    assert mine.version("a") == (1, 2)


def block(count: int, first: int) -> KeyframeBlock:
    stamps = np.arange(first, first + count, dtype=np.int64)
    return KeyframeBlock(1, stamps, np.zeros((count, 3), np.int32), KeyScans.blank(count))


@pytest.mark.parametrize(
    "blocks",
    [
        (block(10, 0), block(BLOCK, 10)),  # keyframes of the second would be numbered from 64 on
        (block(BLOCK, 0), block(2, BLOCK)),  # more than any map has
    ],
)
def test_a_map_whose_keyframes_do_not_fit_together_is_a_bad_message_and_changes_nothing(
    blocks: tuple[KeyframeBlock, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(key_scans, "KEYFRAMES_MOST", BLOCK + 1)
    theirs, mine = MapStore("a", 1, QUICK), MapStore("b", 1, QUICK)
    theirs._newest["a"] = Snapshot(1, TiledMap(0.05, {}, 1), blocks)
    manifest = make_manifest(theirs, "a", 7, "a", NOTHING, None)
    staged = StagedMaps(mine, QUICK)
    staging = staged.stage(manifest)
    for k, one in enumerate(blocks):
        staging.blocks[k] = one
    with pytest.raises(WireError):
        staged.try_commit(manifest)
    assert mine.newest("a") is None and "a" not in mine.maps


def empty_map(revision: int = 1) -> LocalMap:
    return LocalMap(TiledMap(0.05, {}, revision))


def test_saved_maps_use_up_none_of_the_room_of_robots_maps_and_the_other_way_round() -> None:
    config = replace(QUICK, max_robots=2)
    store, theirs = MapStore("a", 1, config), MapStore("b", 1, config)
    staged = StagedMaps(store, config)
    for name in ("one@b", "two@b"):
        store.give(name, empty_map(), 7)
    assert staged.has_room("b") and staged.has_room("one@b") and not staged.has_room("three@b")
    for name in ("b", "three@b"):
        theirs.put(name, Snapshot(1, TiledMap(0.05, {}, 1), ()))
        staged.stage(make_manifest(theirs, "b", 7, name, NOTHING, None))
    assert set(staged.staging) == {"b"}
    for robot in ("b", "c"):
        store.put(robot, Snapshot(1, TiledMap(0.05, {}, 1), ()))
    assert not staged.has_room("d")


def test_further_versions_of_a_map_take_no_further_room() -> None:
    config = replace(QUICK, max_robots=2)
    store = MapStore("a", 1, config)
    for revision in (1, 2, 3):
        store.publish(empty_map(revision))
    assert StagedMaps(store, config).has_room("b")
