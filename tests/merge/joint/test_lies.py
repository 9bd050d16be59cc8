"""What a liar's keyframes say of its way moves honest robots' keyframes by less than these are uncertain by themselves.

The liar's scans are true, so that they match; the way it claims is stretched, turned, torn or warped.
"""

from collections.abc import Callable

import numpy as np
import pytest

from mrslam.merge import Trail, join
from mrslam.spatial import se2
from tests.merge.joint.blocks import Drive, drive

A, B = drive(0.0, 70.0, 0.001, seed=1), drive(30.0, 80.0, -0.001, seed=2)
LIAR = drive(15.0, 90.0, seed=5)
MOVED_M = 0.05
"""Honest maps that meet a third one move by no more than this: it is evidence, too."""


def stretched(way: np.ndarray, factor: float) -> np.ndarray:
    out = way.copy()
    out[:, :2] *= factor
    return out


def turned(way: np.ndarray, per_m: float) -> np.ndarray:
    steps, out = se2.between(way[:-1], way[1:]), np.zeros_like(way)
    steps[:, 2] += per_m * np.hypot(steps[:, 0], steps[:, 1])
    for k, step in enumerate(steps):
        out[k + 1] = se2.compose(out[k], step)
    return out


def torn(way: np.ndarray, by_m: float) -> np.ndarray:
    out = way.copy()
    out[len(out) // 2 :, 0] += by_m
    return out


def slanted(way: np.ndarray, by_m: float) -> np.ndarray:
    out = way.copy()
    out[:, 0] += np.linspace(0.0, by_m, len(out))
    return out


def warped(way: np.ndarray, seed: int) -> np.ndarray:
    rng, share = np.random.default_rng(seed), np.linspace(0.0, 1.0, len(way))
    out = way.copy()
    for k in (1, 2, 3):
        out[:, :2] += rng.normal(size=2) * np.sin(2.0 * np.pi * k * share)[:, None] / k
    return out


def joined(*, liar: Trail | None) -> dict[str, np.ndarray]:
    """Return the honest robots' keyframes as robot a sees them, with a third robot or without."""
    trails = {"a": A.trail, "b": B.trail}
    places = {"a": se2.IDENTITY, "b": se2.between(A.truth[0], B.truth[0])}
    if liar is not None:
        trails["c"], places["c"] = liar, se2.between(A.truth[0], LIAR.truth[0])
    return join(trails, places).seen_from("a", A.trail.T_map_key)


def uncertainty_m(one: Drive) -> float:
    """Standard deviation of one end of a robot's way as seen from its other end, by its own trail alone, metres."""
    steps = len(one.trail) - 1
    variances = 1.0 / one.trail.edges.information[:steps, [0, 2], [0, 2]]
    return float(np.sqrt(variances[:, 0].sum() + variances[:, 1].sum() * one.trail.way_m[-1] ** 2 / 3.0))


ALONE = joined(liar=None)


def moved_m(liar: Trail) -> dict[str, float]:
    seen = joined(liar=liar)
    return {name: float(np.hypot(*(seen[name] - ALONE[name])[:, :2].T).max()) for name in "ab"}


def test_an_honest_third_robot_moves_nobody() -> None:
    assert max(moved_m(LIAR.trail).values()) < MOVED_M


@pytest.mark.parametrize(
    ("lie", "amount"),
    [(stretched, 1.03), (stretched, 1.1), (stretched, 1.15), (stretched, 0.9), (turned, 0.003), (turned, 0.01),
     (torn, 1.0), (torn, 3.0), (slanted, 3.0), (warped, 1), (warped, 2), (warped, 3)],
)  # fmt: skip
def test_a_lie_moves_nobody_by_more_than_he_is_uncertain(
    lie: Callable[[np.ndarray, float], np.ndarray], amount: float
) -> None:
    moved = moved_m(Trail(lie(LIAR.trail.T_map_key, amount), LIAR.trail.scans))
    assert moved["a"] < uncertainty_m(A) < 1.0 and moved["b"] < uncertainty_m(B) < 1.2
