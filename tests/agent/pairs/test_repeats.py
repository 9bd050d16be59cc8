"""A building whose maps fitted at wrong places is known to repeat itself: maps alone are believed less from then on."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.agent.effects import Event
from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.pairs.repeats import misfitted_m, too_little, unless_repeated
from mrslam.alignment import Rejection
from mrslam.merge import Pair
from tests.agent.pairs.floors import Floors, found

PAIR = ("r1", "r2")


def beliefs(*fits: tuple[Pair, float, float, float]) -> dict[Pair, PairBelief]:
    """Return what is believed after fits of pairs: at x metres, of so many metres of wall, and what r1 saw there."""
    made: dict[Pair, PairBelief] = {PAIR: PairBelief(), ("r1", "r3"): PairBelief()}
    for pair, x, wall_m, llr in fits:
        made[pair].note(found(x, wall_m=wall_m), 0)
        place = made[pair].places.at(found(x).T_a_b)
        assert place is not None
        place.told = {"r1": llr}
    return made


@pytest.mark.parametrize(
    ("fits", "wrong_m"),
    [
        ([(PAIR, 1.0, 20.0, 0.0)], 0.0),
        ([(PAIR, 1.0, 20.0, -3.9)], 0.0),
        ([(PAIR, 1.0, 20.0, -4.0)], 20.0),
        ([(PAIR, 1.0, 20.0, -4.0), (PAIR, 1.1, 30.0, -4.0), (PAIR, 1.0, 25.0, -4.0)], 30.0),  # one place
        ([(PAIR, 1.0, 20.0, -4.0), (("r1", "r3"), 1.0, 7.0, -6.0)], 27.0),
        ([(PAIR, 1.0, 20.0, 6.0), (PAIR, 9.0, 30.0, 0.0)], 30.0),  # they saw each other at the first
        ([(PAIR, 1.0, 20.0, 5.0), (PAIR, 9.0, 30.0, 0.0)], 20.0),  # one of two places must be wrong
        ([(PAIR, 1.0, 20.0, 6.0), (PAIR, 2.5, 30.0, 0.0)], 0.0),  # a correction
        ([(PAIR, 1.0, 20.0, -4.0), (PAIR, 9.0, 30.0, -4.0)], 50.0),
    ],
)
def test_wall_that_fitted_where_robots_were_not_is_summed_up(
    fits: list[tuple[Pair, float, float, float]], wrong_m: float
) -> None:
    assert misfitted_m(beliefs(*fits)) == pytest.approx(wrong_m)


def test_only_fits_are_noted() -> None:
    belief = PairBelief()
    belief.note(Rejection("too little", 0.1, found(wall_m=30.0).evidence, "auto", found().T_a_b), 0)
    assert len(belief.places) == 0


@pytest.mark.parametrize(
    ("wall_m", "seen", "is_merged", "is_believed"),
    [
        (39.9, 0.0, False, False),
        (40.0, 0.0, False, True),
        (39.9, 0.9, False, True),  # one sighting
        (39.9, -0.9, False, False),
        (39.9, 0.0, True, True),
    ],
)
def test_after_a_wrong_fit_maps_alone_need_twice_its_wall(
    wall_m: float, seen: float, is_merged: bool, is_believed: bool
) -> None:
    held = beliefs((("r1", "r3"), 1.0, 20.0, -6.0), (PAIR, 5.0, 0.0, seen))
    if is_merged:
        held[PAIR].stability.believed = found(5.0)
    outcome = found(5.0, wall_m=wall_m)
    decided = unless_repeated(PAIR, outcome, held)
    assert (decided is outcome) == is_believed
    if isinstance(decided, Rejection):
        assert "20 m of wall fitted at wrong ones): 40 m must agree" in decided.reason
        assert np.array_equal(decided.T_a_b, outcome.T_a_b)


def test_a_rejection_stays_one() -> None:
    outcome = Rejection("too little", 0.1, None, "auto")
    assert unless_repeated(PAIR, outcome, beliefs((PAIR, 1.0, 20.0, -6.0))) is outcome


def test_a_team_that_was_wrong_once_keeps_maps_apart_until_they_share_more() -> None:
    team = Floors("r1", "r2")
    belief = team.beliefs[PAIR]
    team.align(found(9.0, wall_m=20.0), 0.0)
    wrong = belief.places.at(found(9.0).T_a_b)
    assert wrong is not None
    wrong.told = {"r1": -3.0, "r2": -3.0}
    assert misfitted_m(team.beliefs) == 20.0
    assert "must agree, or the robots see each other" in team.align(found(5.0, wall_m=30.0), 20.0)["reason"]
    assert belief.found is None
    team.grow("r2", 128, revision=2)
    team.align(found(5.0, wall_m=41.0), 60.0)
    assert belief.found is not None


@pytest.mark.parametrize(
    ("wall_m", "fitted_m", "seen", "is_left"),
    [
        (19.9, 0.0, 0.0, False),
        (20.0, 0.0, 0.0, True),
        (19.9, 0.0, 0.9, True),  # one sighting
        (19.9, 0.0, -0.9, False),
        (10.0, 25.0, 0.0, True),  # believed when less was known
    ],
)
def test_a_pair_on_less_wall_than_has_fitted_at_wrong_places_is_given_up(
    wall_m: float, fitted_m: float, seen: float, is_left: bool
) -> None:
    held = beliefs((("r1", "r3"), 1.0, 20.0, -6.0), (PAIR, 5.0, fitted_m, seen))
    held[PAIR].stability.believed = found(5.0, wall_m=wall_m)
    given_up = too_little(held)
    assert [pair for pair, _ in given_up] == ([] if is_left else [PAIR])
    assert is_left or "has fitted at wrong places since" in given_up[0][1]


def test_what_was_merged_before_the_building_was_known_to_repeat_itself_is_unmerged() -> None:
    team = Floors("r1", "r2", "r3")
    for t_s in (0.0, 20.0):
        while (due := team.due(t_s)) is not None and due != PAIR:
            team.align(Rejection("too little", 0.1, None, "auto"), t_s)
        team.align(found(5.0, wall_m=15.0), t_s)
    assert team.beliefs[PAIR].status == "accepted" and "r1" in team.layout.T_team_map
    team.grow("r3", 128, revision=2)
    job, wrong = team.job(40.0), found(9.0, wall_m=30.0)
    place = team.beliefs[job.a, job.b].places.add(wrong.T_a_b, "maps", 0)
    assert (job.a, job.b) != PAIR and place is not None
    place.told = {"r3": -6.0}
    (_, unmerged) = team.on_aligned(job, wrong, 40_000_000_000)
    assert isinstance(unmerged, Event) and unmerged.kind == "unmerged" and unmerged.fields["b"] == "r2"
    assert "r1" not in team.layout.T_team_map
