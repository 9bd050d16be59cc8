"""Simulated annealing: as printed (Carpin, Birk and Jucikas 2005, algorithm 3), and by Metropolis' rule."""

from __future__ import annotations

import math

import numpy as np

from mrslam.alignment.proposals.walks.climbs import expanded, first_samples
from mrslam.alignment.proposals.walks.log import F64, Log, Objective

FITNESS_RATIO = 1.0
"""fitnessRatio of the source, which asks for 1 or more: ends where a generation does not improve on the one before."""
FIRST_STRIDE = 0.1
"""First change of position and rotation as a share of the range; the source does not say."""
LAST_TEMPERATURE = 0.001
"""Last temperature as a share of the first: a rise that passes half of the time first hardly ever passes last."""
FIRST_TEMPERATURE = 0.2
"""First temperature as a share of the start's value."""
WIDEST, NARROWEST = 0.3, 0.002
"""Standard deviation of the first and of the smallest steps as a share of the range."""


def simulated_annealing(
    objective: Objective, start: F64, low: F64, high: F64, evaluations: int, rng: np.random.Generator
) -> F64:
    """Search by simulated annealing as printed (algorithm 3).

    Algorithm 2 with changes divided by the number of the step. As printed it accepts no worse sample, and ends where
    a generation improves by less than ``FITNESS_RATIO``.
    """
    log = Log(objective, low, high, evaluations)
    samples = first_samples(log, start, rng)
    last, step = math.inf, 1
    while samples and log.left > 0 and last > FITNESS_RATIO * samples[0][0]:
        last = samples[0][0]
        samples = expanded(log, samples, FIRST_STRIDE * (high - low) / step)
        step += 1
    return log.visited()


def annealing(objective: Objective, start: F64, low: F64, high: F64, evaluations: int, rng: np.random.Generator) -> F64:
    """Search by simulated annealing: temperature and stride fall geometrically; a rise passes by Metropolis' rule."""
    log = Log(objective, low, high, evaluations)
    now, value = log.clip(start), log(start)
    first = value
    for k in range(evaluations - 1):
        cooled = LAST_TEMPERATURE ** (k / max(evaluations - 1, 1))
        sample = log.clip(now + (high - low) * max(WIDEST * cooled, NARROWEST) * rng.standard_normal(3))
        found = log(sample)
        temperature = max(FIRST_TEMPERATURE * first * cooled, 1e-9)
        if found < value or rng.random() < math.exp(-(found - value) / temperature):
            now, value = sample, found
    return log.visited()
