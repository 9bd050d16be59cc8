"""Gaussian random walks (Carpin, Birk and Jucikas 2005, algorithm 1)."""

from __future__ import annotations

import math

import numpy as np

from mrslam.alignment.proposals.walks.log import F64, Log, Objective
from mrslam.spatial import se2

MEMORY = 10
"""Accepted samples the adaptive walk learns from (M in the source, which does not say how many)."""
PATIENCE = 15
"""Refused samples in a row after which the adaptive walk narrows; measured: 4 makes two cases of four better and two
worse (docs/alignment.md)."""
SELECTED = 0.05
"""Rise, as a share of the best value, that the random selector accepts with probability 1 / e."""
LEAST_SIGMA = np.array([0.02, 0.02, math.radians(0.1)])
"""Narrowest steps of the adaptive walk, m, m, rad: below a cell of the maps, and a tenth of what refinement mends."""


def selected(found: float, value: float, best: float, rng: np.random.Generator) -> bool:
    """Return whether a sample is accepted: a better one always, a worse one by the random selector (RS)."""
    return found < value or rng.random() < math.exp(-(found - value) / max(SELECTED * best, 1e-9))


class _Steps:
    """The Gaussian that the next step is drawn from, learnt from the last accepted samples."""

    def __init__(self, range_: F64) -> None:
        self._wide, self._least = (range_ / 6.0) ** 2, LEAST_SIGMA**2
        self.mean, self.spread = np.zeros(3), np.diag(self._wide)
        self._steps: list[F64] = []
        self._changes: list[float] = []
        self._refused = 0

    def accepted(self, step: F64, change: float) -> None:
        """Learn from a step ``(3,)`` that changed the value: follow steps that improve, else widen."""
        self._steps, self._changes = [*self._steps, step][-MEMORY:], [*self._changes, change][-MEMORY:]
        self._refused = 0
        if len(self._steps) < MEMORY:
            return
        if sum(self._changes) < 0:
            recent = np.array(self._steps)
            self.mean, self.spread = 0.5 * recent.mean(axis=0), np.cov(recent.T) + np.diag(self._least)
        else:
            widened = np.minimum(1.5 * np.diag(self.spread), self._wide)
            self.mean, self.spread = np.zeros(3), widened * np.eye(3)

    def refused(self) -> bool:
        """Narrow after many refusals; return whether nothing is left to narrow."""
        self._refused += 1
        if self._refused % PATIENCE:
            return False
        self.mean, self.spread = np.zeros(3), 0.5 * np.diag(np.diag(self.spread)) + np.diag(0.5 * self._least)
        return bool((np.diag(self.spread) < 4.0 * self._least).all())

    def restart(self) -> None:
        """Forget what was learnt."""
        self.spread, self._steps, self._changes = np.diag(self._wide), [], []


def adaptive_walk(
    objective: Objective, start: F64, low: F64, high: F64, evaluations: int, rng: np.random.Generator
) -> F64:
    """Search by a Gaussian random walk whose mean and covariance follow the last accepted samples.

    While accepted samples improve, the mean is half their mean step and the covariance theirs; while they do not, the
    covariance grows. After many refusals the walk narrows, and restarts from a random place once it cannot narrow.
    """
    log, steps = Log(objective, low, high, evaluations), _Steps(high - low)
    now, value = log.clip(start), log(start)
    best = value
    while log.left > 0:
        sample = log.clip(now + rng.multivariate_normal(steps.mean, steps.spread, method="cholesky"))
        found = log(sample)
        if selected(found, value, best, rng):
            step = sample - now
            step[2] = float(se2.wrap(step[2]))
            steps.accepted(step, found - value)
            now, value, best = sample, found, min(best, found)
        elif steps.refused():
            steps.restart()
            now = rng.uniform(low, high)
            value = log(now) if log.left > 0 else math.inf
    return log.visited()


def plain_walk(
    objective: Objective, start: F64, low: F64, high: F64, evaluations: int, rng: np.random.Generator
) -> F64:
    """Search by a Gaussian random walk of fixed covariance: a tenth of the range; the same random selector."""
    log = Log(objective, low, high, evaluations)
    now, value = log.clip(start), log(start)
    best = value
    while log.left > 0:
        sample = log.clip(now + 0.1 * (high - low) * rng.standard_normal(3))
        found = log(sample)
        if selected(found, value, best, rng):
            now, value = sample, found
            best = min(best, value)
    return log.visited()
