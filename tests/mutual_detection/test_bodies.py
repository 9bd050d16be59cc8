"""Bodies of robot size are found in scans, and walls, furniture and people's legs are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.mutual_detection import find_bodies
from mrslam.spatial import Scan, se2
from tests.mutual_detection.sights import OFFICE, RADIUS_M, sweep


def seen_from(seed: int, away_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a pose on open floor, and a place so far away in free sight."""
    rng = np.random.default_rng(seed)
    while True:
        T_world_base = OFFICE.free_start(rng, 0.5)
        bearing = rng.uniform(-np.pi, np.pi)
        place = T_world_base[:2] + away_m * np.array([np.cos(bearing), np.sin(bearing)])
        steps = T_world_base[:2] + np.linspace(0.0, 1.0, 40)[:, None] * (place - T_world_base[:2])
        if (OFFICE.clearance_m(steps) > 0.25).all() and OFFICE.clearance_m(place) > 0.6:
            return T_world_base, place


@pytest.mark.parametrize("laser", ["lidar-360", "urg-04lx"])
@pytest.mark.parametrize("away_m", [1.0, 2.5, 4.0])
def test_a_body_in_free_sight_is_found_where_it_is(laser: str, away_m: float) -> None:
    found = 0
    for seed in range(12):
        T_world_base, place = seen_from(seed, away_m)
        T_world_base[2] = np.arctan2(*(place - T_world_base[:2])[::-1]) + 0.4  # in view of a laser of 240 degrees
        bodies = find_bodies(sweep(T_world_base, [place], laser=laser, seed=seed), RADIUS_M)
        there = se2.apply(se2.inverse(T_world_base), place)
        if len(bodies) and (off := np.hypot(*(bodies - there).T).min()) < 0.3:
            assert off < 0.08
            found += 1
    assert found >= 10


@pytest.mark.parametrize("radius_m", [0.05, 0.4])
def test_what_is_much_smaller_or_larger_is_no_robot(radius_m: float) -> None:
    for seed in range(10):
        T_world_base, place = seen_from(seed, 2.0)
        bodies = find_bodies(sweep(T_world_base, [place], radius_m=radius_m, seed=seed), RADIUS_M)
        there = se2.apply(se2.inverse(T_world_base), place)
        assert not len(bodies) or np.hypot(*(bodies - there).T).min() > 0.5


def test_furniture_is_seldom_taken_for_a_body() -> None:
    rng = np.random.default_rng(1)
    counts = [len(find_bodies(sweep(OFFICE.free_start(rng), [], seed=k), RADIUS_M)) for k in range(60)]
    assert np.mean(counts) < 0.3


def test_a_body_half_covered_by_another_is_not_measured() -> None:
    T_world_base, place = seen_from(0, 3.0)
    towards = (place - T_world_base[:2]) / 3.0
    side = np.array([-towards[1], towards[0]])
    nearer = T_world_base[:2] + 1.5 * towards + 0.2 * side
    there = se2.apply(se2.inverse(T_world_base), np.array([place, nearer]))
    bodies = find_bodies(sweep(T_world_base, [place, nearer]), RADIUS_M)
    off = np.hypot(*(bodies[:, None] - there[None]).transpose(2, 0, 1)).min(axis=0)
    assert off[1] < 0.08 and off[0] > 0.3


@pytest.mark.parametrize("edge", ["first", "last", "none"])
def test_a_body_at_the_edge_of_the_view_is_not_measured(edge: str) -> None:
    step = np.radians(0.5)
    half = np.arcsin(RADIUS_M / 2.0)  # a body 2 m ahead
    low, high = -half if edge == "first" else -1.0, half if edge == "last" else 1.0
    angles = np.arange(low + step / 2, high, step)
    across = 2.0 * np.sin(angles)
    depth = np.sqrt(np.maximum(RADIUS_M**2 - across**2, 0.0))
    ranges = np.where(np.abs(angles) < half, 2.0 * np.cos(angles) - depth, np.inf).astype(np.float32)
    scan = Scan(
        stamp_ns=0, ranges_m=ranges, angle_min_rad=float(angles[0]), angle_increment_rad=float(step), range_max_m=8.0
    )
    bodies = find_bodies(scan, RADIUS_M)
    assert len(bodies) == (edge == "none")
    assert not len(bodies) or bodies[0] == pytest.approx([2.0, 0.0], abs=0.05)


def test_a_body_is_found_in_the_robots_frame_however_its_laser_is_mounted() -> None:
    T_world_base, place = seen_from(0, 2.5)
    scan = sweep(T_world_base, [place])
    T_base_laser = se2.transform(0.4, -0.3, 0.8)
    there = se2.apply(se2.inverse(T_world_base), place)
    bodies = find_bodies(replace(scan, T_base_laser=T_base_laser), RADIUS_M)
    assert np.hypot(*(bodies - se2.apply(T_base_laser, there)).T).min() < 0.08


def test_no_beams_no_bodies() -> None:
    T_world_base, place = seen_from(0, 2.0)
    scan = sweep(T_world_base, [place])
    assert find_bodies(scan.with_ranges(np.full(scan.ranges_m.size, np.inf)), RADIUS_M).shape == (0, 2)
