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
        mapper = Mapper(MapperConfig(particles=7, threads=threads, close_loops=False), seed=4)
        need(mapper, True)
        feed(mapper, poses)
        assert len(mapper.particles) == 7
        files.append((pack(mapper.state()), mapper.trajectory().T_map_base.tobytes()))
    assert files[0] == files[1] == files[2]
    other = Mapper(MapperConfig(particles=7, threads=1, close_loops=False), seed=5)
    need(other, True)
    feed(other, poses)
    assert pack(other.state()) != files[0][0]


def need(mapper: Mapper, is_needed: bool) -> None:
    """Let so much way be unseen that particles are needed, or none."""
    mapper._back._health._unseen_m = 1e6 if is_needed else 0.0


def test_there_are_as_many_particles_as_way_was_unseen(tmp_path: Path) -> None:
    poses = drive(150)
    states = []
    for threads in (1, 2):
        mapper = Mapper(MapperConfig(particles=12, threads=threads), seed=4)
        rng = np.random.default_rng(9)
        counts = []
        for k, pose in enumerate(poses):
            if k in (30, 100):
                need(mapper, k == 30)
            if k in (60, 80):
                mapper.use_particles({60: 3, 80: 20}[k])
                save_checkpoint(mapper, tmp_path / "resized.ckpt")
                mapper = load_checkpoint(tmp_path / "resized.ckpt")
                assert mapper.particles_most == {60: 3, 80: 20}[k]
            mapper.update(make_scan(pose, k * 10**8, rng=rng), pose)
            counts.append(len(mapper.particles))
        assert (counts[29], counts[59], counts[79], counts[99], counts[-1]) == (1, 12, 3, 20, 1)
        assert len({tuple(pose) for pose in mapper.particles}) == 1
        assert errors(mapper, poses)[0] < 0.06
        states.append(pack(mapper.state()))
    assert states[0] == states[1]
    with pytest.raises(InputError, match=r"rbpf\.particles must be a whole number in 1\.\.1000, got 0"):
        mapper.use_particles(0)


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
    need(mapper, True)
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
