"""When maps are laid together where their robots saw each other."""

from __future__ import annotations

import numpy as np

from mrslam.agent.effects import AlignJob
from mrslam.agent.pairs.hypotheses import Hypothesis
from mrslam.agent.pairs.sighted import sighted_job
from mrslam.mutual_detection.mutual import MutualFix
from tests.agent.pairs.floors import Floors, S


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


def test_maps_are_not_laid_together_where_their_robots_looked_and_nobody_was() -> None:
    team, place = met()
    place.told["r2"] = -9.0
    assert due(team, 1.0) is None
