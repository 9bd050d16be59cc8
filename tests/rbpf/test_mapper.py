from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rbpf import Mapper, MapperConfig, load_checkpoint, save_checkpoint
from rbpf.checkpoint import VERSION
from sim_driver.feeds import open_feed
from spatial import InputError, Scan, se2
from spatial.state_file import pack
from tests.rbpf.rooms import drive, make_scan

SMALL = MapperConfig(particles=6, threads=1)


def feed(mapper: Mapper, poses: np.ndarray, odometry: np.ndarray | None = None, start: int = 0, **kw: object) -> None:
    rng = np.random.default_rng(9)
    odometry = poses if odometry is None else odometry
    for k, pose in enumerate(poses):
        scan = make_scan(pose, k * 10**8, rng=rng, **kw)  # type: ignore[arg-type]
        if k >= start:
            mapper.update(scan, odometry[k])


def errors(mapper: Mapper, truth: np.ndarray) -> tuple[float, float]:
    gap = se2.between(truth, mapper.trajectory().T_map_base)
    return float(np.hypot(gap[:, 0], gap[:, 1]).max()), float(np.abs(gap[:, 2]).max())


def test_follows_the_truth_within_centimetres() -> None:
    poses = drive(150)
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, poses)
    away, turned = errors(mapper, poses)
    assert away < 0.06 and turned < 0.02
    assert np.hypot(*(mapper.T_map_base - poses[-1])[:2]) < 0.06
    assert mapper.health > 0.8 and mapper.stats.processed > 5
    assert mapper.online_trajectory().stamps_ns.size == 150


def test_after_a_long_pause_the_robot_is_where_the_wheels_say() -> None:
    before = drive(400)[:60]
    after = se2.compose(np.array([0.0, -6.5, 0.5]), 0.2 * drive(60))
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, before)
    for k, pose in enumerate(after):
        mapper.update(make_scan(pose, (400 + k) * 10**8, rng=np.random.default_rng(k)), pose)
    away, turned = errors(mapper, np.concatenate([before, after]))
    assert away < 0.08 and turned < 0.03


def test_a_robot_that_stood_while_the_wheels_leapt_is_where_it_was() -> None:
    before = drive(60)
    after = se2.compose(before[-1], np.array([[0.0, 0.0, 0.6 + 0.02 * k] for k in range(20)]))  # it was turned, too
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, before)
    for k, pose in enumerate(after):
        told = se2.compose(np.array([-2.7, 2.7, -1.35]), pose)
        mapper.update(make_scan(pose, (200 + k) * 10**8, rng=np.random.default_rng(k)), told)
    away, turned = errors(mapper, np.concatenate([before, after]))
    assert away < 0.08 and turned < 0.03
    assert mapper.health > 0.8


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


def test_without_odometry() -> None:
    poses = drive(150)
    mapper = Mapper(MapperConfig(particles=6, threads=1, use_odometry=False), seed=1)
    feed(mapper, poses, poses * np.nan)
    assert errors(mapper, poses)[0] < 0.08


def test_a_turn_while_no_scans_came_is_found_without_odometry() -> None:
    poses = drive(150)
    rng = np.random.default_rng(9)
    mapper = Mapper(MapperConfig(particles=6, threads=1, use_odometry=False), seed=1)
    for k, pose in enumerate(poses[:100]):
        mapper.update(make_scan(pose, k * 10**8, rng=rng), None)
    turned = se2.compose(poses[99], np.array([0.0, 0.0, 1.4]))
    info = mapper.update(make_scan(turned, 10**10, rng=rng), None)
    assert np.abs(se2.between(info.T_map_base, turned)).max() < 0.1


def test_a_robot_that_nothing_tells_of_its_motion_doubts_where_it_is() -> None:
    angles = np.linspace(-1.5, 1.5, 181)
    healths = {}
    for told in (True, False):
        mapper = Mapper(MapperConfig(particles=4, threads=1, use_odometry=told), seed=1)
        rng = np.random.default_rng(2)
        for k in range(60):  # a corridor without end: every scan looks alike
            ranges = np.minimum(1.0 / np.maximum(np.abs(np.sin(angles)), 0.01), 30.0) + rng.normal(0.0, 0.01, 181)
            ranges[np.abs(np.sin(angles)) < 0.1] = np.inf
            scan = Scan(
                stamp_ns=k * 10**8, ranges_m=ranges.astype(np.float32), angle_min_rad=-1.5,
                angle_increment_rad=3.0 / 180, range_max_m=25.0,
            )  # fmt: skip
            info = mapper.update(scan, np.array([0.1 * k, 0.0, 0.0]))
        healths[told] = info.health
    assert healths[False] < 0.5 < healths[True]


def test_odometry_that_lies_is_mistrusted() -> None:
    poses = drive(150)
    motion = se2.between(poses[:-1], poses[1:])
    odometry = [np.zeros(3)]
    for k, step in enumerate(motion):
        lie = np.array([-step[0], step[1], 1.5 * step[2]])  # forward told as reverse, turns told too wide
        if k == 70:
            lie = np.array([1.5, 0.0, 0.8])
        odometry.append(se2.compose(odometry[-1], lie))
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, poses, np.stack(odometry))
    assert errors(mapper, poses)[0] < 0.12


def test_one_seed_gives_the_same_bytes_with_any_number_of_threads() -> None:
    poses, files = drive(60), []
    for threads in (1, 2, 3):
        mapper = Mapper(MapperConfig(particles=7, threads=threads), seed=4)
        feed(mapper, poses)
        files.append((pack(mapper.state()), mapper.trajectory().T_map_base.tobytes()))
    assert files[0] == files[1] == files[2]
    other = Mapper(MapperConfig(particles=7, threads=1), seed=5)
    feed(other, poses)
    assert pack(other.state()) != files[0][0]


def test_particles_may_be_fewer_and_more_while_the_robot_drives(tmp_path: Path) -> None:
    poses = drive(150)
    states = []
    for threads in (1, 2):
        mapper = Mapper(MapperConfig(particles=12, threads=threads), seed=4)
        rng = np.random.default_rng(9)
        for k, pose in enumerate(poses):
            count = {40: 3, 80: 1, 110: 20}.get(k)
            if count is not None:
                told = mapper.T_map_base
                speaks = mapper.snapshot().keyframes.T_map_base
                mapper.use_particles(count)
                assert mapper.particles.shape == (count, 3) and mapper._back.filter.neff == count
                assert np.array_equal(mapper.T_map_base, told)
                assert np.array_equal(mapper.snapshot().keyframes.T_map_base, speaks)
                save_checkpoint(mapper, tmp_path / "resized.ckpt")
                mapper = load_checkpoint(tmp_path / "resized.ckpt")
            mapper.update(make_scan(pose, k * 10**8, rng=rng), pose)
        assert errors(mapper, poses)[0] < 0.06
        assert len({tuple(pose) for pose in mapper.particles}) == 20  # copies part with the next keyframe
        states.append(pack(mapper.state()))
    assert states[0] == states[1]
    with pytest.raises(InputError, match=r"rbpf\.particles must be a whole number in 1\.\.1000, got 0"):
        mapper.use_particles(0)


def test_particles_may_be_fewer_from_the_first_scan_on() -> None:
    poses = drive(60)
    mapper = Mapper(SMALL, seed=1)
    mapper.use_particles(2)
    feed(mapper, poses)
    assert mapper.particles.shape == (2, 3)
    assert errors(mapper, poses)[0] < 0.06


def test_rounds_in_one_room_cost_no_memory() -> None:
    poses = drive(50)
    mapper = Mapper(SMALL, seed=1)
    rng = np.random.default_rng(9)
    scans, tiles = [], []
    for lap in range(32):
        for k, pose in enumerate(poses):
            mapper.update(make_scan(pose, (lap * 50 + k) * 10**8, beams=90, rng=rng), pose)
        back = mapper._back
        scans.append(sum(scan.nbytes for scan in back.loops.scans))
        tiles.append(back.filter.store.tiles_used)
    assert back.filter.keys == len(back.loops.scans) > 1.8 * len(back.loops.kept)
    assert back.loops.kept == [k for k, scan in enumerate(back.loops.scans) if scan.shape[0] > 0]
    assert scans[-1] < 1.05 * scans[16] and tiles[-1] < 1.5 * tiles[16]
    assert errors(mapper, np.tile(poses, (32, 1)))[0] < 0.08


def test_particles_that_never_part_remember_the_far_past_once(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("rbpf.particle_filter.APART_MOST", 12)
    poses = drive(120)
    mapper = Mapper(replace(SMALL, neff_fraction=0.01), seed=1)
    feed(mapper, poses)
    particles = mapper._back.filter
    assert particles.resamplings == 0 and particles.keys > 20
    assert particles._own.shape[1] <= 12
    assert particles.ancestry(0).shape == (particles.keys, 3)
    assert errors(mapper, poses)[0] < 0.06
    save_checkpoint(mapper, tmp_path / "long.ckpt")
    again = load_checkpoint(tmp_path / "long.ckpt")
    np.testing.assert_array_equal(again.trajectory().T_map_base, mapper.trajectory().T_map_base)


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


@pytest.mark.parametrize("odometry", [None, [np.nan, 0.0, 0.0], [1e300, 0.0, 0.0], [1e7, -1e7, 3.0]])
def test_odometry_that_makes_no_sense_does_no_harm(odometry: list[float] | None) -> None:
    poses = drive(100)
    mapper = Mapper(SMALL, seed=1)
    rng = np.random.default_rng(2)
    for k, pose in enumerate(poses):
        told = pose if k % 30 != 29 else None if odometry is None else np.array(odometry)
        mapper.update(make_scan(pose, k, rng=rng), told)
    assert errors(mapper, poses)[0] < 0.1


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


def test_resuming_is_the_same_to_the_byte(tmp_path: Path, data_dir: Path) -> None:
    readings = open_feed(data_dir / "small" / "loop5.clf.gz").readings[:120]
    whole, half = (Mapper(MapperConfig(particles=5, threads=1), seed=3) for _ in range(2))
    for k, reading in enumerate(readings):
        whole.update(reading.scan, reading.T_odom_base)
        if k < 60:
            half.update(reading.scan, reading.T_odom_base)
    save_checkpoint(half, tmp_path / "half.ckpt")
    half = load_checkpoint(tmp_path / "half.ckpt")
    for reading in readings[60:]:
        half.update(reading.scan, reading.T_odom_base)
    save_checkpoint(whole, tmp_path / "a.ckpt")
    save_checkpoint(half, tmp_path / "b.ckpt")
    assert (tmp_path / "a.ckpt").read_bytes() == (tmp_path / "b.ckpt").read_bytes()


def test_damaged_checkpoints_are_refused(tmp_path: Path) -> None:
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, drive(20))
    path = tmp_path / "m.ckpt"
    save_checkpoint(mapper, path)
    raw = path.read_bytes()
    flipped = bytearray(raw)
    flipped[len(raw) // 2] ^= 1
    for content, message in (
        (raw[:-7], "cut off or damaged"),
        (bytes(flipped), "cut off or damaged"),
        (b"hello", "not a mrslam-mapper file"),
        (b"", "not a mrslam-mapper file"),
        (raw.replace(b"mapper %d " % VERSION, b"mapper 99 ", 1), "version 99"),
    ):
        path.write_bytes(content)
        with pytest.raises(InputError, match=message):
            load_checkpoint(path)
    with pytest.raises(InputError, match="cannot be read"):
        load_checkpoint(tmp_path / "none.ckpt")


def test_a_state_of_another_layout_is_refused(tmp_path: Path) -> None:
    mapper = Mapper(SMALL, seed=1)
    feed(mapper, drive(20))
    state = mapper.state()
    del state["layout"]  # as written by the first version
    with pytest.raises(InputError, match=r"layout 1, this program reads \d"):
        Mapper(SMALL, seed=1).restore(state)


def test_recorded_loop_closes(data_dir: Path) -> None:
    readings = open_feed(data_dir / "slam" / "intel.clf.gz").readings[:1500]
    relations = np.loadtxt(data_dir / "slam" / "intel.relations")
    mapper = Mapper(MapperConfig(particles=8), seed=2)
    for reading in readings:
        mapper.update(reading.scan, reading.T_odom_base)
    keyframes = mapper.trajectory()
    stamps = keyframes.stamps_ns / 1e9
    used = relations[(relations[:, :2] <= stamps.max()).all(axis=1) & (relations[:, :2] >= stamps.min()).all(axis=1)]
    one, two = (np.abs(stamps[:, None] - used[:, k]).argmin(axis=0) for k in (0, 1))
    error = se2.between(used[:, [2, 3, 7]], se2.between(keyframes.T_map_base[one], keyframes.T_map_base[two]))
    assert used.shape[0] > 100
    assert np.hypot(error[:, 0], error[:, 1]).mean() < 0.04


def test_config_bounds() -> None:
    with pytest.raises(InputError, match=r"rbpf\.particles must be a whole number in 1\.\.1000, got 0"):
        MapperConfig(particles=0)
    with pytest.raises(InputError, match=r"rbpf\.neff_fraction"):
        MapperConfig(neff_fraction=1.5)
