"""Histories of a robot that lost its place: their weights are those of a brute-force filter."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.rbpf.loops.guesses import LIGHT, NEW, Fit, Guess, distinct, score_of_known, shares, surviving
from mrslam.spatial.matching.gauss_newton import Match

BEAMS, CELLS, EVIDENCE = 12, 20, 6.0


def match(score: float) -> Match:
    """A match that fits so well."""
    return Match(np.zeros(3), score, 1.0, 0.0, np.eye(3), 0.0, np.array([1.0, 0.0]))


def guess(log_weight: float = 0.0, disagreed: int = 0) -> Guess:
    return Guess([Fit(0, 9, match(0.0))], disagreed, log_weight)


def ring(rng: np.random.Generator, steps: int, place: int) -> NDArray[np.float64]:
    """Mean log-likelihoods ``(steps, CELLS)`` of scans in a world of cells in a ring, for a robot that began anywhere.

    It goes on by a cell a step, and each of its beams tells the cell's pattern right three times in four.
    """
    world = rng.random((CELLS, BEAMS)) < 0.5
    seen = np.array([world[(place + t) % CELLS] ^ (rng.random(BEAMS) < 0.25) for t in range(steps)])
    at = (np.arange(CELLS) + np.arange(steps)[:, None]) % CELLS
    agree = (world[at] == seen[:, None]).mean(axis=-1)
    return np.asarray(agree * np.log(0.75 / 0.75) + (1.0 - agree) * np.log(0.25 / 0.75))


@pytest.mark.parametrize("seed", range(3))
def test_weights_are_those_of_a_brute_force_filter(seed: int) -> None:
    scores = ring(np.random.default_rng(seed), 6, place=7)
    posterior = np.full(CELLS + 1, 1.0 / (CELLS + 1))  # the last: a place that is in no map
    histories = [guess() for _ in range(CELLS)]
    for row in scores:
        posterior *= np.exp(EVIDENCE * np.append(row, NEW))  # Bayes' rule, one scan at a time
        posterior /= posterior.sum()
        for one, score in zip(histories, row, strict=True):
            one.explain(match(float(score)), EVIDENCE)
        assert np.allclose(shares(histories), posterior[:-1], atol=1e-9)
    assert posterior.argmax() == 7


def test_what_is_dropped_weighs_next_to_nothing() -> None:
    scores = ring(np.random.default_rng(1), 6, place=3).sum(axis=0)
    histories = [guess(float(EVIDENCE * (score - 6 * NEW))) for score in scores]
    kept = surviving(histories, 30)
    assert 0 < len(kept) < len(histories)
    assert max(shares(kept)) - max(shares(histories)) < len(histories) * np.exp(-LIGHT)
    assert surviving(histories, 2) == sorted(histories, key=lambda one: -one.log_weight)[:2]


def test_histories_that_are_contradicted_are_dropped() -> None:
    good, refuted, light = guess(5.0), guess(50.0, disagreed=3), guess(5.0 - LIGHT - 1.0)
    assert surviving([light, refuted, good], 30) == [good]
    assert surviving([guess(-LIGHT - 1.0)], 30) == []  # a new place explains far more


def test_a_place_that_is_new_takes_its_share() -> None:
    one = guess()
    assert shares([one]) == pytest.approx([0.5]) and shares([]).size == 0
    one.explain(match(NEW + 0.5), 10.0)
    assert shares([one]) == pytest.approx([1.0 / (1.0 + np.exp(-5.0))])
    one.agrees = False
    again = Guess.of(one.state())
    assert again.log_weight == one.log_weight and again.fits[0].new == 9 and not again.agrees


def test_what_the_map_does_not_know_says_nothing_of_a_place() -> None:
    clear, half_known = match(-0.1), match(0.5 * (-0.1 + NEW))
    clear, half_known = (one._replace(inliers=share, conflicts=0.0) for one, share in ((clear, 1.0), (half_known, 0.5)))
    assert score_of_known(clear) == pytest.approx(-0.1) and score_of_known(half_known) == pytest.approx(-0.05)
    contradicted = clear._replace(score=-0.4, inliers=0.9, conflicts=0.1)
    assert score_of_known(contradicted) == pytest.approx(-0.4)


def test_histories_that_lead_to_one_place_are_one_decision() -> None:
    older, newer, beside, turned = (Guess([Fit(0, 9, match(0.0))] * n, 0, 5.0) for n in (3, 1, 1, 1))
    newer.log_weight, newer.T_map_newest = 7.0, np.array([0.3, 0.0, 0.05])
    beside.T_map_newest, turned.T_map_newest = np.array([0.6, 0.0, 0.0]), np.array([0.0, 0.0, 0.1 + 2.0 * np.pi])
    kept = distinct([newer, beside, older, turned], 0.5, 0.08)
    assert kept == [older, beside, turned]
