"""When maps are laid together where their robots saw each other."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.agent.effects import AlignJob
from mrslam.agent.pairs.hypotheses import Hypothesis
from mrslam.agent.pairs.schedule import PATIENCE_S, PATIENT_AFTER
from mrslam.agent.pairs.sighted import sighted_job
from mrslam.alignment import Rejection
from mrslam.mutual_detection.mutual import MutualFix
from tests.agent.pairs.floors import Floors, S, found, say, walls


def met() -> tuple[Floors, Hypothesis]:
    """Return a team of two whose robots saw each other, with the place that this proposes."""
    team = Floors("r1", "r2")
    place = team.beliefs["r1", "r2"].places.add(np.array([2.0, 0.0, 0.0]), "sight", 0)
    assert place is not None
    place.fix = MutualFix(place.T_a_b, np.eye(3) * 1e-3, 3)
    return team, place


def due(team: Floors, t_s: float) -> AlignJob | None:
    return sighted_job(team.beliefs, team.maps, lambda pair, T_a_b: False, 5.0, round(t_s * S))


def test_the_same_maps_are_laid_there_once_and_changed_ones_after_the_interval() -> None:
    team, _ = met()
    assert due(team, 1.0) is not None
    assert due(team, 7.0) is None
    team.grow("r1", 66, revision=2)
    assert due(team, 4.0) is None
    assert due(team, 7.0) is not None


def test_the_same_maps_are_laid_together_anew_where_the_place_is_corrected() -> None:
    team, place = met()
    assert due(team, 1.0) is not None
    place.correct(np.array([2.5, 0.0, 0.0]))
    assert due(team, 7.0) is not None


def test_after_some_tries_in_vain_maps_are_laid_there_seldom_until_the_place_is_corrected() -> None:
    team, place = met()
    for k in range(PATIENT_AFTER):
        team.grow("r1", 66 + k, revision=2 + k)
        assert due(team, 6.0 * k) is not None
    last_s = 6.0 * (PATIENT_AFTER - 1)
    team.grow("r1", 80, revision=50)
    assert due(team, last_s + PATIENCE_S - 1.0) is None
    assert due(team, last_s + PATIENCE_S) is not None
    place.correct(np.array([2.5, 0.0, 0.0]))
    assert due(team, last_s + PATIENCE_S + 6.0) is not None


def merge(team: Floors, a: str, b: str) -> None:
    """Have a pair found twice, with both maps in one frame."""
    for attempt in range(2):
        team.end(team.job_of(a, b, attempt), found(0.0), attempt)


def test_robots_that_two_alignments_each_tie_to_the_team_need_no_third_where_it_has_them() -> None:
    team = Floors("r1", "r2", "r3", "r4")
    for pair in (("r1", "r2"), ("r2", "r3"), ("r1", "r4")):
        merge(team, *pair)
    place = team.beliefs["r1", "r3"].places.add(np.array([0.3, 0.0, 0.0]), "sight", 0)
    assert place is not None
    place.told = {"r1": 9.0}
    job = team._sighted_job(S)
    assert job is not None and (job.a, job.b) == ("r1", "r3")  # r3 hangs on one alignment
    merge(team, "r3", "r4")
    place.correct(np.array([0.0, 0.3, 0.0]))
    assert team._sighted_job(20 * S) is None
    other = team.beliefs["r1", "r3"].places.add(np.array([0.0, 9.0, 0.0]), "sight", 0)  # not where the team has them
    assert other is not None
    other.told = {"r3": 10.0}  # and it is where they saw each other more surely
    job = team._sighted_job(20 * S)
    assert job is not None and job.sighted is other.T_a_b
    own = team.beliefs["r2", "r4"].places.add(np.array([0.0, 0.3, 0.0]), "sight", 0)
    assert own is not None
    own.told = {"r4": 9.0}
    job = team._sighted_job(40 * S)
    assert job is not None and (job.a, job.b) == ("r2", "r4")


def test_where_a_place_is_seen_is_known_no_better_than_maps_are_corrected_meanwhile() -> None:
    team, place = met()
    assert place.fix is not None
    place.fix = MutualFix(place.T_a_b, np.eye(3) * 1e-6, 3)
    job = due(team, 1.0)
    assert job is not None and job.prior is not None
    np.testing.assert_allclose(np.sqrt(np.diag(job.prior.covariance)), [0.1, 0.1, 0.03], rtol=0.01)


def test_maps_are_not_laid_together_where_their_robots_looked_and_nobody_was() -> None:
    team, place = met()
    place.told["r2"] = -9.0
    assert due(team, 1.0) is None


def test_maps_that_are_merged_where_nobody_looked_are_laid_where_their_robots_saw_each_other() -> None:
    team = Floors("r1", "r2")
    for t_s in (0.0, 20.0):
        team.align(found(5.0), t_s)
    belief = team.beliefs["r1", "r2"]
    place = belief.places.add(found(1.0).T_a_b, "maps", 0)  # a rival: the building repeats itself
    assert place is not None and belief.alignment is not None
    place.told = {"r1": 4.0}
    assert due(team, 30.0) is None  # may be chance
    place.told = {"r1": 4.0, "r2": 2.0}
    job = due(team, 30.0)
    assert job is not None and job.sighted is not None and place.is_at(job.sighted)
    team.end(job, found(1.0), 31.0)
    assert belief.alignment is not None and place.is_at(belief.alignment.T_a_b)
    assert due(team, 60.0) is None


def test_maps_that_are_laid_where_their_robots_saw_each_other_go_with_their_own_keyframes() -> None:
    team, _ = met()
    job = due(team, 1.0)
    assert job is not None and job.trails is not None
    assert job.trails[0] is team.maps["r1"].trail and job.trails[1] is team.maps["r2"].trail


@pytest.mark.parametrize("is_merged", [False, True])
@pytest.mark.parametrize(("x_m", "llr", "is_tried"), [(5.0, 9.0, False), (5.0, 10.0, True), (1.2, 10.0, False)])
def test_maps_are_laid_nowhere_from_where_they_would_go_at_once_for_what_was_seen(
    x_m: float, llr: float, is_tried: bool, is_merged: bool
) -> None:
    """A second place is tried if it is said more for than for the first, and is not the first one, corrected."""
    team, first = met()
    first.told = {"r1": 9.0}
    belief = team.beliefs["r1", "r2"]
    if is_merged:
        for attempt in range(2):
            job = due(team, 10.0 * attempt)
            if job is not None:
                team.end(job, found(2.0), 10.0 * attempt)
        assert belief.alignment is not None
    second = say(belief, np.array([x_m, 0.0, 0.0]), llr)
    team.grow("r1", 70, revision=5)
    job = due(team, 60.0)
    tried = None if job is None else belief.places.at(job.sighted)
    if is_tried:
        assert tried is second
    else:
        assert tried is (None if is_merged else first)


def test_a_place_that_robots_saw_is_refused_where_they_saw_each_other_more_surely_elsewhere_since() -> None:
    team, place = met()
    job = due(team, 1.0)
    assert job is not None
    say(team.beliefs["r1", "r2"], np.array([9.0, 0.0, 0.0]), 6.0)
    said = team.end(job, Rejection("too little", 0.3, walls(0.0, 0.0), "auto", place.T_a_b), 2.0)
    assert said["status"] == "rejected" and "saw each other with the maps 9.0, 0.0 m apart" in said["reason"]


@pytest.mark.parametrize(("llr", "is_merged"), [(6.0, False), (8.0, True)])
def test_a_place_that_robots_saw_is_refused_where_it_puts_one_where_another_did_not_see_it(
    llr: float, is_merged: bool
) -> None:
    """All three pairs were seen: of those that lead there the first by names counts least, unless it was seen more."""
    team = Floors("r1", "r2", "r3")
    merge(team, "r2", "r3")
    for pair, x_m, said_llr in ((("r2", "r3"), 0.0, 9.0), (("r1", "r3"), 9.0, 7.0), (("r1", "r2"), 1.0, llr)):
        place = say(team.beliefs[pair], np.array([x_m, 0.0, 0.0]), said_llr)
    job = team.job_of("r1", "r2", sighted=place.T_a_b)
    said = team.end(job, Rejection("too little", 0.3, walls(0.0, 0.0), "auto", place.T_a_b), 2.0)
    assert (team.beliefs["r1", "r2"].alignment is not None) == is_merged
    assert is_merged or "placed through it, r1 and r3 saw each other with the maps 9.0, 0.0 m apart" in said["reason"]
