"""A robot whose wheels stand: it stands, whoever walks past, or they died while it drove."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.rbpf import Mapper, MapperConfig
from mrslam.spatial import Scan

HALF_M, REACH_M = 1.2, 8.0
"""Half the corridor's width, and the laser's range, metres."""
ANGLES = np.linspace(-np.pi, np.pi, 360, endpoint=False)


def scan(
    k: int, rng: np.random.Generator, people: Sequence[tuple[float, float, float]] = (), niches: Sequence[float] = ()
) -> Scan:
    """Return what a laser in the middle of a corridor sees of its walls, of people, and of niches half a metre deep.

    People ``(x, y, radius)`` and niches, by the ``x`` where they begin, are metres from it; niches are a metre long, in
    the left wall.
    """
    along, aside = np.cos(ANGLES), np.sin(ANGLES)
    ranges_m = HALF_M / np.maximum(np.abs(aside), 1e-9)
    for x in niches:
        deep = (HALF_M + 0.5) / np.maximum(aside, 1e-9)
        side = np.where(along > 0, x + 1.0, x) / np.where(np.abs(along) > 1e-9, along, 1e-9)
        enters = (aside > 0) & (ranges_m * along > x) & (ranges_m * along < x + 1.0)
        beyond = np.where(side > ranges_m, side, np.inf)
        ranges_m = np.where(enters, np.minimum(deep, beyond), ranges_m)
    for x, y, radius in people:
        nearest = x * along + y * aside
        off = np.abs(x * aside - y * along)
        hit = np.where((off < radius) & (nearest > 0), nearest - np.sqrt(np.maximum(radius**2 - off**2, 0.0)), np.inf)
        ranges_m = np.minimum(ranges_m, hit)
    ranges_m = np.where(ranges_m > REACH_M, np.inf, ranges_m + rng.normal(0.0, 0.01, ranges_m.size))
    return Scan(
        stamp_ns=k * 10**8, ranges_m=ranges_m.astype(np.float32), angle_min_rad=-np.pi,
        angle_increment_rad=2 * np.pi / ANGLES.size, range_max_m=REACH_M,
    )  # fmt: skip


def driven(mapper: Mapper, odometry_m: NDArray[np.float64], scans: list[Scan]) -> float:
    """Return how far along the corridor a robot takes itself to be after these scans."""
    for x, one in zip(odometry_m, scans, strict=True):
        mapper.update(one, np.array([x, 0.0, 0.0]))
    return float(mapper.T_map_base[0])


@pytest.mark.parametrize(("side_m", "radius_m"), [(0.4, 0.3), (0.6, 0.7)], ids=["a person", "a bed"])
def test_a_robot_that_stands_in_a_corridor_is_not_moved_by_what_passes(side_m: float, radius_m: float) -> None:
    rng = np.random.default_rng(0)
    scans = [scan(k, rng, [(1.2 - 0.12 * k, side_m, radius_m)] if k < 20 else []) for k in range(60)]
    mapper = Mapper(MapperConfig(particles=1, threads=1))
    assert abs(driven(mapper, np.zeros(60), scans)) < 0.05 and mapper.stats.processed == 1


def test_a_robot_whose_wheels_die_in_a_corridor_drives_on() -> None:
    rng, niches = np.random.default_rng(1), [3.0, 7.2, 10.5, 15.0, 18.1]
    scans = [scan(k, rng, niches=[x - 0.1 * k for x in niches]) for k in range(100)]
    wheels_m = 0.1 * np.minimum(np.arange(100), 40)
    assert abs(driven(Mapper(MapperConfig(particles=1, threads=1)), wheels_m, scans) - 9.9) < 0.5
