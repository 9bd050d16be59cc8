"""A saved map is a teammate that does not move: it is aligned like any, and teammates get it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrslam.agent import Agent, Settings, checkpoint, resume, write_robot
from mrslam.agent.effects import AlignJob, Event
from mrslam.agent.known_map import KnownMap
from mrslam.agent.saved_maps import DOUBTS, pose_in
from mrslam.alignment import Alignment, Evidence, Prior, Rejection, WallEvidence
from mrslam.comms.maps.snapshots import published
from mrslam.merge import Bend
from mrslam.spatial import InputError, OccupancyGrid, se2
from tests.agent.duo import live, robot
from tests.agent.test_team import room

SECOND = 1_000_000_000
MONDAY = "r1@monday"
T_A_MONDAY = np.array([1.0, 2.0, np.pi / 2])


def saved(epoch: int = 7) -> KnownMap:
    return KnownMap((epoch, 1), room())


def robot_with_map(
    *, boot_id: int = 1, epoch: int = 7, settings: Settings | None = None, near: list[float] | None = None
) -> Agent:
    agent = Agent("a", settings or Settings(), boot_id=boot_id)
    snapshot = published(room(), None, 1)
    assert snapshot is not None
    agent.node.store.put("a", snapshot)
    agent.team.take_map("a", KnownMap(snapshot.version, snapshot.local_map))
    agent.take_saved_map(MONDAY, saved(epoch), near)
    return agent


def job(attempt: int) -> AlignJob:
    nothing = OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05)
    return AlignJob("a", MONDAY, nothing, nothing, None, ((1, 1), (7, 1)), (64.0, 64.0), attempt)


def localise(agent: Agent) -> list[Event]:
    """Let the saved map be aligned twice with the robot's own; return the events."""
    found = Alignment(
        T_a_b=T_A_MONDAY, confidence=0.9, evidence=Evidence(WallEvidence(50.0), WallEvidence(50.0)),
        covariance=1e-4 * np.eye(3), method="orb",
    )  # fmt: skip
    effects = [effect for n in range(2) for effect in agent.on_done(job(n), found, (10 + n) * SECOND)]
    return [effect for effect in effects if isinstance(effect, Event)]


def test_the_robot_says_at_once_where_it_is_in_the_saved_maps_frame() -> None:
    agent = robot_with_map()
    assert [at.state for at in agent.whereabouts()] == ["not yet"]
    events = [event for event in localise(agent) if event.kind == "localised"]
    assert len(events) == 1 and events[0].t_ns == 11 * SECOND
    # The robot is at its map's origin: the saved map's frame sees it at the inverse of the saved map's place.
    assert events[0].fields["map"] == MONDAY
    assert [events[0].fields[name] for name in ("x_m", "y_m")] == pytest.approx([-2.0, 1.0])
    assert events[0].fields["theta_rad"] == pytest.approx(-np.pi / 2, abs=1e-4)
    (at,) = agent.whereabouts()
    assert at.state == "localised" and at.T_map_base == pytest.approx(se2.inverse(T_A_MONDAY)) and at.confidence == 0.9
    later = [effect for effect in agent.on_tick(12 * SECOND) if isinstance(effect, Event)]
    assert "localised" not in {event.kind for event in later}  # once


def test_a_place_that_is_withdrawn_is_said_to_be_lost() -> None:
    agent = robot_with_map()
    localise(agent)
    agent.team.beliefs["a", MONDAY].revoke("it fits nowhere now")
    agent.team.displace(MONDAY)
    events = [e for e in agent.on_tick(13 * SECOND) if isinstance(e, Event) and e.kind == "not_localised"]
    assert [event.fields for event in events] == [{"map": MONDAY, "reason": "it fits nowhere now"}]
    assert agent.whereabouts()[0].T_map_base is None
    later = [effect for effect in agent.on_tick(14 * SECOND) if isinstance(effect, Event)]
    assert "not_localised" not in {event.kind for event in later}  # once


def test_a_robot_that_doubts_where_it_is_in_its_own_map_says_nothing_of_the_saved_one() -> None:
    agent = robot_with_map()
    localise(agent)
    for doubtful, kind, state in ((True, "not_localised", "not yet"), (False, "localised", "localised")):
        agent.self_doubt.doubtful = doubtful
        told = [e for e in agent.on_tick(13 * SECOND) if isinstance(e, Event) and "localised" in e.kind]
        assert [event.kind for event in told] == [kind]
        (at,) = agent.whereabouts()
        assert (at.state, at.reason) == (state, DOUBTS if doubtful else "")
        assert (at.T_map_base is None) == doubtful
        assert MONDAY in agent.T_team_map  # the two maps lie as they did


def test_a_robot_that_gave_its_map_up_is_localised_no_more_and_says_why() -> None:
    agent = robot_with_map()
    localise(agent)
    agent._begin_map()
    (event,) = [e for e in agent.on_tick(13 * SECOND) if isinstance(e, Event) and e.kind == "not_localised"]
    assert event.fields == {"map": MONDAY, "reason": "a started a new map"}
    assert agent.next_job(14 * SECOND) is None  # nothing is looked for by the map that was given up
    assert agent.team.beliefs.keys() == set()
    agent.team.take_map("a", KnownMap((2, 1), room()))
    assert agent.team.beliefs["a", MONDAY].words == "a started a new map" and "a" in agent.T_team_map


def test_two_places_that_fit_are_ambiguous() -> None:
    agent = robot_with_map()
    words = "ambiguous: another place fits 90% as well, at most 75% is allowed"
    agent.on_done(job(0), Rejection(reason=words, confidence=0.1, evidence=None, method="orb"), 10 * SECOND)
    (at,) = agent.whereabouts()
    assert (at.state, at.reason, at.T_map_base) == ("ambiguous", words, None)


def barren(agent: Agent, attempt: int, *, matched_m: float = 1.0, area_m2: float = 64.0) -> list[Event]:
    """Let a search everywhere find next to nothing; return the events."""
    nothing = OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05)
    search = AlignJob("a", MONDAY, nothing, nothing, None, ((1, 1), (7, 1)), (area_m2, 200.0), attempt)
    evidence = Evidence(WallEvidence(matched_m), WallEvidence(matched_m))
    outcome = Rejection(reason="too little wall in common", confidence=0.1, evidence=evidence, method="auto")
    effects = agent.on_done(search, outcome, (10 + attempt) * SECOND)
    return [effect for effect in effects if isinstance(effect, Event) and effect.kind == "not_here"]


def test_a_building_that_is_not_the_saved_one_is_said_to_be_another() -> None:
    agent = robot_with_map()
    assert [barren(agent, n) for n in range(2)] == [[], []]
    (event,) = barren(agent, 2)
    words = "of 64 m2 seen 3 searches on end found no place in it that fits (too little wall in common)"
    assert event.fields == {"map": MONDAY, "reason": words}
    (at,) = agent.whereabouts()
    assert (at.state, at.reason, at.T_map_base) == ("not here", words, None)
    assert not barren(agent, 3)  # once
    localise(agent)  # and it goes on looking
    assert agent.whereabouts()[0].state == "localised"


def test_a_robot_that_finds_once_more_that_it_is_elsewhere_says_so_once_more() -> None:
    agent = robot_with_map()
    assert [len(barren(agent, n)) for n in range(3)] == [0, 0, 1]
    assert not barren(agent, 3, matched_m=30.0)  # something of it may fit
    assert [len(barren(agent, n)) for n in range(4, 8)] == [0, 0, 1, 0]


def test_two_places_that_fit_near_where_it_is_said_to_be_are_ambiguous_whatever_searches_found_before() -> None:
    agent = robot_with_map()
    for n in range(3):
        barren(agent, n)
    assert agent.whereabouts()[0].state == "not here"
    near = replace(job(3), prior=Prior(T_A_MONDAY, np.eye(3)))
    agent.on_done(near, Rejection("ambiguous: another place fits 90% as well", 0.1, None, "auto"), 20 * SECOND)
    assert agent.whereabouts()[0].state == "ambiguous"


def test_what_does_not_fit_where_the_robot_was_told_to_be_is_looked_for_everywhere_at_once() -> None:
    agent = robot_with_map(near=[3.0, 1.0])
    for t_s, is_near in ((10, True), (11, False)):
        job = agent.next_job(t_s * SECOND)
        assert isinstance(job, AlignJob) and (job.prior is not None) == is_near
        agent.on_done(job, Rejection("too little wall in common", 0.1, None, "auto"), t_s * SECOND)
    assert agent.next_job(12 * SECOND) is None  # until the map has grown
    belief = agent.team.beliefs["a", MONDAY]
    assert belief.last is not None
    belief.last = replace(belief.last, area_m2=(0.5 * belief.last.area_m2[0], belief.last.area_m2[1]))
    job = agent.next_job(13 * SECOND)
    assert isinstance(job, AlignJob) and job.prior is not None


def test_a_place_found_where_the_robot_was_told_to_be_is_confirmed_before_all_is_searched() -> None:
    agent = robot_with_map(near=[3.0, 1.0])
    job = agent.next_job(10 * SECOND)
    assert isinstance(job, AlignJob) and job.prior is not None
    found = Alignment(
        T_a_b=T_A_MONDAY, confidence=0.9, evidence=Evidence(WallEvidence(50.0), WallEvidence(50.0)),
        covariance=1e-4 * np.eye(3), method="orb",
    )  # fmt: skip
    agent.on_done(job, found, 10 * SECOND)
    assert agent.next_job(11 * SECOND) is None


@pytest.mark.parametrize(("attempt", "changed"), [(2, {"matched_m": 7.0}), (3, {"area_m2": 49.0}), (3, {})])
def test_who_has_seen_little_or_something_that_fits_says_not_yet(attempt: int, changed: dict[str, float]) -> None:
    agent = robot_with_map()
    for n in range(attempt):
        barren(agent, n)
    is_not_here = bool(barren(agent, attempt, **changed)) or agent.whereabouts()[0].state == "not here"
    assert is_not_here == (not changed)


def test_the_pose_in_a_bent_map_is_followed_back_at_the_nearest_keyframe() -> None:
    agent = robot_with_map()
    localise(agent)
    T_map_key = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]])
    T_team_key = np.array([[0.0, 0.0, 0.0], [10.0, 3.0, 0.0]])  # the far end is bent by 3 m
    object.__setattr__(agent.team.layout.placement, "bends", {MONDAY: Bend(T_map_key, T_team_key)})
    for x, expected in ((0.5, [0.5, 0.0]), (9.5, [9.5, -3.0])):
        T_map_base = pose_in(agent.team, MONDAY, np.array([x, 0.0, 0.0]))
        assert T_map_base is not None and T_map_base[:2] == pytest.approx(expected)


def test_the_drive_of_a_saved_map_frees_no_wall() -> None:
    agent = robot_with_map()
    localise(agent)
    assert MONDAY in agent.T_team_map
    wall = OccupancyGrid(np.full((400, 400), 100, dtype=np.int8), 0.05, (-10.0, -10.0))
    x, y, _ = se2.compose(T_A_MONDAY, np.array([3.9, 3.9, 0.0]))  # where the saved robot was, and the own was not
    cells = agent.team.without_ghosts(wall).cells
    assert cells[int((y + 10.0) / 0.05), int((x + 10.0) / 0.05)] == 100
    assert cells[int(13.9 / 0.05), int(13.9 / 0.05)] != 100  # the own way does


@pytest.mark.parametrize(("name", "mode"), [("r1", "distributed"), ("a/b@c", "distributed"), (MONDAY, "mapper")])
def test_a_name_that_a_robot_could_have_or_a_robot_that_does_not_merge_is_refused(name: str, mode: str) -> None:
    with pytest.raises(InputError, match="joined by '@'" if mode == "distributed" else "map and merge"):
        Agent("a", Settings(), mode=mode).take_saved_map(name, saved())


def test_two_saved_maps_of_one_name_are_refused() -> None:
    with pytest.raises(InputError, match="two saved maps are named r1@monday"):
        robot_with_map().take_saved_map(MONDAY, saved())


@pytest.mark.parametrize(("epoch", "is_kept"), [(7, True), (8, False)])
def test_a_restart_keeps_the_place_in_the_very_same_saved_map(epoch: int, is_kept: bool, tmp_path: Path) -> None:
    agent = robot_with_map()
    localise(agent)
    checkpoint.write(checkpoint.freeze(agent), tmp_path / "a.state")
    again = Agent("a", Settings(), boot_id=2)
    again.take_saved_map(MONDAY, saved(epoch))
    resume(again, tmp_path / "a.state")
    assert (MONDAY in again.T_team_map) == is_kept
    kinds = [effect.kind for effect in again.on_tick(20 * SECOND) if isinstance(effect, Event)]
    assert ("localised" in kinds) == is_kept


def test_a_restart_without_the_saved_map_forgets_it(tmp_path: Path) -> None:
    agent = robot_with_map()
    localise(agent)
    checkpoint.write(checkpoint.freeze(agent), tmp_path / "a.state")
    again = Agent("a", Settings(), boot_id=2)
    resume(again, tmp_path / "a.state")
    assert again.next_job(0) is None and not again.team.beliefs and not again.whereabouts()


def test_a_teammate_gets_the_saved_map_and_has_it_after_a_restart(tmp_path: Path) -> None:
    a, b = robot("a", 1), robot("b", 2)
    a.take_saved_map(MONDAY, saved())
    live([a, b], 1, 60)
    assert b.team.saved == {MONDAY} and [at.map_id for at in b.whereabouts()] == [MONDAY]
    assert np.array_equal(b.team.maps[MONDAY].grid.cells, a.team.maps[MONDAY].grid.cells)
    b.team.beliefs["b", MONDAY].attempts = 5
    checkpoint.write(checkpoint.freeze(b), tmp_path / "b.state")
    again = robot("b", 3)
    resume(again, tmp_path / "b.state")
    assert again.team.saved == {MONDAY} and again.team.beliefs["b", MONDAY].attempts == 5


def test_a_saved_map_that_contradicts_itself_is_not_taken_from_a_teammate() -> None:
    a, b = robot("a", 1), robot("b", 2)
    a.take_saved_map(MONDAY, KnownMap((7, 1), room(drove_in_walls=True)))
    live([a, b], 1, 60)
    assert MONDAY in b.node.store.maps and MONDAY in b.team.doubted and not b.team.saved
    checkpoint.freeze(b)


def test_the_summary_keeps_saved_maps_apart_from_teammates(tmp_path: Path) -> None:
    agent = robot_with_map()
    localise(agent)
    write_robot(agent, tmp_path, {})
    row = json.loads((tmp_path / "robot.json").read_text())
    assert list(row["placed"]) == ["a"] and row["pairs"] == [] and row["unplaced"] == {}
    (place,) = row["saved_maps"]
    assert (place["map"], place["state"], place["reason"]) == (MONDAY, "localised", "")
    assert place["T_map_base"] == pytest.approx(list(se2.inverse(T_A_MONDAY)), abs=1e-4)
    assert place["pair"]["accepted_at_s"] == 11.0
