from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrslam.rbpf import Mapper, MapperConfig
from mrslam.sim_driver.evaluate.truth import values_at
from mrslam.sim_driver.feeds import open_feed
from mrslam.spatial import InputError, Scan, se2
from tests.rbpf.rooms import SMALL, T_WORLD_START, drive, errors, feed, make_scan


def test_follows_the_truth_within_centimetres() -> None:
    poses = drive(150)
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, poses)
    away, turned = errors(mapper, poses)
    assert away < 0.06 and turned < 0.02
    assert np.hypot(*(mapper.T_map_base - poses[-1])[:2]) < 0.06
    assert mapper.health > 0.8 and mapper.stats.processed > 5
    assert mapper.online_trajectory().stamps_ns.size == 150


def test_a_mapper_of_no_settings_has_the_defaults() -> None:
    assert Mapper().config == MapperConfig() and Mapper(SMALL).config is SMALL


def test_the_online_trajectory_is_what_was_reported_when_each_scan_came() -> None:
    poses = drive(60)
    mapper, reported = Mapper(SMALL, seed=1), []
    for k in range(len(poses)):
        feed(mapper, poses[: k + 1], start=k)
        reported.append(mapper.T_map_base)
    online = mapper.online_trajectory()
    assert np.allclose(online.T_map_base, reported, atol=1e-5)
    assert (np.diff(online.stamps_ns) > 0).all()


def test_keyframes_far_apart_leave_nothing_old_enough_to_compare() -> None:
    truth = np.concatenate([drive(60)] * 4)
    mapper = Mapper(replace(SMALL, linear_update_m=15.0, angular_update_rad=50.0))
    feed(mapper, truth)
    assert 1 < mapper.stats.processed <= 5
    assert errors(mapper, truth)[0] < 0.1


def test_map_shows_the_room() -> None:
    poses = drive(100)
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, poses)
    grid = mapper.snapshot().map.to_grid()
    walls = grid.centres(grid.is_occupied)
    assert walls.shape[0] > 300
    assert 5.8 < np.ptp(walls[:, 0]) < 6.3 and 9.0 < np.ptp(walls[:, 1]) < 10.4


def test_floor_beside_a_wall_is_known_in_a_map_of_small_cells() -> None:
    poses = drive(100)
    mapper = Mapper(replace(SMALL, resolution_m=0.02), seed=1)
    feed(mapper, poses)
    beside = np.stack([np.linspace(5.0, 9.0, 400), np.full(400, 0.06)], axis=1)
    seen = values_at(mapper.snapshot().map.to_grid(), se2.apply(se2.inverse(T_WORLD_START), beside))
    assert np.mean(seen == 0) > 0.95


@pytest.mark.parametrize(
    "kw",
    [
        {"T_base_laser": (0.3, -0.1, 0.4)},
        {"beams": 360, "fov": 2.0 * np.pi},
        {"clockwise": True},
        {"T_base_laser": (-0.2, 0.0, np.pi)},
    ],
)
def test_laser_geometry_comes_from_the_scan(kw: dict[str, object]) -> None:
    poses = drive(100)
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, poses, **kw)
    away, turned = errors(mapper, poses)
    assert away < 0.08 and turned < 0.03


def test_bad_scans_are_counted_and_change_nothing() -> None:
    poses = drive(40)
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, poses)
    before = mapper.T_map_base
    good = make_scan(poses[-1], 10**11)
    for ranges in (np.full(180, np.nan), np.full(180, np.inf), np.empty(0), np.array([1.0, 2.0])):
        scan = Scan(
            stamp_ns=10**11, ranges_m=ranges.astype(np.float32), angle_min_rad=-1.5, angle_increment_rad=0.01,
            range_max_m=30.0,
        )  # fmt: skip
        info = mapper.update(scan, poses[-1])
        assert not info.processed and info.reason is not None and "usable returns" in info.reason
    assert mapper.stats.dropped == 4
    assert np.array_equal(mapper.T_map_base, before)
    assert mapper.update(good, poses[-1]).reason is None
    assert "repeats" in str(mapper.update(good, poses[-1]).reason)


def test_backward_and_equal_stamps_and_changing_beam_counts_are_taken() -> None:
    poses = drive(60)
    mapper = Mapper(SMALL, seed=1)
    rng = np.random.default_rng(3)
    for k, pose in enumerate(poses):
        stamp = (10**9 - k) if k % 3 else 5
        mapper.update(make_scan(pose, stamp, beams=120 + 60 * (k % 2), rng=rng), pose)
    assert mapper.stats.dropped == 0
    assert errors(mapper, poses)[0] < 0.08


def test_a_robot_at_rest_adds_nothing() -> None:
    mapper = Mapper(SMALL, seed=1)
    rng = np.random.default_rng(2)
    for k in range(100):
        mapper.update(make_scan(np.zeros(3), k * 10**9, rng=rng), np.zeros(3))
    assert mapper.stats.processed == 1
    assert np.abs(mapper.T_map_base).max() < 0.01


def test_revisions_rise_only_where_content_changed() -> None:
    poses = drive(80)
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, poses[:50])
    first = mapper.snapshot().map
    again = mapper.snapshot().map
    assert again.revision == first.revision and again.changed_since(first.revision) == {}
    rng = np.random.default_rng(5)
    for k, pose in enumerate(poses[50:]):
        mapper.update(make_scan(pose, 10**10 + k, rng=rng), pose)
    later = mapper.snapshot().map
    changed = later.changed_since(first.revision)
    assert changed
    for place, tile in later.tiles.items():
        same = place in first.tiles and np.array_equal(first.tiles[place].cells, tile.cells)
        assert same == (place not in changed)


def recorded(data_dir: Path, **settings: bool) -> tuple[Mapper, float]:
    """The mapper after the first round of a recorded building, and its mean error of relations, metres."""
    readings = open_feed(data_dir / "slam" / "intel.clf.gz").readings[:2500]
    relations = np.loadtxt(data_dir / "slam" / "intel.relations")
    mapper = Mapper(MapperConfig(particles=2, **settings), seed=2)
    for reading in readings:
        mapper.update(reading.scan, reading.T_odom_base)
    keyframes = mapper.trajectory()
    stamps = keyframes.stamps_ns / 1e9
    used = relations[(relations[:, :2] <= stamps.max()).all(axis=1) & (relations[:, :2] >= stamps.min()).all(axis=1)]
    assert used.shape[0] > 300
    one, two = (np.abs(stamps[:, None] - used[:, k]).argmin(axis=0) for k in (0, 1))
    error = se2.between(used[:, [2, 3, 7]], se2.between(keyframes.T_map_base[one], keyframes.T_map_base[two]))
    return mapper, float(np.hypot(error[:, 0], error[:, 1]).mean())


def test_recorded_loop_closes(data_dir: Path) -> None:
    _, open_m = recorded(data_dir, use_walls=False, close_loops=False)
    mapper, closed_m = recorded(data_dir, use_walls=False)
    assert mapper.stats.loops_closed >= 1
    assert closed_m < 0.03 < 0.05 < open_m


def test_straight_walls_keep_a_recorded_map_from_turning(data_dir: Path) -> None:
    _, error_m = recorded(data_dir, close_loops=False)
    assert error_m < 0.03  # without, it is above 0.05: see the test above


def test_config_bounds() -> None:
    with pytest.raises(InputError, match=r"rbpf\.particles must be a whole number in 1\.\.1000, got 0"):
        MapperConfig(particles=0)
    with pytest.raises(InputError, match=r"rbpf\.neff_fraction"):
        MapperConfig(neff_fraction=1.5)


def test_a_robot_that_stands_makes_keyframes_by_time_where_that_is_asked_for() -> None:
    for every_s, keyframes in ((0.0, 1), (1.0, 3)):
        mapper = Mapper(replace(SMALL, temporal_update_s=every_s), seed=1)
        feed(mapper, np.zeros((25, 3)))  # ten a second
        assert mapper.stats.processed == keyframes
