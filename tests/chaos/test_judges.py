"""Judges of chaos missions, each with scenes made up for it: what is wrong is said once, what is right is not."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bench.chaos import carried_off, merging
from bench.chaos.carried_off import NOTICED_S, CarriedOff
from bench.chaos.doubt import LOOKS_AGAIN_S, Silence
from bench.chaos.masking import BEAMS_LEAST, Masking
from bench.chaos.merging import UNMERGED_MOST, WAIT_S, Flapping, Merging
from bench.chaos.places import LIE_PLACE_M, Places
from bench.chaos.recovery import NEWS_S, RECOVERED_S, Recovery
from bench.chaos.repeats import KNOWN_S, SIGHT_M, Repeats
from bench.chaos.scene import Report
from mrslam.sim_driver.evaluate.truth import FALSE_MERGE_M, MUST_MERGE
from mrslam.spatial import se2
from tests.chaos.versions import Team, Version, fault


def holds(team: Team, version: Version, *names: str) -> None:
    for name in names:
        team.agents[name].node.store.versions["r1"] = version


@pytest.mark.parametrize(("known_s", "is_said"), [(RECOVERED_S - 1.0, False), (RECOVERED_S + 1.0, True), (1e3, True)])
def test_a_robot_has_recovered_when_all_others_hold_what_it_maps_after_a_fault(known_s: float, is_said: bool) -> None:
    report, team = Report(), Team("r1", "r2", "r3", faults=(fault("slow"),))
    recovery = Recovery(report)
    holds(team, (1, 4), "r1", "r2", "r3")
    recovery.step(team.at(12.0))  # while it lasts
    recovery.step(team.at(15.0))
    holds(team, (1, 5), "r1")
    recovery.step(team.at(16.0))
    holds(team, (1, 5), "r2")
    recovery.step(team.at(17.0))
    assert recovery._cases[0].took_s is None  # r3 has not got it
    if known_s < 100.0:
        holds(team, (1, 5), "r3")
        recovery.step(team.at(15.0 + known_s))
    recovery.at_end(team.at(70.0))
    assert bool(report.violations) is is_said
    assert report.figures["recovery"] == [["slow", "r1", known_s if known_s < 100.0 else None]]


def test_a_robot_that_stands_still_after_a_fault_has_no_newer_map_to_give() -> None:
    report, team = Report(), Team("r1", "r2", faults=(fault("slow"),))
    recovery = Recovery(report)
    holds(team, (1, 4), "r1", "r2")
    for now_s in (15.0, 15.0 + NEWS_S - 0.1, 15.0 + NEWS_S + 0.1):
        assert not recovery._cases or recovery._cases[0].took_s is None
        recovery.step(team.at(now_s))
    assert recovery._cases[0].took_s == pytest.approx(NEWS_S + 0.1)


def test_a_robot_that_doubts_has_not_recovered() -> None:
    report, team = Report(), Team("r1", "r2", faults=(fault("slow"),))
    recovery = Recovery(report)
    holds(team, (1, 4), "r1", "r2")
    team.agents["r1"].self_doubt.doubtful = True
    for now_s in (15.0, 30.0):
        recovery.step(team.at(now_s))
    recovery.at_end(team.at(70.0))
    assert len(report.violations) == 1


def test_a_robot_that_is_sure_and_elsewhere_is_said_once_unless_it_was_blind() -> None:
    for faults, said in (((), 1), ((fault("laser_stuck"),), 0), ((fault("kidnapped"),), 0), ((fault("slow"),), 1)):
        report, team = Report(), Team("r1", faults=faults)
        silence = Silence(report)
        holds(team, (1, 1), "r1")
        team.T_world_base["r1"] = np.array([1.2, 0.0, 0.0])
        for now_s in (11.0, 12.0, 15.0 + LOOKS_AGAIN_S - 0.1):
            silence.step(team.at(now_s))
        assert len(report.violations) == said
    silence.step(team.at(15.0 + LOOKS_AGAIN_S))
    silence.at_end(team.at(70.0))
    assert report.figures["pose"] == [["r1", 1.2]]


def test_publishing_in_doubt_is_said_and_not_what_was_published_before_or_by_another_life() -> None:
    report, team = Report(), Team("r1")
    silence, agent = Silence(report), team.agents["r1"]
    for doubtful, version, said in (
        (False, 1, 0),
        (False, 2, 0),
        (True, 3, 0),
        (True, 3, 0),
        (True, 4, 1),
        (False, 5, 1),
    ):
        agent.self_doubt.doubtful = doubtful
        holds(team, (1, version), "r1")
        silence.step(team.at(10.0))
        assert len(report.violations) == said
    agent.self_doubt.doubtful = True
    silence.step(team.at(11.0))
    team.agents["r1"] = team._agent("r1")
    team.agents["r1"].self_doubt.doubtful = True
    holds(team, (2, 1), "r1")
    silence.step(team.at(12.0))
    assert len(report.violations) == 1


@pytest.mark.parametrize(("masked", "doubts", "is_said"), [(0.4, False, True), (0.6, False, False), (0.4, True, False)])
def test_most_beams_that_hit_a_known_teammate_must_be_masked(masked: float, doubts: bool, is_said: bool) -> None:
    report, team = Report(), Team("r1", "r2")
    team.agents["r2"].self_doubt.doubtful = doubts  # it does not tell where it is
    masking, agent = Masking(report), team.agents["r1"]
    agent.T_team_map["r2"] = np.zeros(3)
    team.T_world_base |= {"r1": np.array([2.0, 0.0, np.pi]), "r2": np.zeros(3)}
    team.T_world_map["r2"] = np.zeros(3)
    scene = team.at(10.0)
    scene.off_m = lambda name, T: 0.0
    mapped = round((1.0 - masked) * 2 * BEAMS_LEAST)
    agent.scan.points_base = lambda: np.concatenate([np.tile([1.8, 0.0], (mapped, 1)), np.tile([1.0, 1.0], (500, 1))])
    agent.masked_beams = round(masked * 2 * BEAMS_LEAST)
    masking.step(scene)
    masking.at_end(scene)
    known = [["r1", 2 * BEAMS_LEAST, pytest.approx(1.0 - masked)]]
    assert report.figures["unmasked"] == ([] if doubts else known)
    assert bool(report.violations) is is_said


@pytest.mark.parametrize(
    ("noticed_s", "looks", "is_said"),
    [(NOTICED_S - 1.0, 0.5, False), (NOTICED_S + 1.0, 0.5, True), (None, 0.5, True), (None, 0.9, False)],
)
def test_a_robot_that_is_carried_off_must_notice_where_the_world_looks_alike_nowhere(
    monkeypatch: pytest.MonkeyPatch, noticed_s: float | None, looks: float, is_said: bool
) -> None:
    monkeypatch.setattr(carried_off, "alike", lambda judge: looks)
    report, team = Report(), Team("r1", faults=(fault("kidnapped", for_s=1.0),))
    judge, agent = CarriedOff(report), team.agents["r1"]
    judge.step(team.at(9.9))
    team.T_world_base["r1"] = np.array([3.0, 0.0, 0.0])
    judge.step(team.at(10.0))
    if noticed_s is not None:
        agent.self_doubt.doubtful = True
        judge.step(team.at(10.0 + noticed_s))
        agent.self_doubt.doubtful = False
    judge.step(team.at(30.0))
    judge.at_end(team.at(70.0))
    assert report.figures["carried off"] == [["r1", looks, 10.0, noticed_s]]
    assert bool(report.violations) is is_said


def test_a_robot_that_begins_another_map_has_noticed_that_it_was_carried_off() -> None:
    team = Team("r1", faults=(fault("kidnapped", for_s=1.0),))
    judge = CarriedOff(Report())
    judge.step(team.at(9.9))
    team.T_world_base["r1"] = np.array([3.0, 0.0, 0.0])
    judge.step(team.at(10.0))
    team.agents["r1"].mapper = object()
    judge.step(team.at(11.0))
    assert judge._cases[0].noticed_s == 1.0


@pytest.mark.parametrize(
    ("apart_m", "walls", "right_at_s", "is_said"),
    [(SIGHT_M - 1.0, 0, None, True), (SIGHT_M + 1.0, 0, None, False), (1.0, 1, None, False), (1.0, 0, 20.0, False)],
)
def test_robots_that_have_met_give_a_wrong_place_up(
    apart_m: float, walls: int, right_at_s: float | None, is_said: bool
) -> None:
    report, team = Report(), Team("r1", "r2")
    repeats, team.walls = Repeats(report), walls
    team.T_world_base["r2"] = np.array([apart_m, 0.0, 0.0])
    for now_s in (5.0, 20.0, 5.0 + KNOWN_S + 1.0, 5.0 + KNOWN_S + 2.0):
        repeats.judge(team.at(now_s), "r1", "r2", now_s == right_at_s)
    assert len(report.violations) == int(is_said)


@pytest.mark.parametrize(
    ("merged_s", "looks", "is_said"),
    [(None, 0.5, True), (5.0 + WAIT_S + 3.0, 0.5, True), (5.0 + WAIT_S - 3.0, 0.5, False), (None, 0.9, False)],
)
def test_robots_whose_maps_overlap_merge_them_in_time(
    monkeypatch: pytest.MonkeyPatch, merged_s: float | None, looks: float, is_said: bool
) -> None:
    monkeypatch.setattr(merging, "alike", lambda judge: looks)
    monkeypatch.setattr(merging, "overlap", lambda *told: MUST_MERGE)
    report, team = Report(), Team("r1", "r2")
    held = {name: SimpleNamespace(map=SimpleNamespace(to_grid=lambda: None)) for name in team.agents}
    team.agents["r1"].node.store.maps = held
    judge = Merging(report)
    judge.step(team.at(5.0))
    if merged_s is not None:
        team.agents["r1"].T_team_map["r2"] = np.zeros(3)
        judge.step(team.at(merged_s))
    judge.at_end(team.at(5.0 + WAIT_S + 10.0))
    assert len(report.violations) == int(is_said)


def test_a_place_is_lost_only_while_both_go_on_with_their_maps() -> None:
    for change, said in (("", 1), ("other", 0), ("own", 0), ("life", 0)):
        report, team = Report(), Team("r1", "r2")
        flapping = Flapping(report)
        for k in range(UNMERGED_MOST + 2):
            agent = team.agents["r1"]
            agent.T_team_map = {"r1": np.zeros(3), "r2": np.zeros(3)}
            flapping.step(team.at(2.0 * k))
            if change == "life":
                team.agents["r1"] = agent = team._agent("r1")
            agent.T_team_map = {"r1": np.zeros(3)}
            agent.node.store.versions |= {"other": {"r2": (k + 1, 0)}, "own": {"r1": (k + 1, 0)}}.get(change, {})
            flapping.step(team.at(2.0 * k + 1.0))
        assert len(report.violations) == said


@pytest.mark.parametrize(("resumed", "again", "said"), [("r1", 2, 0), ("r1", 3, 1), ("r2", 1, 1)])
def test_a_robot_that_was_resumed_may_unmerge_again_what_its_checkpoint_held(
    resumed: str, again: int, said: int
) -> None:
    report, team = Report(), Team("r1", "r2")
    flapping = Flapping(report)
    for k in range(UNMERGED_MOST + again):
        if k == UNMERGED_MOST:
            team.agents[resumed] = team._agent(resumed)
        for places in ({"r1": np.zeros(3), "r2": np.zeros(3)}, {"r1": np.zeros(3)}):
            team.agents["r1"].T_team_map = places
            flapping.step(team.at(2.0 * k))
    assert UNMERGED_MOST == 2 and len(report.violations) == said


@pytest.mark.parametrize(("liar", "said"), [("r1", 0), ("r2", 1)])
def test_whom_a_liar_itself_unmerges_is_no_matter_and_who_unmerges_a_liar_is(liar: str, said: int) -> None:
    report, team = Report(), Team("r1", "r2", faults=(fault("liar", liar, 0.0),))
    flapping = Flapping(report)
    for k in range(UNMERGED_MOST + 2):
        for places in ({"r1": np.zeros(3), "r2": np.zeros(3)}, {"r1": np.zeros(3)}):
            team.agents["r1"].T_team_map = places
            flapping.step(team.at(2.0 * k))
    assert len(report.violations) == said


@pytest.mark.parametrize(
    ("off_m", "alike", "is_said"),
    [(FALSE_MERGE_M - 0.1, 0.0, False), (FALSE_MERGE_M + 0.1, 0.0, True), (FALSE_MERGE_M + 0.1, 1.0, False)],
)
def test_a_wrong_place_is_said_where_the_world_does_not_look_the_same_there(
    off_m: float, alike: float, is_said: bool
) -> None:
    report, team = Report(), Team("r1", "r2")
    team.judge.occupied_precision = lambda *told: alike
    team.T_world_map |= {"r1": np.array([1.0, 2.0, 0.5]), "r2": np.array([4.0, 1.0, -1.0])}
    right = se2.between(team.T_world_map["r1"], team.T_world_map["r2"])
    team.agents["r1"].T_team_map["r2"] = right + np.array([off_m, 0.0, 0.0])
    Places(report).step(team.at(5.0))
    assert bool(report.violations) is is_said


@pytest.mark.parametrize(
    ("pairs", "carried", "is_said"),
    [
        ((("r1", "r3"), ("r2", "r3")), ("r3",), False),
        ((("r1", "r3"), ("r2", "r3")), ("r4",), True),
        ((("r1", "r3"), ("r2", "r3"), ("r1", "r2")), ("r3",), True),
        ((("r1", "r4"), ("r2", "r4"), ("r1", "r3"), ("r2", "r3")), ("r3",), True),
        ((), ("r3",), True),
    ],
)
def test_a_wrong_place_that_hangs_on_a_torn_map_alone_is_nobodys_fault(
    pairs: tuple[tuple[str, str], ...], carried: tuple[str, ...], is_said: bool
) -> None:
    report, team = Report(), Team("r1", "r2", faults=tuple(fault("kidnapped", name) for name in carried))
    team.judge.occupied_precision = lambda *told: 0.0
    team.agents["r1"].T_team_map["r2"] = np.array([FALSE_MERGE_M + 0.5, 0.0, 0.0])
    team.agents["r1"].team.layout.placement.edges = tuple(SimpleNamespace(pair=pair) for pair in pairs)
    Places(report).step(team.at(20.0))
    assert bool(report.violations) is is_said


def test_a_lie_that_came_by_way_of_a_torn_map_is_said_all_the_same() -> None:
    report, team = Report(), Team("r1", "r2", faults=(fault("liar", "r2", 0.0), fault("kidnapped", "r3")))
    team.judge.occupied_precision = lambda *told: 0.0
    team.agents["r1"].node.store.maps["r2"] = SimpleNamespace(map=SimpleNamespace(to_grid=lambda: None))
    team.agents["r1"].T_team_map["r2"] = np.zeros(3)
    team.agents["r1"].team.layout.placement.edges = tuple(
        SimpleNamespace(pair=pair) for pair in (("r1", "r3"), ("r2", "r3"))
    )
    Places(report).step(team.at(20.0))
    assert len(report.violations) == 1 and "believes the lie of r2" in report.violations[0]


@pytest.mark.parametrize(
    ("turn_rad", "walls", "said"), [(0.0, 1.0, 0), (0.0, 0.5, 1), (np.pi, 1.0, 1), (np.pi, 0.5, 2)]
)
def test_a_lie_is_believed_by_its_walls_or_by_where_its_robot_is_shown(
    turn_rad: float, walls: float, said: int
) -> None:
    report, team = Report(), Team("r1", "r2", faults=(fault("liar", "r2", 0.0),))
    team.judge.occupied_precision = lambda *told: walls
    grid = SimpleNamespace(map=SimpleNamespace(to_grid=lambda: None))
    team.agents["r1"].node.store.maps = {"r2": grid}
    team.T_world_map |= {"r1": np.array([1.0, 0.0, 0.0]), "r2": np.array([2.0, 1.0, 0.0])}
    team.T_world_base["r2"] = np.array([2.0 + LIE_PLACE_M, 1.0, 0.0])
    team.agents["r1"].T_team_map["r2"] = np.array([1.0, 1.0, turn_rad])
    Places(report).step(team.at(5.0))
    assert len(report.violations) == said
