"""Straight stretches of wall, and the direction of most of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.filter.straight_walls import folded, main_direction
from mrslam.rbpf.front_end.sight import Sight
from tests.rbpf.filter.walls import line, walls_of
from tests.rbpf.rooms import make_scan


def twin(points: NDArray[np.float64]) -> list[tuple[float, float]]:
    """Direction and length of straight stretches, slowly: cut at gaps, split where farthest off the chord."""
    xy = points[:, :2]
    reach = np.hypot(*xy.T)
    cuts = np.flatnonzero(np.hypot(*np.diff(xy, axis=0).T) > 0.25 + 0.05 * reach[1:]) + 1
    parts = [np.arange(a, b) for a, b in zip([0, *cuts], [*cuts, len(xy)], strict=True)]
    found = []
    while parts:
        part = parts.pop()
        if part.size < 8:
            continue
        chord = xy[part[-1]] - xy[part[0]]
        length = float(np.hypot(*chord))
        if length < 0.8:
            continue
        off = np.abs((xy[part] - xy[part[0]]) @ np.array([-chord[1], chord[0]]) / length)
        off[[0, -1]] = 0.0
        worst = int(np.argmax(off))
        if off[worst] > 0.05 + 0.003 * reach[part[worst]]:
            parts += [part[:worst], part[worst:]]
            continue
        _, vectors = np.linalg.eigh(np.cov(xy[part].T))
        found.append((math.atan2(vectors[1, 1], vectors[0, 1]), length))
    return found


def test_stretches_are_those_of_a_slow_twin() -> None:
    rng = np.random.default_rng(3)
    for k in range(20):
        pose = np.array([0.3 * k, rng.uniform(-1.0, 1.0), rng.uniform(-3.0, 3.0)])
        points = Sight(MapperConfig()).points(make_scan(pose, 0, beams=360, rng=rng))
        fast, slow = walls_of(points), twin(points)
        assert len(fast) == len(slow)
        by_length = zip(sorted(fast, key=lambda row: row[2]), sorted(slow, key=lambda row: row[1]), strict=True)
        for (direction, _, length), (expected, expected_m) in by_length:
            turned = abs((direction - expected + math.pi / 2) % math.pi - math.pi / 2)
            assert turned < 1e-6
            assert length == pytest.approx(expected_m)


def test_a_scan_tells_the_direction_of_most_of_its_walls() -> None:
    rng = np.random.default_rng(1)
    points = np.concatenate([line((1, -3), 93.0, 6.0), line((-2, 4), 3.0, 5.0), line((-4, 0), 40.0, 2.0)])
    points[:, :2] += rng.normal(0.0, 0.01, (len(points), 2))
    reading = main_direction(walls_of(points))
    assert reading is not None
    assert abs(math.degrees(folded(np.array(reading[0])) - math.radians(3.0))) < 0.15
    assert reading[1] < math.radians(0.4) ** 2


def test_short_round_and_undecided_walls_tell_nothing() -> None:
    angle = np.linspace(0.0, 2.0 * math.pi, 300)
    circle = np.zeros((300, 5))
    circle[:, 0], circle[:, 1] = 4.0 * np.cos(angle), 4.0 * np.sin(angle)
    undecided = np.concatenate([line((3, 10.0 * k), 20.0 * k, 4.0) for k in range(4)])
    for points in (np.zeros((0, 5)), line((2, -1), 90.0, 2.0), circle, undecided):
        assert main_direction(walls_of(points)) is None


def test_a_bumpy_wall_tells_its_direction_less_exactly_than_a_smooth_one() -> None:
    bumpy, smooth = line((1, -3), 90.0, 6.0), line((1, -3), 90.0, 6.0)
    bumpy[:, 0] += 0.02 * (-1.0) ** np.arange(len(bumpy))
    ((_, of_bumpy, _),) = walls_of(bumpy)
    ((_, of_smooth, _),) = walls_of(smooth)
    assert of_bumpy == pytest.approx(4.0 * of_smooth, rel=0.05)  # 0.02 m for the 0.01 m that any wall is given
