"""Hill climbing: as printed (Carpin, Birk and Jucikas 2005, algorithm 2), and with restarts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrslam.alignment.proposals.walks.log import F64, Log, Objective

SAMPLES = 10
"""numBestSamples of the source, which does not say how many; two generations of them take 120 evaluations."""
CHANGE = np.array([0.4, 0.4, np.radians(2.0)])
"""Changes of position and rotation of algorithm 2, m, m, rad: a cell of the dissimilarity; the source does not say."""
LEAST_STRIDE_M = 0.02
"""Stride below which the climb with restarts starts at another place: less than a cell of the maps."""


def changes(s: F64, stride: F64) -> Iterator[F64]:
    """Yield the six samples one stride ``(3,)`` away from ``s`` along each axis."""
    for axis in np.eye(3):
        for sign in (1.0, -1.0):
            yield s + sign * stride * axis


def first_samples(log: Log, start: F64, rng: np.random.Generator) -> list[tuple[float, F64]]:
    """Return value and place of the start and of random places, best first: the input of algorithms 2 and 3."""
    places = [start] + [rng.uniform(log.low, log.high) for _ in range(SAMPLES - 1)]
    return sorted(((log(s), log.clip(s)) for s in places[: log.left]), key=lambda sample: sample[0])


def expanded(log: Log, samples: list[tuple[float, F64]], stride: F64) -> list[tuple[float, F64]]:
    """Return the changes that improve on the sample they were made from, the best ``SAMPLES`` of them, best first."""
    new = []
    for value, s in samples:
        for candidate in changes(s, stride):
            if log.left <= 0:
                break
            found = log(candidate)
            if found < value:
                new.append((found, log.clip(candidate)))
    return sorted(new, key=lambda sample: sample[0])[:SAMPLES]


def multi_point_hill_climb(
    objective: Objective, start: F64, low: F64, high: F64, evaluations: int, rng: np.random.Generator
) -> F64:
    """Search by multi-point hill climbing as printed (algorithm 2).

    A set of samples; those of their changes that improve take their place, the best of them. Ends where none improves.
    """
    log = Log(objective, low, high, evaluations)
    samples = first_samples(log, start, rng)
    while samples and log.left > 0:
        samples = expanded(log, samples, CHANGE)
    return log.visited()


def hill_climb(
    objective: Objective, start: F64, low: F64, high: F64, evaluations: int, rng: np.random.Generator
) -> F64:
    """Search by hill climbing with restarts: the best of six steps, halved where none improves, then a random place."""
    log = Log(objective, low, high, evaluations)
    now = log.clip(start)
    while log.left > 0:
        value, stride = log(now), (high - low) / 10.0
        while log.left > 0 and stride[0] > LEAST_STRIDE_M:
            options = [log.clip(option) for option in changes(now, stride)]
            found = [log(option) for option in options[: log.left]]
            k = int(np.argmin(found))
            if found[k] < value:
                now, value = options[k], found[k]
            else:
                stride = 0.5 * stride
        now = rng.uniform(low, high)
    return log.visited()
