"""Straight walls as a compass."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.rbpf import Mapper
from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.filter.wall_directions import MOST, WallDirections
from tests.rbpf import rooms
from tests.rbpf.filter.walls import ORIGIN, line
from tests.rbpf.rooms import SMALL


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
    assert len(walls.readings().keys) == 3 * (MOST - 1) + 1  # what saw those that went says nothing any more


def seen(walls: WallDirections, angle_deg: float, times: int = 1, way_m: float = 0.0) -> float:
    """Let a wall of this direction be seen so many times; return the last correction of the heading, degrees."""
    for _ in range(times):
        turned = walls.turn(line((1, -2), angle_deg, 6.0), ORIGIN, 0.0, way_m)
    return math.degrees(turned)


def test_a_wall_between_two_directions_that_it_may_be_of_says_nothing() -> None:
    walls = WallDirections()
    for angle_deg in (0.0, 1.8):
        seen(walls, angle_deg, 30)
    assert walls.angles.size == 2
    assert seen(walls, 0.9, way_m=5.0) == 0.0 and walls.angles.size == 2
    assert len(walls.readings().keys) == 60
    assert seen(walls, 0.1, way_m=5.0) != 0.0  # this one is of the first


def test_walls_less_parallel_than_usual_count_less() -> None:
    calm, noisy = WallDirections(), WallDirections()
    for k in range(60):
        seen(calm, 0.0)
        seen(noisy, 0.9 if k % 2 else -0.9)
    turned = [abs(seen(walls, 0.5, way_m=2.0)) for walls in (calm, noisy)]
    assert 0.0 < turned[1] < 0.7 * turned[0]


def test_a_direction_is_learnt_from_all_that_saw_it_and_walls_off_by_a_third_of_a_degree_are_of_one() -> None:
    walls = WallDirections()
    seen(walls, 0.0)
    seen(walls, 0.6, 40)
    assert math.degrees(walls.angles[0]) == pytest.approx(0.55, abs=0.06)
    seen(walls, 0.6 + 0.9)
    assert walls.angles.size == 1


def test_a_new_direction_is_as_unsure_as_the_heading_that_saw_it_and_corrects_nothing_of_that() -> None:
    walls = WallDirections()
    assert seen(walls, 0.0, way_m=50.0) == 0.0
    assert math.sqrt(walls.cov[1, 1]) > math.sqrt(walls.cov[0, 0]) > math.radians(0.9)
    assert seen(walls, 0.5) == pytest.approx(0.0, abs=1e-9)
    assert abs(seen(walls, 0.5, way_m=5.0)) > 0.01  # what drifted since


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


@pytest.mark.parametrize(("size", "is_compass"), [(1.0, True), (4.0, False)])
def test_walls_round_an_open_place_are_no_compass(size: float, is_compass: bool) -> None:
    walls = WallDirections()
    points = np.concatenate(
        [line((size, -2.0 * size), 0.0, 6.0 * size), line((2.0 * size, 3.0 * size), 90.0, 3.0 * size)]
    )
    for _ in range(5):
        walls.turn(points, ORIGIN, 0.0, 0.6)
    assert (walls.turn(points, ORIGIN, math.radians(0.5), 0.6) < 0.0) == is_compass
