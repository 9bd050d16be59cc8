"""Where teammates found maps is examined before anything is searched for, and changes nothing where they do not fit."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mrslam.agent.config import AgentConfig, Settings
from mrslam.agent.effects import AlignJob
from mrslam.agent.pairs.belief import Attempt, PairBelief
from mrslam.agent.pairs.hints import MOST_FAILED, MOST_HINTS, REPEAT_NS, TIMES, Hints
from mrslam.agent.pairs.others import TRIES_ENOUGH
from mrslam.agent.pairs.schedule import PATIENCE_S
from mrslam.agent.shells import runner
from mrslam.alignment import Prior, Rejection
from mrslam.comms import TeammateHint
from mrslam.merge.graph.edges import pair_of
from tests.agent.duo import live, robot, talk
from tests.agent.pairs.floors import Floors, S, found, merged

NOT_THERE = Rejection("nothing fits there", 0.0, None, "auto")


def hint(peer: str, robot_id: str, x: float = 1.0, epoch: int = 1) -> TeammateHint:
    return TeammateHint(peer, epoch, robot_id, np.array([x, 0.0, 0.0]))


def tried() -> Floors:
    """Return a team that has searched for all of its own pairs just now, and found none."""
    team = Floors("r1", "r2", "r3")
    for _ in range(2):
        team.align(NOT_THERE, 0.0)
    assert team.due(5.0) is None
    return team


@pytest.mark.parametrize(("peer", "other", "x"), [("r1", "r3", 4.0), ("r3", "r1", -4.0), ("r1", "r2", 4.0)])
def test_a_pair_is_examined_where_a_teammate_found_it_and_needs_as_much_as_any_to_be_believed(
    peer: str, other: str, x: float
) -> None:
    team = tried()
    team.hints.hear(hint(peer, other, x))
    job = team.job(5.0)
    assert (job.a, job.b) == tuple(sorted((peer, other))) and job.hinted_by == peer and job.prior is None
    assert job.by_parts  # so may the teammate have found it
    np.testing.assert_allclose(job.place, [4.0, 0.0, 0.0], atol=1e-9)
    team.end(job, found(4.0), 5.0)
    assert team.beliefs[job.a, job.b].alignment is None  # found once
    job = team.job(15.0)
    assert job.hinted_by is None and job.place is not None and job.prior is not None
    team.end(job, found(4.0), 15.0)
    assert team.beliefs[job.a, job.b].status == "accepted"


def test_a_hint_that_fails_changes_nothing_and_is_tried_again_as_maps_grow() -> None:
    team, without = tried(), tried()
    team.hints.hear(hint("r1", "r2"))
    before = vars(team.beliefs["r1", "r2"]).copy()
    assert "not where r1 has it" in team.align(NOT_THERE, 5.0)["reason"]
    assert vars(team.beliefs["r1", "r2"]) == before
    team.hints.hear(hint("r1", "r2", 1.1))  # the same once more
    assert team.due(30.0) is without.due(30.0) is None
    for one in (team, without):
        one.grow("r1", 80, 2)
    assert team.job(30.0).hinted_by == "r1"
    assert team.job(30.0).hinted_by is None and without.due(30.0) == ("r1", "r2")  # its own search takes place as well


def test_hints_of_a_liar_cost_a_few_looks_and_one_who_was_right_is_heard_again() -> None:
    team = tried()
    for k in range(10):
        team.hints.hear(hint("r1", "r3", 10.0 * k))
        if team.due(5.0) is not None:
            team.hints.hear(hint("r1", "r3", 10.0 * k + 5.0))
            team.end(team.job(5.0), NOT_THERE, 5.0)
    assert team.hints._failed == {"r1": MOST_FAILED}
    team.hints.hear(hint("r1", "r2", 4.0))
    assert team.due(5.0) is None
    team.grow("r1", 80, 2)
    team.end(team.job(20.0), found(4.0), 20.0)  # the own search finds what it said
    team.hints.hear(hint("r1", "r3", 7.0))
    assert team.job(21.0).hinted_by == "r1"


def test_hints_about_other_maps_or_about_pairs_known_already_are_not_tried() -> None:
    team = tried()
    team.hints.hear(hint("r1", "r3", epoch=7))  # a map that is not here
    team.hints.hear(hint("r1", "r9"))
    team.hints.hear(hint("r1", "r1"))
    assert team.due(5.0) is None
    team.grow("r3", 64, 1, epoch=2)
    team.hints.hear(hint("r3", "r1", epoch=1))
    team.end(team.job(20.0), NOT_THERE, 20.0)  # its new map, searched for by itself
    assert team.due(20.0) is None
    own = merged()
    own.hints.hear(hint("r1", "r2", 50.0))
    assert own.due(15.0) is None


def test_a_robot_that_begins_another_map_is_not_looked_for_where_the_last_one_was() -> None:
    team = tried()
    team.hints.hear(hint("r1", "r3"))
    team.grow("r3", 64, 1, epoch=2)
    jobs = [job for k in range(9) if isinstance(job := team.next_job((5 + k) * S), AlignJob)]
    assert jobs and all(job.hinted_by is None for job in jobs)


def test_what_is_found_is_told_a_few_times_and_again_to_who_comes() -> None:
    team = merged()
    told = [bool(team.hints.news(team.beliefs, k * REPEAT_NS // 4)) for k in range(20)]
    assert sum(told) == TIMES and told[0] and told[4]
    [(robot_id, T_r2_r1)] = Hints("r2").news(team.beliefs, 0)
    assert robot_id == "r1" and T_r2_r1 == pytest.approx([-1.0, 0.0, 0.0])
    assert Hints("r3").news(team.beliefs, 0) == []  # another's pair
    team.hints.meet()
    assert [len(team.hints.news(team.beliefs, k * REPEAT_NS)) for k in range(100, 103)] == [1, 1, 0]
    for first, sought, told_again in ((200, [], 0), (300, ["r3"], 0), (400, ["r1", "r2"], TIMES)):
        team.hints.meet(sought)
        told = [team.hints.news(team.beliefs, k * REPEAT_NS) for k in range(first, first + 4)]
        assert sum(map(bool, told)) == told_again


def test_hints_kept_of_one_teammate_are_bounded() -> None:
    hints = Hints("r2")
    for k in range(3 * MOST_HINTS):
        hints.hear(hint("r1", f"x{k}"))
    assert len(hints._heard["r1"]) == MOST_HINTS
    kept = set(hints._heard["r1"])
    hints.hear(hint("r1", f"x{3 * MOST_HINTS - 1}", 50.0))  # elsewhere, of a robot that is told of already
    assert set(hints._heard["r1"]) == kept


def test_a_robot_tells_in_its_beacons_where_it_found_a_map() -> None:
    one, two = robot("r1", 1), robot("r2", 1)
    live([one, two], 0, 60)
    job = one.next_job(6 * S)
    assert isinstance(job, AlignJob) and job.hinted_by is None
    one.on_done(job, found(3.0), 6 * S)
    live([one, two], 60, 80)
    job = two.next_job(8 * S)
    assert isinstance(job, AlignJob) and job.hinted_by == "r1" and job.place == pytest.approx([3.0, 0.0, 0.0])
    for k in range(80, 500):
        talk([one, two], k)
    three = robot("r3", 1)
    for k in range(500, 520):  # whoever comes later is told as well
        talk([one, two, three], k)
    assert "r2" in three.team.hints._heard["r1"]
    live([one, two, three], 520, 740)
    three.team.hints._heard.clear()  # as if it had been out of reach so long
    live([one, two, three], 740, 960)
    assert "r2" in three.team.unplaced and "r2" in three.team.hints._heard["r1"]


@pytest.mark.parametrize("x", [2.0, 5.0])
def test_a_hint_where_other_alignments_lead_needs_no_search_for_rivals_neither_to_be_found_nor_to_be_confirmed(
    x: float,
) -> None:
    team = Floors("r1", "r2", "r3")
    for t_s in (0.0, 10.0):
        for _ in range(2):
            job = team.job(t_s)
            team.end(job, found(float(int(job.b[1]) - int(job.a[1]))), t_s)
    assert {"r1", "r3"} <= team.layout.T_team_map.keys()
    team.hints.hear(hint("r1", "r3", x))
    job = team.job(12.0)
    assert job.hinted_by == "r1" and (job.prior is not None) == (x == 2.0) and not job.follows
    team.end(job, found(x), 12.0)
    team.grow("r1", 80, 2)
    jobs = {(job.a, job.b): job for k in range(30) if isinstance(job := step(team, 23.0 + k, x), AlignJob)}
    assert (jobs["r1", "r3"].place is not None) == (x == 2.0)


def step(team: Floors, t_s: float, x: float) -> object:
    """Let what is due end as it was found before, and return it."""
    job = team.next_job(round(t_s * S))
    if isinstance(job, AlignJob):
        team.end(job, found(x if (job.a, job.b) == ("r1", "r3") else 1.0), t_s)
    return job


@pytest.mark.parametrize(("hinted_by", "times"), [(None, 2), ("r1", 1)])
def test_who_is_followed_is_searched_for_nearby_if_it_is_not_at_its_place_and_who_is_hinted_at_is_not(
    hinted_by: str | None, times: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    monkeypatch.setattr(runner, "align", lambda *_, place=None, **__: asked.append(place) or NOT_THERE)
    job = Floors("r1", "r2").job(0.0)
    place = np.zeros(3)
    job = replace(job, place=place, prior=Prior(place, np.eye(3)), hinted_by=hinted_by)
    shell = SimpleNamespace(agent=robot("r1", 1), _matcher=None)
    assert runner.Runner._align(shell, job) is NOT_THERE  # type: ignore[arg-type]
    assert asked == [place, None][:times]


def test_a_large_map_of_which_parts_are_at_its_place_is_not_searched_for_nearby(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[tuple[object, bool]] = []
    in_parts = replace(NOT_THERE, T_a_b=np.zeros(3), may_bend=True, is_in_parts=True)
    monkeypatch.setattr(runner, "align", lambda *_, place, by_parts, **__: asked.append((place, by_parts)) or in_parts)
    monkeypatch.setattr(runner, "align_bent", lambda _a, _b, rejected, *_: rejected)
    place = np.zeros(3)
    job = replace(Floors("r1", "r2").job(0.0), place=place, prior=Prior(place, np.eye(3)))
    shell = SimpleNamespace(agent=robot("r1", 1), _matcher=None)
    assert job.follows and runner.Runner._align(shell, job) is in_parts  # type: ignore[arg-type]
    assert asked == [(place, True)]
    job = replace(job, by_parts=False)
    assert runner.Runner._align(shell, job) is in_parts and asked[1] == (place, False)  # type: ignore[arg-type]


def tried_at(t_s: float) -> PairBelief:
    """Return what is believed of a pair in which a search found nothing."""
    return PairBelief(attempts=1, last=Attempt(round(t_s * S), ((1, 1), (1, 1)), (10.0, 10.0), False))


@pytest.mark.parametrize(
    ("pair", "searching", "waits"),
    [
        (("r1", "r2"), {"r1", "r3"}, True),
        (("r1", "r2"), {"r3"}, False),
        (("r2", "r3"), {"r1", "r3"}, False),  # r2 is the first by id: it searches
        (("r1", "r3"), {"r3"}, True),
        (("r1", "r3"), {"r1"}, True),
        (("r1", "r3"), {"r4"}, False),
    ],
)
def test_a_pair_is_left_to_a_robot_of_it_that_searches_while_that_can_be_relied_on(
    pair: tuple[str, str], searching: set[str], waits: bool
) -> None:
    hints, belief = Hints("r2"), tried_at(10.0)
    assert hints.is_awaited(pair, belief, searching, 20 * S) == waits
    assert not hints.is_awaited(pair, belief, searching, round((10.0 + PATIENCE_S) * S))
    hints._failed = {"r1": 1, "r3": 1}
    assert not hints.is_awaited(pair, belief, searching, 20 * S)
    hints._failed = {next(iter(searching - {"r3"}), "r1"): 1}
    assert hints.is_awaited(pair, belief, {"r1", "r3"}, 20 * S) == (pair == ("r1", "r3"))  # the other one will tell


def test_a_pair_that_was_never_tried_is_left_to_two_others_for_a_while_and_an_own_one_is_not() -> None:
    hints, belief = Hints("r2"), PairBelief()
    assert not hints.is_awaited(("r1", "r2"), belief, {"r1"}, 0)
    for t_s, waits in ((5.0, True), (94.0, True), (96.0, False)):
        assert hints.is_awaited(("r1", "r3"), belief, {"r1", "r3"}, round(t_s * S)) == waits
    hints.forget("r3")  # it began another map
    assert hints.is_awaited(("r1", "r3"), belief, {"r1", "r3"}, 97 * S)


def test_what_was_found_of_two_others_is_confirmed_here_without_waiting() -> None:
    belief = tried_at(10.0)
    belief.stability.update(found())
    assert not Hints("r2").is_awaited(("r1", "r3"), belief, {"r1", "r3"}, 20 * S)


def test_two_others_in_sight_search_for_their_pair_themselves() -> None:
    for searching, left in ((set[str](), False), ({"r1"}, True)):
        team = Floors("r1", "r2", "r3")
        for name in ("r1", "r3"):
            team.beliefs[pair_of("r2", name)].attempts = TRIES_ENOUGH
        for _ in range(2):
            team.align(NOT_THERE, 0.0)
        team.searching = searching
        assert team.due(5.0) == (None if left else ("r1", "r3"))
        assert team.due(6.0 + PATIENCE_S) == ("r1", "r3")


def test_a_pair_that_a_teammate_searches_for_is_searched_for_here_with_patience() -> None:
    alone, served = Floors("r2", "r1"), Floors("r2", "r1")
    served.searching = {"r1"}
    for team in (alone, served):
        team.align(NOT_THERE, 0.0)
        team.grow("r1", 400, 2)
        team.grow("r2", 400, 2)
    assert alone.due(20.0) is not None and served.due(20.0) is None
    assert served.due(PATIENCE_S + 1.0) is not None


@pytest.mark.parametrize("both_are_tied", [False, True])
def test_a_hint_about_two_that_loops_hold_already_is_not_tried(both_are_tied: bool) -> None:
    team = Floors("r1", "r2", "r3", "r4")
    for pair in (("r1", "r2"), ("r2", "r3"), ("r1", "r4"), *[("r3", "r4")] * both_are_tied):
        team.beliefs[pair] = PairBelief(status="accepted", attempts=2)
        team.beliefs[pair].stability.believed = found()
    team.hints.hear(hint("r1", "r3"))
    places = {name: np.zeros(3) for name in team.maps}
    job = team.hints.next_job(team.beliefs, team.maps, places, team.schedule.config, 0)
    assert (job is None) == both_are_tied


def test_what_is_found_in_a_new_own_map_is_told_though_it_lies_where_the_old_one_had_it() -> None:
    team = merged()
    for k in range(TIMES):
        assert team.hints.news(team.beliefs, k * REPEAT_NS)
    assert not team.hints.news(team.beliefs, 9 * REPEAT_NS)
    team.hints.forget("r1")
    assert not team.hints.news(team.beliefs, 10 * REPEAT_NS)
    team.hints.forget("r2")
    assert team.hints.news(team.beliefs, 11 * REPEAT_NS)


def test_a_hint_about_a_new_map_is_heard_though_it_says_the_same_place_as_one_about_the_old_map() -> None:
    team = tried()
    team.hints.hear(hint("r1", "r3", epoch=7))  # of another map than the one that is here
    assert team.due(5.0) is None
    team.hints.hear(hint("r1", "r3", epoch=1))
    assert team.job(5.0).hinted_by == "r1"


@pytest.mark.parametrize(("method", "waits"), [("auto", True), ("random-walk", False)])
def test_where_searches_are_random_a_teammates_search_is_not_waited_for(method: str, waits: bool) -> None:
    config = AgentConfig(align_interval_s=10.0, align_growth=0.1, align_method=method)
    team = Floors("r2", "r1", settings=Settings(agent=config))
    team.searching = {"r1"}
    team.align(NOT_THERE, 0.0)
    team.grow("r1", 400, 2)
    team.grow("r2", 400, 2)
    assert (team.due(20.0) is None) == waits


def test_every_try_of_a_pair_is_independent_of_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    seeds = []
    monkeypatch.setattr(runner, "align", lambda *_, config, **__: seeds.append(config.seed) or NOT_THERE)
    shell, job = SimpleNamespace(agent=robot("r1", 1), _matcher=None), Floors("r1", "r2").job(0.0)
    for attempt in range(3):
        runner.Runner._align(shell, replace(job, attempt=attempt))  # type: ignore[arg-type]
    assert len(set(seeds)) == 3


@pytest.mark.parametrize(("peer", "other"), [("r1", "r3"), ("r3", "r1")])
def test_maps_that_are_examined_where_a_teammate_has_them_go_with_their_own_keyframes(peer: str, other: str) -> None:
    team = tried()
    team.hints.hear(hint(peer, other))
    job = team.job(5.0)
    assert job.hinted_by == peer and job.trails is not None
    assert job.trails[0] is team.maps["r1"].trail and job.trails[1] is team.maps["r3"].trail
