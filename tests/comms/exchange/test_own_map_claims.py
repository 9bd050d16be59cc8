"""Claims to hold a robot's own map: who lies about it must neither silence the robot nor keep it busy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrslam.comms import CommsNode, ExchangeDone, ExchangeFailed, ExchangeStarted, MapUpdated
from mrslam.comms.exchange.own_map_claims import MOST_UNPROVEN
from mrslam.comms.maps.manifests import make_manifest
from mrslam.comms.maps.snapshots import Snapshot
from mrslam.comms.maps.store import LAST_EPOCH, NOTHING, MapStore
from mrslam.comms.wire.messages import GIVE_NO_MORE, HOLD_ALL, Accept, Ask, Done, Open, encode
from tests.comms.puppet import Puppet
from tests.comms.sealed import SealedTeam, seal, team_keys
from tests.comms.team import QUICK, SECOND, Team, big_map, fingerprint

LAST = (LAST_EPOCH, 5)


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    return team_keys(tmp_path_factory.mktemp("keys"), "abc")


def claim(victim: CommsNode, liar: str, version: tuple[int, int], now_ns: int, xid: int = 77, kind=Open) -> None:
    """Let a teammate open an exchange and say that it holds this version of the victim's map."""
    message = kind(liar, 3, xid, [(victim.robot_id, *version)], [])
    victim.on_message(encode(message, victim.team_tag), now_ns, liar)


def restart_from_nothing(team: Team, robot: str, boot_id: int) -> None:
    team.crash(robot)
    team.run(1)
    team.start(robot, boot_id)
    team.publish(robot)


def holds_its_map(team: Team, holder: str, robot: str) -> bool:
    held = team.nodes[holder].store.maps.get(robot)
    own = team.nodes[robot].store
    return held is not None and fingerprint(held) == fingerprint(own.maps[robot])


@pytest.mark.parametrize("version", [LAST, (LAST_EPOCH, 0), (2, 0), (1, 10**9), (2**62, 2**62)])
def test_with_keys_a_claim_without_proof_changes_nothing(keys, version):
    team = SealedTeam(keys, "abc")
    for robot in "abc":
        team.publish(robot)
    team.run(3)
    a = team.nodes["a"]
    epoch = a.store.own_epoch
    team.groups = {"c": 1}  # the liar itself says nothing more
    claim(a, "c", version, team.now_ns)
    team.run(12)
    assert a.store.own_epoch == epoch
    restart_from_nothing(team, "a", boot_id=1)
    assert team.run_until(lambda: holds_its_map(team, "b", "a"), 30)
    assert team.nodes["a"].store.own_epoch < 2**40


@pytest.mark.parametrize("signed_by", [None, "c"])
def test_with_keys_a_claim_with_a_false_proof_is_forgery(keys, signed_by):
    team = SealedTeam(keys, "abc")
    for robot in "abc":
        team.publish(robot)
    team.run(3)
    a, xid = team.nodes["a"], 77
    liar = MapStore("a", LAST_EPOCH, team.config)
    if signed_by is not None:
        liar.use_seal(replace(seal(keys, signed_by), own_id="a"))
    liar.publish(team.maps["c"].grow())
    team.groups = {"c": 1}
    claim(a, "c", liar.version("a"), team.now_ns, xid)
    manifest = make_manifest(liar, "c", xid, "a", NOTHING, None)
    a.on_message(encode(manifest, a.team_tag), team.now_ns, "c")
    assert a.dropped["forged"] == 1
    assert a.store.own_epoch == 1


@given(
    claims=st.lists(
        st.tuples(st.sampled_from([Open, Accept]), st.integers(1, LAST_EPOCH + 9), st.integers(0, 2**62)), max_size=6
    ),
    boots=st.lists(st.integers(1, 2**40), min_size=1, max_size=3),
    reliable=st.booleans(),
)
@settings(max_examples=15, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
def test_with_keys_no_claims_matter_and_every_restart_is_followed(keys, claims, boots, reliable):
    """Also where a robot's later boot ids are lesser: what teammates hold of its earlier lives is proven by it."""
    team = SealedTeam(keys, "abc", reliable=reliable)
    for robot in "abc":
        team.publish(robot)
    highest = 0
    for boot in [*boots, None]:
        team.run(2)
        for k, (kind, *version) in enumerate(claims):
            claim(team.nodes["a"], "c", tuple(version), team.now_ns, 100 + k, kind)
            team.run(0.5)
        highest = max(highest, team.nodes["a"].store.own_epoch)
        if boot is not None:
            restart_from_nothing(team, "a", boot)
            assert team.nodes["a"].store.own_epoch == boot
    assert team.run_until_agreed(90), team.digests()
    assert highest <= max(2**40 + 9, 3) + len(boots)


@pytest.mark.parametrize(("robot", "other"), [("a", "b"), ("b", "a")])
def test_with_keys_an_earlier_life_is_proven_within_one_exchange_whoever_opens_it(keys, robot, other):
    """The lesser name opens. Nothing needs to be asked twice."""
    team = SealedTeam(keys, [other], step_ns=SECOND // 50)
    team.start(robot, 1000)
    team.publish(robot)
    assert team.run_until(lambda: holds_its_map(team, other, robot), 20)
    team.crash(robot)
    team.run(3)  # its token falls
    team.start(robot, 7)
    team.publish(robot)
    begun = team.now_ns
    assert team.run_until(lambda: holds_its_map(team, other, robot), 20)
    assert team.nodes[robot].store.own_epoch == 1001
    team.run(1)
    met = [(at, event) for at, who, event in team.events if at > begun and who == other]
    (started,) = [at for at, event in met if isinstance(event, ExchangeStarted)]
    (updated,) = [at for at, event in met if isinstance(event, MapUpdated)]
    assert updated - started < team.config.retry_s * SECOND
    (done,) = [event for _, event in met if isinstance(event, ExchangeDone)]
    assert done.reason == "complete"
    assert not [event for _, event in met if isinstance(event, ExchangeFailed)]
    assert not any(node.dropped for node in team.nodes.values())


def test_without_keys_lies_about_the_last_epoch_are_recovered_from_at_the_next_meeting():
    team = Team("abc")
    for robot in "abc":
        team.publish(robot)
    team.run(3)
    claim(team.nodes["a"], "c", LAST, team.now_ns)
    team.publish("a")
    assert team.run_until_agreed(30)
    assert team.nodes["a"].store.own_epoch == LAST_EPOCH + 1
    team.may_go_back = True
    restart_from_nothing(team, "a", boot_id=50)
    team.groups = {"c": 1}
    assert team.run_until(lambda: holds_its_map(team, "b", "a"), 30)
    team.groups = {"a": 1}  # c still holds the map of the last epoch, and b does not take it back
    team.run(15)
    assert holds_its_map(team, "b", "a")
    team.groups = {}
    assert team.run_until_agreed(30)
    assert team.nodes["a"].store.own_epoch == 50


def test_without_keys_claims_cost_a_bounded_number_of_epochs_and_the_robot_is_heard_after_that():
    team = Team("abc")
    for robot in "abc":
        team.publish(robot)
    team.run(3)
    a, epochs = team.nodes["a"], set()
    for k in range(3 * MOST_UNPROVEN):
        claim(a, "c", (a.store.own_epoch + int(np.random.default_rng(k).integers(1, 9)), 0), team.now_ns, k)
        epochs.add(a.store.own_epoch)
        team.run(0.25)
    assert 2 <= len(epochs) <= MOST_UNPROVEN + 1
    team.publish("a")
    assert team.run_until_agreed(30)
    # One claim more is not believed; who holds such a map, made up by a liar, gives it up for the robot's own.
    team.may_go_back = True
    for holder in "bc":
        store = team.nodes[holder].store
        made_up = Snapshot(a.store.own_epoch + 9, store.newest("a").map, ())
        store.put("a", made_up)
        store.remember("a", made_up)
    team.publish("a")
    assert team.run_until(lambda: all(holds_its_map(team, holder, "a") for holder in "bc"), 40)
    assert len(epochs | {a.store.own_epoch}) <= MOST_UNPROVEN + 1
    restart_from_nothing(team, "a", boot_id=1000)  # and once the robot is past what it disowned, all pass its map on
    assert team.run_until(lambda: all(holds_its_map(team, holder, "a") for holder in "bc"), 40)
    assert not any(team.nodes[holder].store.disowned for holder in "bc")


def test_a_robot_whose_map_was_disowned_is_heard_again_though_there_is_no_room_for_more_robots() -> None:
    config = replace(QUICK, max_robots=2)
    node = CommsNode("a", "team", 1, config)
    node.publish(big_map(200), 0)
    robot, made_up, own = Puppet(node, "b"), MapStore("b", 90, config), MapStore("b", 50, config)
    for store, epoch in ((made_up, 90), (own, 50)):
        store.publish(big_map(200, seed=epoch))
        robot.meet(("b", epoch, 1))
        robot.bring(store, "b")
        assert node.store.version("b") == (epoch, 1)


def test_a_digest_that_names_the_own_map_many_times_is_one_claim() -> None:
    node = CommsNode("a", "team", 1, QUICK)
    peer = Puppet(node, "b")
    peer.meet(*(("a", 100 + k, 1) for k in range(2 * MOST_UNPROVEN)))
    assert node.store.own_epoch == 100 + 2 * MOST_UNPROVEN
    for k in range(1, MOST_UNPROVEN):  # as many honest claims are followed as if it had named it once
        peer.meet(("a", 1000 * k, 1))
        assert node.store.own_epoch == 1000 * k + 1


def test_with_keys_a_claim_whose_proof_the_peer_does_not_give_holds_up_no_exchange(keys) -> None:
    node = CommsNode("a", "team", 1, QUICK)
    node.seal_maps(seal(keys, "a"))
    peer = Puppet(node, "c")
    asked = peer.meet(("a", *LAST))
    assert any(isinstance(one, Ask) for one in asked) and not any(isinstance(one, Done) for one in asked)
    done = peer.say(Done("c", peer.xid, GIVE_NO_MORE))
    assert [one.code for one in done if isinstance(one, Done)] == [HOLD_ALL]
