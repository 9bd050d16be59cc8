"""What has arrived replaces what is held only where it is newer."""

from mrslam.comms.maps.manifests import make_manifest
from mrslam.comms.maps.staged_maps import StagedMaps
from mrslam.comms.maps.store import NOTHING, MapStore
from mrslam.spatial import LocalMap, TiledMap
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
