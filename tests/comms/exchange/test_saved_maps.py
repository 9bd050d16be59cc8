"""Saved maps travel as robots' maps do: to whoever takes maps, once, whole, and through third robots."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from mrslam.comms import CommsNode, Send
from mrslam.comms.wire import messages as m
from mrslam.comms.wire.frames import frame
from mrslam.spatial import OccupancyGrid, TiledMap
from tests.comms.puppet import Puppet
from tests.comms.sealed import SealedTeam, team_keys
from tests.comms.team import QUICK, SECOND, Team, big_map, fingerprint

IDS = ["a", "b", "c"]
OFFICE = "office@monday"
WIDE = replace(QUICK, window_tiles=64)


def meet_one_by_one(team: Team) -> None:
    """Let a meet b, then b meet c; a and c never meet."""
    team.groups = {"c": 1}
    team.run(8)
    team.groups = {"a": 2}
    team.run(8)


def give(team: Team, robot: str, seed: int, epoch: int) -> None:
    """Give a robot a saved map, and note what it is."""
    local = team.nodes[robot].give_saved(OFFICE, big_map(seed=seed), epoch)
    team.truth[OFFICE, epoch, 1] = fingerprint(local)


def prints(team: Team) -> list[bytes | None]:
    maps = [node.store.maps.get(OFFICE) for node in team.nodes.values()]
    return [None if one is None else fingerprint(one) for one in maps]


def test_a_saved_map_spreads_also_through_third_robots() -> None:
    team = Team(IDS, config=WIDE)
    give(team, "a", 5, 77)
    meet_one_by_one(team)
    assert len(set(prints(team))) == 1 and team.nodes["c"].store.version(OFFICE) == (77, 1)
    assert OFFICE not in team.nodes["c"].store.digest()  # which is of robots


def test_a_saved_map_is_sent_once() -> None:
    team = Team(["a", "b"], config=WIDE)
    give(team, "a", 5, 77)
    team.run(8)
    bulk = team.nodes["a"].bytes_sent["bulk"]
    assert bulk > 1000 and prints(team)[1] is not None
    team.run(20)  # further exchanges
    assert team.nodes["a"].bytes_sent["bulk"] == bulk


def test_who_was_given_another_map_of_that_name_keeps_it() -> None:
    team = Team(IDS, config=WIDE)
    give(team, "a", 5, 77)
    give(team, "b", 6, 50)
    own = prints(team)[1]
    meet_one_by_one(team)
    assert prints(team) == [prints(team)[0], own, own] and prints(team)[0] != own


@pytest.mark.parametrize("mode", ["mapper", "central"])
def test_robots_that_do_not_both_map_and_merge_take_none(mode: str) -> None:
    team = Team(["a", "b"], config=WIDE, modes={"b": mode})
    give(team, "a", 5, 77)
    team.run(8)
    assert prints(team)[1] is None


@pytest.mark.parametrize("shares", [{"a"}, {"b"}])
def test_sharing_can_be_turned_off_at_either_end(shares: set[str]) -> None:
    team = Team(["a", "b"], config=WIDE)
    for robot in {"a", "b"} - shares:
        team.nodes[robot] = CommsNode(robot, "team", 9, replace(WIDE, share_saved_maps=False))
    give(team, "a", 5, 77)
    team.run(8)
    assert prints(team)[1] is None and "malformed" not in team.nodes["b"].dropped


@pytest.mark.parametrize(("fields", "offered"), [([], 0), ([None], 0), ([[]], 1)])
def test_a_program_that_does_not_know_saved_maps_is_offered_none(fields: list[object], offered: int) -> None:
    node = CommsNode("a", "team", 1, WIDE)
    node.give_saved(OFFICE, big_map(seed=5), 77)
    node.on_peer_joined("b", SECOND)
    node.set_link_quality("b", 1.0, SECOND)
    opening = frame(msgspec.msgpack.encode([2, "b", 1, 5, [], [], *fields]), node.team_tag)
    effects = node.on_message(opening, SECOND, "b")
    sent = [m.decode(one.payload, node.team_tag, 10**6) for one in effects if isinstance(one, Send)]
    assert any(isinstance(one, m.Accept) for one in sent)
    assert sum(isinstance(one, m.Manifest) for one in sent) == offered


@pytest.mark.parametrize("bound", [{"max_tiles": 10}, {"max_keyframes": 499}])
def test_a_map_beyond_the_bounds_of_teammates_is_kept_to_oneself(bound: dict[str, int]) -> None:
    node = CommsNode("a", "team", 1, replace(WIDE, **bound))
    local = big_map(seed=5)
    assert node.give_saved(OFFICE, local, 77) is local and not node.store.saved_digest()


def test_with_keys_the_giver_signs_and_anyone_passes_it_on(tmp_path: Path) -> None:
    team = SealedTeam(team_keys(tmp_path, IDS), IDS, config=WIDE)
    give(team, "a", 5, 77)
    meet_one_by_one(team)
    assert prints(team)[2] == prints(team)[0] is not None
    held = team.nodes["c"].store.newest(OFFICE)
    assert held is not None and held.proof is not None


def test_with_keys_a_map_that_the_giver_did_not_sign_is_refused(tmp_path: Path) -> None:
    team = SealedTeam(team_keys(tmp_path, IDS), IDS, config=WIDE)
    store = team.nodes["a"].store
    store.give(OFFICE, big_map(seed=5), 77)
    signed = store.newest(OFFICE)
    assert signed is not None
    other = TiledMap.from_grid(OccupancyGrid(np.zeros((64, 64), dtype=np.int8), 0.05))
    store._newest[OFFICE] = replace(signed, map=other, blocks=())
    team.run(8)
    assert prints(team)[1] is None and team.nodes["b"].dropped["forged"] > 0


@pytest.mark.parametrize("shares", [True, False])
def test_who_shares_no_saved_maps_gives_none_to_who_asks_for_one_by_name(shares: bool) -> None:
    node = CommsNode("a", "team", 1, replace(WIDE, share_saved_maps=shares))
    node.give_saved(OFFICE, big_map(200), 77)
    asker = Puppet(node, "b")
    asker.meet()
    for question in (m.Ask("b", asker.xid, OFFICE, 0, 0), m.Get("b", asker.xid, OFFICE, 77, 0, 1, b"\1")):
        answers = asker.say(question)
        assert any(isinstance(one, m.Manifest | m.Chunk) for one in answers) == shares
        assert [one.code for one in answers if isinstance(one, m.Done)] == ([] if shares else [m.GIVE_NO_MORE])
