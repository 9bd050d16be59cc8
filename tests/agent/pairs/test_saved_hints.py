"""Where a teammate is in a saved map: it is told, and looked at once by everybody who holds that map."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.agent import Agent
from mrslam.agent.effects import AlignJob
from mrslam.agent.pairs.belief import WEAK
from mrslam.agent.pairs.hints import REPEAT_NS, TIMES, Hints
from mrslam.agent.pairs.others import TRIES_ENOUGH
from mrslam.alignment import Alignment
from mrslam.comms import TeammateHint
from mrslam.spatial import se2
from tests.agent.duo import S, deliver, scan, talk
from tests.agent.duo import odometry as turned
from tests.agent.duo import robot as mapping_robot
from tests.agent.pairs.floors import Floors, found
from tests.agent.pairs.test_hints import NOT_THERE
from tests.agent.test_tracking import MONDAY, T_OWN_SAVED, saved_map, tracking_robot

HERE = found(4.0, wall_m=15.0, overlap_m2=10.0)
"""A fit on less wall than a place in a saved map is believed for, at a second look that shows no more."""


def hint(peer: str, x: float = 4.0, robot_id: str = MONDAY) -> TeammateHint:
    return TeammateHint(peer, 1, robot_id, se2.inverse(np.array([x, 0.0, 0.0])))


def searched() -> Floors:
    """Return the team of r2 that knows a saved map, and found nothing in its own so often that it looks at others'."""
    team = Floors("r1", "r2")
    team.save(MONDAY)
    for pair in (("r1", "r2"), (MONDAY, "r2")):
        team.align(NOT_THERE, 0.0)
        team.beliefs[pair].attempts = TRIES_ENOUGH
    return team


def test_a_teammate_whose_map_does_not_grow_is_placed_where_it_says_that_it_is_and_one_look_agrees() -> None:
    team = searched()
    for t_s in (5.0, 15.0):
        assert team.due(t_s) == (MONDAY, "r1")
        team.align(HERE, t_s)
    assert team.beliefs[MONDAY, "r1"].reason == WEAK  # for ever, for its map does not grow
    assert team.due(1000.0) is None

    team.hints.hear(hint("r1"))
    job = team.job(1000.0)
    assert (job.a, job.b, job.hinted_by, job.prior) == (MONDAY, "r1", "r1", None)
    np.testing.assert_allclose(job.place, [4.0, 0.0, 0.0], atol=1e-9)
    team.end(job, HERE, 1000.0)
    assert team.beliefs[MONDAY, "r1"].status == "accepted"
    team.hints.hear(hint("r1", 5.0))
    assert team.due(1001.0) is None  # known by now


def test_a_place_in_a_saved_map_that_is_told_is_not_believed_where_nothing_fits() -> None:
    team = searched()
    team.hints.hear(hint("r1"))
    assert "not where r1 has it" in team.align(NOT_THERE, 5.0)["reason"]
    assert team.beliefs[MONDAY, "r1"].found is None


def test_what_a_robot_tells_of_others_is_a_place_to_look_at_alone() -> None:
    team = Floors("r1", "r2", "r3")
    for _ in range(2):
        team.align(NOT_THERE, 0.0)
    team.hints.hear(hint("r1", robot_id="r3"))
    team.align(HERE, 1.0)
    assert team.beliefs["r1", "r3"].alignment is None


def test_a_robot_tells_its_place_in_a_saved_map_once_it_believes_it() -> None:
    team = searched()
    belief = team.beliefs[MONDAY, "r2"]
    belief.stability.update(HERE)
    assert belief.found is HERE and team.hints.news(team.beliefs, 0) == []  # hearers count it as a look
    belief.stability.update(HERE)
    [(map_id, T_own_saved)] = team.hints.news(team.beliefs, 0)
    assert map_id == MONDAY and T_own_saved == pytest.approx([-4.0, 0.0, 0.0])
    assert Hints("r1").news(team.beliefs, 0) == []  # another's place


def test_a_robot_that_tracks_tells_where_it_tracks_though_others_placed_it_there() -> None:
    agent = tracking_robot()
    agent.team.beliefs.clear()
    hints = Hints("a")
    told = [hints.news(agent.team.beliefs, k * REPEAT_NS, agent.tracking.places) for k in range(5)]
    assert [len(some) for some in told] == [1] * TIMES + [0] * (5 - TIMES)
    [(map_id, T_own_saved)] = told[0]
    assert map_id == MONDAY
    np.testing.assert_allclose(T_own_saved, T_OWN_SAVED, atol=0.05)
    agent.tracking.stop()
    assert agent.tracking.places == {}


def test_a_teammate_that_only_localises_is_placed_by_who_holds_the_same_saved_map() -> None:
    tracker, other = tracking_robot(), mapping_robot("b", 1)
    tracker.team.beliefs.clear()  # where it tracks is what it tells
    other.take_saved_map(MONDAY, saved_map())
    drive([tracker, other], 80, 140)
    assert tracker.tracking.is_on
    job = until_hinted(other, [tracker, other], 140)
    assert (job.a, job.b, job.hinted_by) == ("a", MONDAY, "a")
    np.testing.assert_allclose(job.place, T_OWN_SAVED, atol=0.05)
    fit = Alignment(T_OWN_SAVED, HERE.confidence, HERE.evidence, HERE.covariance, "auto")
    other.on_done(job, fit, 40 * S)
    assert other.team.beliefs["a", MONDAY].status == "accepted"


def drive(agents: list[Agent], first: int, last: int) -> None:
    """Let the agents drive and talk."""
    for k in range(first, last):
        for agent in agents:
            deliver(agents, agent, agent.on_scan(scan(k), turned(k), k * S // 10), k)
        talk(agents, k)


def until_hinted(agent: Agent, agents: list[Agent], k: int) -> AlignJob:
    """Return the first job that a teammate hinted at; searches before it find nothing."""
    for now in range(k, k + 200):
        talk(agents, now)
        job = agent.next_job(now * S // 10)
        if isinstance(job, AlignJob):
            if job.hinted_by is not None:
                return job
            agent.on_done(job, NOT_THERE, now * S // 10)
    raise AssertionError("nobody hinted at anything")
