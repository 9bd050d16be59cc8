"""Particles: their number, their memory, and that one seed gives one result."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrslam.rbpf import Mapper, MapperConfig, load_checkpoint, save_checkpoint
from mrslam.spatial import InputError
from mrslam.spatial.files.state_file import pack
from tests.rbpf.rooms import SMALL, drive, errors, feed, make_scan


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
        scans.append(sum(scan.nbytes for scan in back.loops.scans.points.values()))
        tiles.append(back.filter.store.tiles_used)
    kept = back.loops.scans
    assert back.filter.ancestry.keys == kept.way_m.size > 1.8 * len(kept.points)
    assert max(kept.points) == kept.way_m.size - 1 and min(kept.points) > 0
    assert scans[-1] < 1.05 * scans[16] and tiles[-1] < 1.5 * tiles[16]
    assert errors(mapper, np.tile(poses, (32, 1)))[0] < 0.08


def test_particles_that_never_part_remember_the_far_past_once(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("mrslam.rbpf.filter.ancestry.APART_MOST", 12)
    poses = drive(120)
    mapper = Mapper(replace(SMALL, neff_fraction=0.01), seed=1)
    feed(mapper, poses)
    particles = mapper._back.filter
    ancestry = particles.ancestry
    assert particles.resamplings == 0 and ancestry.keys > 20
    assert ancestry.apart.shape[1] <= 12
    assert ancestry.of(0).shape == (ancestry.keys, 3)
    assert errors(mapper, poses)[0] < 0.06
    save_checkpoint(mapper, tmp_path / "long.ckpt")
    again = load_checkpoint(tmp_path / "long.ckpt")
    np.testing.assert_array_equal(again.trajectory().T_map_base, mapper.trajectory().T_map_base)
