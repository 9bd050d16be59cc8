"""When maps are laid together where their robots saw each other."""

from __future__ import annotations

import numpy as np

from mrslam.agent.effects import AlignJob
from mrslam.agent.pairs.hypotheses import Hypothesis
from mrslam.agent.pairs.sighted import sighted_job
from mrslam.mutual_detection.mutual import MutualFix
from tests.agent.pairs.floors import Floors, S, found


def met() -> tuple[Floors, Hypothesis]:
    """Return a team of two whose robots saw each other, with the place that this proposes."""
    team = Floors("r1", "r2")
    place = team.beliefs["r1", "r2"].places.add(np.array([2.0, 0.0, 0.0]), "sight", 0)
    assert place is not None
    place.fix = MutualFix(place.T_a_b, np.eye(3) * 1e-3, 3)
    return team, place


def due(team: Floors, t_s: float) -> AlignJob | None:
    return sighted_job(team.beliefs, team.maps, 5.0, round(t_s * S))


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
