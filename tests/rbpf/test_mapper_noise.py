"""Scans that show no place at all are left out, and the wheels tell where the robot is meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from mrslam.rbpf import Mapper
from mrslam.spatial import Scan, se2
from tests.rbpf.rooms import SMALL, drive, feed, make_scan

BAD = range(60, 90)
"""Scans that the laser spoils, while the robot drives a metre and a half round a bend."""
POSES = drive(150)


def noise(scan: Scan, rng: np.random.Generator, far_m: float = 40.0) -> Scan:
    ranges = rng.uniform(-1.0, far_m, scan.ranges_m.size).astype(np.float32)
    ranges[rng.random(ranges.size) < 0.3] = np.nan
    return replace(scan, ranges_m=ranges)


def drive_with(spoil: Callable[[Scan, int], Scan]) -> tuple[Mapper, list[str]]:
    """Drive round the room with a laser that fails on the way; return the reasons of what was dropped, too."""
    mapper, rng, reasons = Mapper(SMALL, seed=1), np.random.default_rng(9), []
    for k, pose in enumerate(POSES):
        scan = make_scan(pose, k * 10**8, rng=rng)
        info = mapper.update(spoil(scan, k) if k in BAD else scan, pose)
        if info.reason is not None:
            assert k in BAD
            reasons.append(info.reason)
            assert np.hypot(*(info.T_map_base - pose)[:2]) < 0.15
    return mapper, reasons


@pytest.mark.parametrize("far_m", [8.0, 40.0, 120.0])  # of the last most are beyond the longest range
def test_random_ranges_leave_the_map_as_it_was(far_m: float) -> None:
    rng = np.random.default_rng(2)
    mapper, reasons = drive_with(lambda scan, k: noise(scan, rng, far_m))
    assert len(reasons) == len(BAD) and set(reasons) == {"the scan shows no surfaces, nor what was seen before"}
    whole = Mapper(SMALL, seed=1)
    feed(whole, POSES)
    known, usual = (m.snapshot().map.to_grid().known_area_m2() for m in (mapper, whole))
    assert known < 1.01 * usual
    assert np.hypot(*(mapper.T_map_base - POSES[-1])[:2]) < 0.06 and mapper.health > 0.8


@pytest.mark.parametrize("masked", [0, 12])
def test_a_laser_that_repeats_itself_while_the_wheels_turn_is_stuck(masked: int) -> None:
    held: list[Scan] = []

    def stuck(scan: Scan, k: int) -> Scan:  # where a teammate is believed to be moves on
        held.append(scan)
        ranges_m = held[0].ranges_m.copy()
        ranges_m[5 * k % 100 :][:masked] = np.nan
        return replace(held[0], stamp_ns=scan.stamp_ns, ranges_m=ranges_m)

    mapper, reasons = drive_with(stuck)
    assert len(reasons) == len(BAD) - 1 and set(reasons) == {
        "the scan repeats one that was taken elsewhere, by odometry"
    }
    assert np.hypot(*(mapper.T_map_base - POSES[-1])[:2]) < 0.06


def test_a_laser_that_comes_back_with_what_it_saw_before_an_outage_does_not_take_the_robot_back() -> None:
    rng, last = np.random.default_rng(2), BAD[0] - 1
    mapper, held = Mapper(SMALL, seed=1), make_scan(POSES[last], last * 10**8)
    feed(mapper, POSES[:last])
    assert mapper.update(held, POSES[last]).reason is None
    for k in BAD:
        again = replace(held, stamp_ns=k * 10**8)
        info = mapper.update(noise(again, rng) if k < 75 else again, POSES[k])
        assert info.reason is not None
        assert np.hypot(*(info.T_map_base - POSES[k])[:2]) < 0.15


def test_creeping_wheels_find_a_stuck_laser_out_too() -> None:
    mapper, scan = Mapper(SMALL, seed=1), make_scan(POSES[0], 0)
    reasons = [
        mapper.update(replace(scan, stamp_ns=k * 10**8), np.array([0.002 * k, 0.0, 0.0])).reason for k in range(6)
    ]
    assert [reason is None for reason in reasons] == [True] * 3 + [False] * 3


def test_a_robot_at_rest_may_see_the_same_to_the_last_bit() -> None:
    mapper, scan = Mapper(SMALL, seed=1), make_scan(POSES[0], 0)
    for wheels in (POSES[0], None):
        assert all(mapper.update(replace(scan, stamp_ns=k), wheels).reason is None for k in range(1, 20))


def test_a_map_does_not_begin_with_noise() -> None:
    mapper, rng = Mapper(SMALL, seed=1), np.random.default_rng(3)
    for k in range(5):
        assert mapper.update(noise(make_scan(POSES[0], k, rng=rng), rng), POSES[0]).reason is not None
    assert mapper.stats.processed == 0
    assert mapper.update(make_scan(POSES[0], 5, rng=rng), POSES[0]).processed


def test_a_place_of_thin_posts_is_mapped_though_it_has_no_surfaces() -> None:
    posts = np.random.default_rng(4).uniform(-15.0, 15.0, (250, 2))
    posts = posts[np.hypot(*posts.T) > 1.0]
    rng = np.random.default_rng(5)
    mapper, poses = Mapper(SMALL, seed=1), 0.5 * POSES[:80]

    def seen(pose: np.ndarray, stamp_ns: int) -> Scan:
        angles = -np.pi + np.deg2rad(np.arange(360))
        offset = posts - pose[:2]
        away, bearing = np.hypot(*offset.T), np.arctan2(offset[:, 1], offset[:, 0]) - pose[2]
        half = np.arcsin(0.02 / away)
        hit = np.abs(np.angle(np.exp(1j * (angles[:, None] - bearing)))) < half + np.deg2rad(0.5)
        ranges = np.where(hit, away, np.inf).min(axis=1) + rng.normal(0.0, 0.01, angles.size)
        return Scan(
            stamp_ns=stamp_ns, ranges_m=ranges.astype(np.float32), angle_min_rad=-np.pi,
            angle_increment_rad=np.deg2rad(1.0), range_max_m=30.0,
        )  # fmt: skip

    reasons = [mapper.update(seen(pose, k * 10**8), pose).reason for k, pose in enumerate(poses)]
    assert reasons[0] is not None and not any(reasons[1:])  # the first alone might be noise
    assert np.hypot(*(mapper.T_map_base - se2.between(poses[1], poses[-1]))[:2]) < 0.1


def test_a_mapper_saved_while_its_laser_fails_goes_on_the_same() -> None:
    rng = np.random.default_rng(6)
    whole, half = Mapper(SMALL, seed=1), Mapper(SMALL, seed=1)
    scans = [make_scan(pose, k * 10**8, rng=rng) for k, pose in enumerate(POSES[:60])]
    scans[30:40] = [noise(scan, rng) for scan in scans[30:40]]
    for k, (scan, pose) in enumerate(zip(scans, POSES, strict=False)):
        whole.update(scan, pose)
        if k < 35:
            half.update(scan, pose)
        if k == 34:
            resumed = Mapper(SMALL, seed=1)
            resumed.restore(half.state())
            half = resumed
            assert np.array_equal(half.T_map_base, whole.T_map_base)
        elif k > 34:
            half.update(scan, pose)
    assert np.array_equal(half.online_trajectory().T_map_base, whole.online_trajectory().T_map_base)
    assert half.stats.dropped == whole.stats.dropped == 10


def test_a_robot_that_is_lost_says_so_at_once() -> None:
    """Its health by keyframes alone would fall by a fifth."""
    mapper = Mapper(SMALL, seed=1)
    rng = np.random.default_rng(6)
    for k, pose in enumerate(POSES[:30]):
        info = mapper.update(make_scan(pose, k * 10**8, rng=rng), None)
    assert info.health > 0.9
    scan = make_scan(POSES[29], 30 * 10**8)
    elsewhere = replace(scan, ranges_m=(1.2 + 0.6 * np.cos(3.0 * scan.angles_rad)).astype(np.float32))
    info = mapper.update(elsewhere, None)
    assert info.reason is None and info.match_score < 0.4
    assert info.health < 0.5
