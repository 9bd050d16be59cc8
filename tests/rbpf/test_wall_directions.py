"""Straight walls as a compass: what one scan tells, and what many of them make of the heading."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.rbpf import Mapper
from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.filter.straight_walls import folded, main_direction, stretches
from mrslam.rbpf.filter.wall_directions import MOST, WallDirections
from mrslam.rbpf.match.sight import Sight
from tests.rbpf import rooms
from tests.rbpf.rooms import SMALL, make_scan

ORIGIN = np.zeros(2)


def line(
    from_xy: tuple[float, float], direction_deg: float, length_m: float, step_m: float = 0.05
) -> NDArray[np.float64]:
    """Points ``(N, 5)`` of a straight wall."""
    way = np.arange(0.0, length_m, step_m)
    points = np.zeros((way.size, 5))
    points[:, 0] = from_xy[0] + way * math.cos(math.radians(direction_deg))
    points[:, 1] = from_xy[1] + way * math.sin(math.radians(direction_deg))
    return points


def walls_of(points: NDArray[np.float64]) -> NDArray[np.float64]:
    out = np.zeros((64, 3))
    return out[: stretches(points, ORIGIN, out)]


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


def drift_through(directions_deg: list[float], way_m: float, rng: np.random.Generator) -> tuple[float, float]:
    """Largest heading error with walls as a compass and without, degrees, walls of each direction seen for 10 m."""
    walls, error, alone, worst, worst_alone = WallDirections(), 0.0, 0.0, 0.0, 0.0
    for k in range(int(way_m / 0.6)):
        heading = 2.0 * math.sin(0.05 * k)  # the truth
        drift = 0.6 * 0.0005 + rng.normal(0.0, math.radians(0.1))
        error, alone = error + drift, alone + drift
        seen_deg = directions_deg[int(0.6 * k / 10.0) % len(directions_deg)] - math.degrees(heading)
        points = np.concatenate([line((1, -2), seen_deg, 6.0), line((2, 3), seen_deg + 90.0, 3.0)])
        points[:, :2] += rng.normal(0.0, 0.02, (len(points), 2))
        error += walls.turn(points, ORIGIN, heading + error, 0.6)
        worst, worst_alone = max(worst, abs(error)), max(worst_alone, abs(alone))
    return math.degrees(worst), math.degrees(worst_alone)


@pytest.mark.parametrize(
    ("directions_deg", "most_deg"),
    [([0.0], 0.9), ([17.0], 0.9), ([0.0, 30.0], 0.9), ([0.0, 3.0], 0.9), ([10.0, 30.0, 55.0, 80.0], 2.0)],
)
def test_the_heading_does_not_drift_away_from_the_walls(directions_deg: list[float], most_deg: float) -> None:
    """A direction that is new has what drifted until then for its error."""
    worst, alone = drift_through(directions_deg, 120.0, np.random.default_rng(5))
    assert alone > 2.0 * worst
    assert worst < most_deg


def test_a_lasting_turn_is_another_direction_not_an_error() -> None:
    walls = WallDirections()
    for k in range(30):
        assert abs(walls.turn(line((1, -2), 0.0, 6.0), ORIGIN, 0.0, 0.6 * (k > 0))) < 1e-3
    for _ in range(30):
        assert abs(walls.turn(line((1, -2), 4.0, 6.0), ORIGIN, 0.0, 0.6)) < 1e-3
    assert np.allclose(np.degrees(walls.angles), [0.0, 4.0], atol=0.05)
    assert walls.seen.tolist() == [30, 30]


def test_no_more_directions_are_kept_than_stated_and_the_rarest_goes() -> None:
    walls = WallDirections()
    for k in range(MOST + 3):
        for _ in range(3 if k < MOST - 1 else 1):
            walls.turn(line((1, -2), 8.0 * k, 6.0), ORIGIN, 0.0, 0.0)
    assert walls.angles.size == MOST
    assert sorted(walls.seen.tolist()) == [1, *[3] * (MOST - 1)]
    assert np.all(np.linalg.eigvalsh(walls.cov) > -1e-12)


def test_a_bent_trajectory_bends_the_directions_and_joins_those_that_were_one() -> None:
    walls = WallDirections()
    headings = np.concatenate([np.zeros(10), np.full(10, math.radians(4.0))])  # the second half had drifted
    for heading in headings:
        walls.turn(line((1, -2), 0.0, 6.0), ORIGIN, float(heading), 0.0)
    assert walls.angles.size == 2
    walls.adopt(np.full(20, math.radians(0.1)))
    assert np.degrees(walls.angles) == pytest.approx([0.1], abs=1e-6)
    assert walls.seen.tolist() == [20]
    assert abs(walls.turn(line((1, -2), 0.0, 6.0), ORIGIN, 0.0, 0.6)) > 0.0


def test_a_resumed_compass_goes_on_as_if_nothing_had_been() -> None:
    rng = np.random.default_rng(2)
    one, other = WallDirections(), WallDirections()
    for k in range(40):
        points = line((1, -2), 20.0 * (k % 3) + rng.normal(0.0, 0.2), 6.0)
        if k == 20:
            other.restore(one.state())
        turned = one.turn(points, ORIGIN, 0.0, 0.6)
        assert k < 20 or other.turn(points, ORIGIN, 0.0, 0.6) == turned
    one.adopt(np.zeros(40))
    other.adopt(np.zeros(40))
    assert all(np.array_equal(a, b) for a, b in zip(one.state(), other.state(), strict=True))


def test_where_no_wall_is_straight_the_mapper_is_the_same_without(monkeypatch: pytest.MonkeyPatch) -> None:
    angle = np.linspace(0.0, 2.0 * math.pi, 241)
    ring = np.stack([3.5 + 5.0 * np.cos(angle), 3.0 + 5.0 * np.sin(angle)], axis=1)
    monkeypatch.setattr(rooms, "WALLS", np.concatenate([ring[:-1], ring[1:]], axis=1))
    ends = []
    for use_walls in (True, False):
        mapper = Mapper(MapperConfig(particles=SMALL.particles, threads=1, use_walls=use_walls), seed=1)
        rooms.feed(mapper, rooms.drive(60))
        ends.append(mapper.trajectory().T_map_base)
    assert np.array_equal(*ends)
