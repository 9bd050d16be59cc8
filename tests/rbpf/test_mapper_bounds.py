"""No input puts the robot, or the memory that its maps take, beyond where it can have come."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.rbpf import Mapper
from mrslam.rbpf.filter.particles import Motion, Proposals, _draw, propose
from mrslam.rbpf.front_end.local_matcher import LocalMatcher
from mrslam.rbpf.front_end.prediction import PAUSE_MOST_M, Guess
from mrslam.rbpf.front_end.rolling_map import RollingMap
from mrslam.spatial.hits.store import TileStore
from tests.rbpf.rooms import SMALL, drive, errors, make_scan, seen_room

FAR = np.array([150.0, 0.0, 0.0])
"""What the wheels count in each pause, metres."""
SCANS = 6
"""Scans in one place."""


def window(store: TileStore) -> int:
    return int(store.tables[0].size)


def leap(mapper: Mapper, leaps: int, step: np.ndarray = FAR) -> list[float]:
    """Feed the same room again and again, with a pause and a leap of the wheels between; return the health by leap."""
    health, stamp_ns = [], 0
    for k in range(leaps):
        for n in range(SCANS):
            stamp_ns += 10**8 if n else 10**11
            scan = make_scan(np.array([0.0, 0.001 * n, 0.0]), stamp_ns, rng=np.random.default_rng(SCANS * k + n))
            info = mapper.update(scan, k * step)
        health.append(info.health)
    return health


def test_where_maps_have_no_room_the_robot_is_doubted_and_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mrslam.rbpf.filter.particle_filter.MOST_TILES", 10_000)
    monkeypatch.setattr("mrslam.rbpf.front_end.front_end.FrontEnd._best_of_guesses", wheels_alone)
    mapper = Mapper(SMALL, seed=1)
    health = leap(mapper, 40)
    store = mapper._back.filter.store
    assert window(store) <= 30_000 and store.tables.nbytes < 2e6  # 40 leaps span 3800 tiles, 14 million in a square
    assert window(mapper._front._map._store) < 30_000
    assert health[0] > 0.5 and max(health[-5:]) < 0.5 and mapper._back._health.value < 0.1
    poses = mapper.trajectory().T_map_base
    assert poses.shape == (40 * SCANS, 3) and np.allclose(poses[-1, 0], 39 * FAR[0], rtol=0.02)
    assert len(mapper.snapshot().keyframes.stamps_ns) >= 40


def wheels_alone(self: object, points: object, odom_motion: np.ndarray, **_: bool) -> tuple[Guess, object]:
    """Replaces the local match: the motion is what odometry says."""
    front = self
    guess = front.predictor.predict(odom_motion)  # type: ignore[attr-defined]
    found = front._match(points, guess)  # type: ignore[attr-defined]
    return guess, found


def test_a_leap_longer_than_any_is_disbelieved() -> None:
    mapper = Mapper(SMALL, seed=1)
    leap(mapper, 10, step=(PAUSE_MOST_M + 1.0) / FAR[0] * FAR)
    assert np.abs(mapper.trajectory().T_map_base[:, :2]).max() < 0.5


def test_a_laser_that_cannot_be_on_the_robot_is_refused() -> None:
    mapper = Mapper(SMALL, seed=1)
    scan = make_scan(np.zeros(3), 10**8)
    object.__setattr__(scan, "T_base_laser", np.array([1e7, 0.0, 0.0]))
    info = mapper.update(scan, np.zeros(3))
    assert info.reason is not None and "from the base" in info.reason
    poses = drive(60)
    mapper = Mapper(SMALL, seed=1)
    for k, pose in enumerate(poses):
        mapper.update(make_scan(pose, k * 10**8, rng=np.random.default_rng(k)), pose)
    assert errors(mapper, poses)[0] < 0.08


def test_the_rolling_map_leaves_behind_what_is_out_of_sight() -> None:
    rolling, (_, points) = RollingMap(SMALL), seen_room()
    for k in range(300):
        T_local_base = np.array([8.0 * k, 0.0, 0.0])
        rolling.tiles_around(T_local_base)
        rolling.add(T_local_base, points)
    assert window(rolling._store) < 40_000  # 2.4 km: 1500 tiles long, and 60 scans span 300
    rolling.tiles_around(np.array([1e6, 0.0, 0.0]))
    assert window(rolling._store) < 10_000


@pytest.mark.parametrize(("deviation", "x"), [(0.03, 0.0), (0.002, 0.03)])
def test_no_particle_follows_a_match_that_the_motion_excludes(deviation: float, x: float) -> None:
    store, points = seen_room()
    motion, out = Motion(np.zeros(3), np.diag([deviation**2] * 3)), Proposals.empty(1)
    before = np.array([[0.03, 0.0, 0.0]])  # where the scan fits is 1 and 15 deviations away
    propose(store.maps, np.tile(points, (20, 1)), before, motion, np.zeros((1, 3)), 0.03, 10.0, 0, 1, out)
    assert np.isclose(out.poses[0, 0], x, atol=0.002)


def test_no_draw_is_wider_than_the_motion_allows() -> None:
    out, least = np.empty(3), 25.0
    for worthless in (
        np.zeros((3, 3)),
        np.diag([-1.0, 1e-6, -1e9]),
        np.array([[1e9, 1e5, 0], [1e5, 9, 0], [0, 0, -1]]),
    ):
        _draw(np.zeros(3), worthless, least, np.ones(3), out)
        assert np.abs(out).max() <= 1.0 / np.sqrt(least) + 1e-9


def test_no_local_match_leads_farther_than_searches_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    store, points = seen_room()
    start = np.array([0.12, 0.0, 0.0])
    guess = Guess(np.zeros(3), 0.3, 0.1, 0.1)
    found = LocalMatcher(0.03).match(store.tiles(0), points, start, guess)
    assert abs(found.pose[0]) < 0.01
    monkeypatch.setattr("mrslam.rbpf.front_end.local_matcher.FARTHEST_M", 0.1)
    found = LocalMatcher(0.03).match(store.tiles(0), points, start, guess)
    assert np.array_equal(found.pose, start)
