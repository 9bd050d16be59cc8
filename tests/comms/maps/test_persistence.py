from __future__ import annotations

from mrslam.comms import restore_store, store_state
from tests.comms.team import Team, fingerprint


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
