"""Searches for the transform of least dissimilarity (Carpin, Birk and Jucikas 2005, algorithms 1-3).

All are functions of one signature: ``(objective, start, low, high, evaluations, rng) -> visited``, ``(N, 4)`` rows of
x, y, theta, value in the order they were tried, N <= evaluations.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.proposals.dissimilarity import Dissimilarity
from mrslam.alignment.result import Candidate, Prior
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

F64 = NDArray[np.float64]
Objective = Callable[[Transform], float]
Search = Callable[[Objective, F64, F64, F64, int, np.random.Generator], F64]

MEMORY = 10
"""Accepted samples the adaptive walk learns from (M in the source)."""
KEPT = 12
"""Best visited transforms handed on as candidates."""


class _Log:
    """Counts and remembers what was tried."""

    def __init__(self, objective: Objective, low: F64, high: F64, evaluations: int) -> None:
        self.objective, self.low, self.high, self.left = objective, low, high, evaluations
        self.rows: list[tuple[float, float, float, float]] = []

    def __call__(self, s: F64) -> float:
        s = self.clip(s)
        value = self.objective(s)
        self.left -= 1
        self.rows.append((float(s[0]), float(s[1]), float(s[2]), value))
        return value

    def clip(self, s: F64) -> F64:
        """Return the sample within the bounds, its angle wrapped."""
        s = np.clip(s, self.low, self.high)
        s[2] = float(se2.wrap(s[2]))
        return s

    def visited(self) -> F64:
        return np.array(self.rows).reshape(-1, 4)


def adaptive_walk(
    objective: Objective, start: F64, low: F64, high: F64, evaluations: int, rng: np.random.Generator
) -> F64:
    """Gaussian random walk whose mean and covariance follow the last accepted samples (algorithm 1).

    While accepted samples improve, the mean is their mean step and the covariance theirs; while they do not, the
    covariance grows. A worse sample is accepted with probability exp(-rise / (5 % of the best)). After many refusals
    the walk narrows, and starts anew from a random place once it has narrowed to nothing.
    """
    log = _Log(objective, low, high, evaluations)
    wide = ((high - low) / 6.0) ** 2
    least = np.array([0.02, 0.02, math.radians(0.1)]) ** 2
    now, value = log.clip(start), log(start)
    best = value
    mean, spread = np.zeros(3), np.diag(wide)
    steps: list[F64] = []
    changes: list[float] = []
    refused = 0
    while log.left > 0:
        sample = log.clip(now + rng.multivariate_normal(mean, spread, method="cholesky"))
        found = log(sample)
        if found < value or rng.random() < math.exp(-(found - value) / max(0.05 * best, 1e-9)):
            step = sample - now
            step[2] = float(se2.wrap(step[2]))
            steps, changes = [*steps, step][-MEMORY:], [*changes, found - value][-MEMORY:]
            now, value, refused = sample, found, 0
            best = min(best, value)
            if len(steps) == MEMORY:
                recent = np.array(steps)
                if sum(changes) < 0:
                    mean = 0.5 * recent.mean(axis=0)
                    spread = np.cov(recent.T) + np.diag(least)
                else:
                    mean, spread = np.zeros(3), np.minimum(1.5 * np.diag(spread), wide) * np.eye(3)
            continue
        refused += 1
        if refused % 15 == 0:
            mean, spread = np.zeros(3), 0.5 * np.diag(np.diag(spread)) + np.diag(0.5 * least)
            if (np.diag(spread) < 4.0 * least).all():
                now = rng.uniform(low, high)
                spread, steps, changes = np.diag(wide), [], []
                value = log(now) if log.left > 0 else math.inf
    return log.visited()


def plain_walk(
    objective: Objective, start: F64, low: F64, high: F64, evaluations: int, rng: np.random.Generator
) -> F64:
    """Gaussian random walk of fixed covariance: a tenth of the range, like acceptance."""
    log = _Log(objective, low, high, evaluations)
    now, value = log.clip(start), log(start)
    best = value
    while log.left > 0:
        sample = log.clip(now + 0.1 * (high - low) * rng.standard_normal(3))
        found = log(sample)
        if found < value or rng.random() < math.exp(-(found - value) / max(0.05 * best, 1e-9)):
            now, value = sample, found
            best = min(best, value)
    return log.visited()


def hill_climb(
    objective: Objective, start: F64, low: F64, high: F64, evaluations: int, rng: np.random.Generator
) -> F64:
    """Multi-point hill climbing (algorithm 2): from random places, best of six steps, halved where none helps."""
    log = _Log(objective, low, high, evaluations)
    now = log.clip(start)
    while log.left > 0:
        value, stride = log(now), (high - low) / 10.0
        while log.left > 0 and stride[0] > 0.02:
            options = [log.clip(now + sign * stride * axis) for axis in np.eye(3) for sign in (1.0, -1.0)]
            found = [log(option) for option in options[: log.left]]
            k = int(np.argmin(found))
            if found[k] < value:
                now, value = options[k], found[k]
            else:
                stride = 0.5 * stride
        now = rng.uniform(low, high)
    return log.visited()


def annealing(objective: Objective, start: F64, low: F64, high: F64, evaluations: int, rng: np.random.Generator) -> F64:
    """Simulated annealing (algorithm 3): temperature and stride fall; a rise passes by Metropolis' rule."""
    log = _Log(objective, low, high, evaluations)
    now, value = log.clip(start), log(start)
    first = value
    for k in range(evaluations - 1):
        cooled = 0.001 ** (k / max(evaluations - 1, 1))
        sample = log.clip(now + (high - low) * max(0.3 * cooled, 0.002) * rng.standard_normal(3))
        found = log(sample)
        if found < value or rng.random() < math.exp(-(found - value) / max(0.2 * first * cooled, 1e-9)):
            now, value = sample, found
    return log.visited()


def brute_force(
    objective: Objective, start: F64, low: F64, high: F64, evaluations: int, rng: np.random.Generator
) -> F64:
    """Every point of a lattice of about ``evaluations`` points over the range, angles twice as dense as shifts."""
    log = _Log(objective, low, high, evaluations)
    side = max(2, int((evaluations / 2.0) ** (1.0 / 3.0)))
    turns = max(1, evaluations // side**2)
    for theta in low[2] + (high[2] - low[2]) * (np.arange(turns) + 0.5) / turns:
        for y in np.linspace(low[1], high[1], side):
            for x in np.linspace(low[0], high[0], side):
                log(np.array([x, y, theta]))
    return log.visited()


def bounds(a: PreparedMap, b: PreparedMap, prior: Prior | None) -> tuple[F64, F64, F64]:
    """Return (start, low, high) of b's middle (x, y) in frame a and its turn: anywhere within a, or near the prior."""
    if prior is not None:
        sigma = 3.0 * np.sqrt(np.diag(prior.covariance)) + (a.res, a.res, math.radians(0.5))
        middle = np.append(se2.apply(prior.T_a_b, b.centre), prior.T_a_b[2])
        lever = float(np.hypot(*b.centre)) * sigma[2]
        return middle, middle - sigma - (lever, lever, 0.0), middle + sigma + (lever, lever, 0.0)
    low = np.append(a.points.min(axis=0), -math.pi)
    high = np.append(a.points.max(axis=0), math.pi)
    return np.append(a.centre, 0.0), low, high


def about(middle: F64, b: PreparedMap) -> Transform:
    """Return the ``T_a_b`` that turns b by ``middle[2]`` and lays its centre on ``middle[:2]``."""
    turned = se2.apply(np.array([0.0, 0.0, middle[2]]), b.centre)
    return se2.transform(middle[0] - turned[0], middle[1] - turned[1], middle[2])


def searched(search: Search, evaluations: int | None = None) -> Callable[..., list[Candidate]]:
    """Return the aligner that minimises psi by ``search``; candidates are the lowest distinct ones visited."""

    def aligner(a: PreparedMap, b: PreparedMap, config: AlignmentConfig, prior: Prior | None) -> list[Candidate]:
        psi = Dissimilarity(a, b)
        start, low, high = bounds(a, b, prior)
        count = config.evaluations if evaluations is None else evaluations
        rng = np.random.default_rng(config.seed)
        visited = search(lambda s: psi(about(s, b)), start, low, high, count, rng)
        kept: list[F64] = []
        for row in visited[np.argsort(visited[:, 3], kind="stable")]:
            if all(np.hypot(*(row[:2] - k[:2])) > 0.5 or abs(float(se2.wrap(row[2] - k[2]))) > 0.1 for k in kept):
                kept.append(row)
            if len(kept) == KEPT:
                break
        return [Candidate(about(row[:3], b), -float(row[3]), {"dissimilarity": float(row[3])}) for row in kept]

    return aligner
