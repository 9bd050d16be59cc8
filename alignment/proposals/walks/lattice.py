"""Brute force: a lattice over the whole range."""

from __future__ import annotations

import numpy as np

from mrslam.alignment.proposals.walks.log import F64, Log, Objective


def brute_force(
    objective: Objective, start: F64, low: F64, high: F64, evaluations: int, rng: np.random.Generator
) -> F64:
    """Search every point of a lattice of about ``evaluations`` over the range, angles twice as dense as shifts."""
    log = Log(objective, low, high, evaluations)
    side = max(2, int((evaluations / 2.0) ** (1.0 / 3.0) + 1e-9))
    turns = max(1, evaluations // side**2)
    for theta in low[2] + (high[2] - low[2]) * (np.arange(turns) + 0.5) / turns:
        for y in np.linspace(low[1], high[1], side):
            for x in np.linspace(low[0], high[0], side):
                log(np.array([x, y, theta]))
    return log.visited()
