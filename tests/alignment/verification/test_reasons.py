from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from mrslam.alignment import AlignmentConfig, Evidence, WallEvidence
from mrslam.alignment.verification import reasons


def test_the_lead_bounds_the_confidence_as_the_documentation_says() -> None:
    walls = WallEvidence(matched_m=1000.0)
    evidence = Evidence(a=walls, b=walls, walls=99, crosswise_m=500.0, score_m=1000.0, margin=1.0)
    least = min(asked.slack for asked in reasons.tests(evidence, AlignmentConfig()))
    assert 1.0 / (1.0 + math.exp(-least)) == pytest.approx(0.8909, abs=5e-5)


def failed(evidence: Evidence) -> list[str]:
    return [asked.complaint for asked in reasons.tests(evidence, AlignmentConfig()) if asked.slack < 0]


def test_a_small_fit_must_be_tighter_than_half_way_to_chance() -> None:
    walls = WallEvidence(matched_m=10.0)
    loose = Evidence(a=walls, b=walls, walls=9, crosswise_m=3.0, score_m=9.0, residual=0.32)
    assert len(failed(loose)) == 1 and "as far apart as chance" in failed(loose)[0]
    assert not failed(replace(loose, residual=0.28))
    assert not failed(replace(loose, score_m=13.0))


def test_of_bent_maps_more_is_asked_the_more_wall_there_is() -> None:
    config = AlignmentConfig()
    assert reasons.bent_bounds(0.2, 50.0, config).score_m == config.min_bent_score_m
    assert reasons.bent_bounds(0.2, 500.0, config).score_m == pytest.approx(50.0)


def test_ragged_maps_may_contradict_more_than_sharp_ones() -> None:
    config = AlignmentConfig()
    sharp, ragged = (reasons.bent_bounds(residual, 50.0, config) for residual in (0.05, 0.25))
    assert (sharp.contradicted, sharp.deep) == (config.max_contradiction, config.max_deep_contradiction)
    assert (ragged.contradicted, ragged.deep) == pytest.approx((config.max_bent_contradiction,) * 2)


def test_only_a_fit_that_lacks_nothing_but_the_lead_is_ambiguous() -> None:
    walls = WallEvidence(matched_m=50.0)
    evidence = Evidence(a=walls, b=walls, walls=9, crosswise_m=9.0, score_m=50.0, margin=0.2)
    judged = reasons.tests(evidence, AlignmentConfig())
    assert [asked.is_lead for asked in judged if asked.slack < 0] == [True]


def fit(matched_m: float = 30.0, against: float = 0.0, deep: float = 0.0, **others: Any) -> Evidence:
    """Return a fit that shows all but what is given; contradictions are metres for each metre that agrees."""
    walls = WallEvidence(matched_m=matched_m, contradicted_m=against * matched_m, deep_m=deep * matched_m)
    sound = {"walls": 9, "crosswise_m": 6.0, "residual": 0.15, "score_m": 25.0, "margin": 0.9}
    return Evidence(a=walls, b=walls, **{**sound, **others})


@pytest.mark.parametrize(
    ("lacks", "said"),
    [
        ({"score_m": 4.9}, "too little wall in common"),
        ({"score_m": 4.9}, "once what contradicts is taken off: 30.0 m of wall agree"),
        ({"score_m": 4.9, "matched_m": 4.9}, "too little wall in common: 4.9 m of wall agree"),
        ({"walls": 2}, "only 2 separate walls agree"),
        ({"walls": 1}, "only 1 separate wall agrees, "),
        ({"against": 0.27}, "lie where the other map is free"),
        ({"deep": 0.12}, "lie clearly where the other map is free"),
        ({"matched_m": 15.0, "crosswise_m": 0.39}, "can slide along each other"),
        ({"crosswise_m": 0.5}, "can slide along each other"),
        ({"margin": 0.57}, "ambiguous"),
    ],
)
def test_whatever_a_fit_lacks_refuses_it_alone(lacks: dict[str, Any], said: str) -> None:
    assert failed(fit()) == []
    (why,) = failed(fit(**lacks))
    assert said in why


@pytest.mark.parametrize(
    ("enough", "too_little"),
    [
        ({"against": 0.2}, {"matched_m": 10.0}),  # small fits are chance: a contradiction weighs more
        ({"against": 0.2, "margin": 0.7}, {"margin": 0.65}),  # contradicted fits need more of a lead
        ({"score_m": 9.0, "margin": 0.7}, {"score_m": 5.5}),  # and so do small ones
        ({"against": 0.28, "matched_m": 75.0, "walls": 10}, {"matched_m": 40.0}),  # much wall that agrees forgives more
        ({"deep": 0.13, "matched_m": 75.0, "walls": 10}, {"walls": 5}),  # on many walls
    ],
)
def test_how_much_is_asked_depends_on_how_much_else_speaks_for_a_fit(
    enough: dict[str, Any], too_little: dict[str, Any]
) -> None:
    assert failed(fit(**enough)) == []
    assert len(failed(fit(**{**enough, **too_little}))) == 1
