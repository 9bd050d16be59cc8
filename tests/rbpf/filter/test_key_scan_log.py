"""The scans that go with a map's keyframes."""

from __future__ import annotations

import numpy as np

from mrslam.rbpf import Mapper
from mrslam.rbpf.filter.key_scan_log import KeyScanLog
from mrslam.spatial import se2
from mrslam.spatial.key_scans import APART_M, POINTS_MOST
from tests.rbpf.rooms import SMALL, drive, feed, make_scan

T_BASE_LASER = (0.2, -0.1, 0.0)
MISSED_M = 0.06
"""Five deviations of the range's noise in these rooms, and half of each step."""


def test_every_keyframe_has_its_scan_and_it_lies_on_the_walls() -> None:
    mapper = Mapper(SMALL, seed=1)
    way = drive(40)[:36]  # most of a lap: who comes round sees nothing new
    feed(mapper, way, T_base_laser=T_BASE_LASER)
    local = mapper.snapshot()
    assert len(local.key_scans) == local.keyframes.stamps_ns.size > 3
    for k, stamp_ns in enumerate(local.keyframes.stamps_ns.tolist()):
        kept = local.key_scans.of(k)
        seen = make_scan(way[stamp_ns // 10**8], stamp_ns, T_base_laser=T_BASE_LASER).points_base()
        assert 30 < kept.shape[0] <= POINTS_MOST
        assert np.hypot(*(kept[:, None] - seen).transpose(2, 0, 1)).min(axis=1).max() < MISSED_M
        bearings = np.sort(np.arctan2(*(kept - T_BASE_LASER[:2]).T[::-1]))
        assert bearings[0] < -1.4
        assert bearings[-1] > 1.4


def test_scans_handed_out_stay_as_they_are() -> None:
    log, rng = KeyScanLog(), np.random.default_rng(0)
    points = np.concatenate([rng.uniform(1.0, 5.0, (50, 2)), np.ones((50, 3))], axis=1)
    log.add(log.of_points(points, np.zeros(2)))
    first = log.scans
    before = first.points.tobytes(), first.polar.tobytes()
    for _ in range(200):
        log.add(log.of_points(points, np.zeros(2)))
    assert len(log.scans) == 201
    assert (first.points.tobytes(), first.polar.tobytes()) == before
    assert not log.scans.polar.flags.writeable


def test_points_are_apart_across_the_beams_and_reach_all_around() -> None:
    angles = np.radians(np.arange(-135.0, 135.0, 0.25))
    circle = 4.0 * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    log = KeyScanLog()
    kept = log.of_points(np.concatenate([circle, np.ones((angles.size, 3))], axis=1), np.zeros(2)).of(0)
    steps = np.hypot(*np.diff(kept, axis=0).T)
    assert POINTS_MOST / 1.25 <= kept.shape[0] <= POINTS_MOST
    assert steps.min() >= APART_M
    assert steps.max() < 1.5 * steps.min()


def test_loops_lead_between_keyframes_as_the_map_has_them() -> None:
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, np.concatenate([drive(60), drive(60)]))
    local = mapper.snapshot()
    first, second, T_first_second, _ = mapper._back.loops.as_edges()
    assert first.size > 0
    T_map_key = local.keyframes.T_map_base
    error = se2.between(T_first_second, se2.between(T_map_key[first], T_map_key[second]))
    assert np.hypot(error[:, 0], error[:, 1]).max() < 0.15
    assert np.abs(error[:, 2]).max() < 0.05
