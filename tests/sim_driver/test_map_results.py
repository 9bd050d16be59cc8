"""What `mrslam map` makes of a log of which the mapper could not use all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.rbpf import Mapper
from mrslam.sim_driver.cli.maps.map_results import Mapped, Way, results_of
from mrslam.sim_driver.feeds import Reading
from mrslam.spatial import Keyframes, se2
from tests.rbpf.rooms import SMALL, drive, make_scan

MOUNTED = (0.1, -0.05, 0.3)
BLIND = range(30, 36)
"""Scans that show nothing."""


def mapped(poses: np.ndarray) -> tuple[Mapper, list[Reading], Way]:
    """Map a drive by a laser that is not in the robot's middle, and blind on the way."""
    mapper, rng, way = Mapper(SMALL, seed=1), np.random.default_rng(9), Way()
    readings = []
    for k, pose in enumerate(poses):
        scan = make_scan(pose, k * 10**8, rng=rng, T_base_laser=MOUNTED)
        scan = scan.with_ranges(np.full(scan.ranges_m.size, np.inf)) if k in BLIND else scan
        readings.append(Reading(scan, se2.compose(np.array([5.0, 1.0, 2.0]), pose)))
        info = mapper.update(scan, readings[-1].T_odom_base)
        way.fed += 1
        if info.reason is None:
            way.accepted.append(k)
            way.health.append(info.health)
    return mapper, readings, way


def test_trajectories_hold_the_lasers_pose_at_every_scan_also_at_those_of_no_use() -> None:
    poses = drive(120)
    mapper, readings, way = mapped(poses)
    assert set(range(120)) - set(way.accepted) == set(BLIND)
    found = results_of(Mapped.by(mapper), readings, way, None, {"log": "x"})
    assert (found.metrics["scans"], found.metrics["scans_dropped"]) == (120, len(BLIND))
    truth = se2.compose(se2.between(poses[0], poses), np.array(MOUNTED))
    for stamps_ns, laser in found.trajectories.values():
        assert stamps_ns.tolist() == [reading.scan.stamp_ns for reading in readings]
        off = se2.between(truth, laser)
        assert np.hypot(off[:, 0], off[:, 1]).max() < 0.08 and np.abs(off[:, 2]).max() < 0.03


def test_each_trajectory_is_its_own_and_scans_take_as_long_as_they_took() -> None:
    mapper, readings, way = mapped(drive(20))
    way.processed_ms = [float(ms) for ms in range(101)]
    known = Mapped.by(mapper)
    later = replace(
        known, online=Keyframes(known.online.stamps_ns, known.online.T_map_base + np.array([5.0, 0.0, 0.0]))
    )
    found = results_of(later, readings, way, None, {})
    (_, corrected), (_, online) = (found.trajectories[name] for name in ("trajectory", "trajectory_online"))
    assert (online[:, 0] - corrected[:, 0]).min() > 4.0
    assert (found.metrics["ms_per_processed_p50"], found.metrics["ms_per_processed_p95"]) == (50.0, 95.0)


def test_relations_outside_of_the_log_are_counted_as_given() -> None:
    mapper, readings, way = mapped(drive(20))
    stamps_us = np.array([reading.scan.stamp_ns // 1000 for reading in readings])
    first, second = stamps_us[[0, 2, 4]], stamps_us[[5, 7, 9]] + np.array([0, 0, 10**9])
    found = results_of(Mapped.by(mapper), readings, way, (first, second, np.zeros((3, 3))), {})
    for row in found.metrics["relations"].values():
        assert (row["relations"], row["relations_given"]) == (2, 3)


def test_of_a_log_that_was_interrupted_there_are_the_scans_that_were_fed() -> None:
    mapper, readings, way = mapped(drive(120)[:20])
    later = [Reading(make_scan(np.zeros(3), 10**11), None)] * 5
    found = results_of(Mapped.by(mapper), [*readings, *later], way, None, {})
    assert found.metrics["interrupted_after_scans"] == found.metrics["scans"] == 20
    assert found.metrics["known_area_m2"] == pytest.approx(mapper.snapshot().map.known_area_m2(), abs=0.05)
    assert all(stamps_ns.size == 20 for stamps_ns, _ in found.trajectories.values())
