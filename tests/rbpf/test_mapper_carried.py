"""A robot that is carried to another place of its map, and what it makes of places that look alike."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.rbpf import Mapper, MapperConfig, UpdateInfo, load_checkpoint, save_checkpoint
from mrslam.spatial import se2
from mrslam.spatial.files.state_file import pack
from tests.rbpf import rooms
from tests.rbpf.rooms import drive, make_scan

PAUSE = 300
"""Scans that the laser would have taken while the robot was carried: 30 s."""


def played(mapper: Mapper, poses: NDArray[np.float64], first: int, T_odom_start: NDArray[np.float64]) -> list[float]:
    """Feed scans from these poses, the first one numbered ``first``; return the health after each."""
    return [info.health for info in updates(mapper, poses, first, T_odom_start)]


def updates(
    mapper: Mapper, poses: NDArray[np.float64], first: int, T_odom_start: NDArray[np.float64], leaves: float = 0.0
) -> list[UpdateInfo]:
    """Feed the same, and return what the mapper did; a share ``leaves`` of the beams ends before the walls."""
    rng, wind = np.random.default_rng(first), np.random.default_rng(first)
    told = se2.compose(T_odom_start, se2.between(poses[0], poses))
    infos = []
    for k, (pose, odometry) in enumerate(zip(poses, told, strict=True)):
        scan = make_scan(pose, (first + k) * 10**8, fov=2 * np.pi, rng=rng)
        is_leaf = wind.random(scan.ranges_m.size) < leaves
        ranges_m = np.where(is_leaf, wind.uniform(0.5, 0.9, is_leaf.size) * scan.ranges_m, scan.ranges_m)
        infos.append(mapper.update(replace(scan, ranges_m=ranges_m.astype(np.float32)), odometry))
    return infos


def carried(particles: int) -> tuple[Mapper, NDArray[np.float64], list[float]]:
    """A mapper that was carried across the room it knows and drove on; the way since, and the health on it."""
    mapper = Mapper(MapperConfig(particles=particles, threads=1), seed=1)
    before, after = drive(200), np.concatenate([drive(200)[90:], drive(200)[:120]])
    played(mapper, before[:190], 0, np.zeros(3))
    return mapper, after, played(mapper, after, 190 + PAUSE, before[189])


def test_a_robot_that_was_carried_is_found_in_its_map() -> None:
    mapper, after, health = carried(6)
    assert max(health[:20]) < 0.5 < health[-1]  # doubted at once, and until it is found
    gap = se2.between(after, mapper.trajectory().T_map_base[190:])
    assert np.hypot(gap[:, 0], gap[:, 1]).max() < 0.1 and np.abs(gap[:, 2]).max() < 0.05
    assert np.abs(se2.between(after[-1], mapper.T_map_base)).max() < 0.1
    assert mapper.stats.loops_closed == 1


def test_a_robot_that_was_carried_is_lost_at_once_and_until_it_is_found() -> None:
    mapper, way = Mapper(MapperConfig(particles=6, threads=1), seed=1), drive(200)
    assert not any(info.is_lost for info in updates(mapper, way[:190], 0, np.zeros(3)))
    after = np.concatenate([way[90:], way[:120]])
    is_lost = [info.is_lost for info in updates(mapper, after, 190 + PAUSE, way[189])]
    found = is_lost.index(False)
    assert found > 0 and not any(is_lost[found:])


def test_a_robot_that_is_resumed_is_as_lost_as_it_was(tmp_path: Path) -> None:
    mapper, way = Mapper(MapperConfig(particles=6, threads=1), seed=1), drive(200)
    updates(mapper, way[:190], 0, np.zeros(3))
    for k in range(90, 100):  # on keyframes and between them
        updates(mapper, way[k : k + 1], 100 + k + PAUSE, se2.compose(way[189], se2.between(way[90], way[k])))
        save_checkpoint(mapper, tmp_path / "lost.ckpt")
        told = se2.compose(way[189], se2.between(way[90], way[k + 1]))
        again = load_checkpoint(tmp_path / "lost.ckpt")
        assert updates(again, way[k + 1 : k + 2], 101 + k + PAUSE, told)[0].is_lost


def test_where_leaves_hide_the_walls_a_pause_makes_no_robot_lost() -> None:
    mapper, way = Mapper(MapperConfig(particles=6, threads=1), seed=1), drive(200)
    updates(mapper, way[:190], 0, np.zeros(3), leaves=0.4)
    assert not any(info.is_lost for info in updates(mapper, way[5:60], 190 + PAUSE, way[5], leaves=0.4))


def test_a_robot_that_stood_through_a_pause_was_not_carried() -> None:
    mapper, way = Mapper(MapperConfig(particles=6, threads=1), seed=1), drive(200)
    played(mapper, way[:100], 0, np.zeros(3))
    health = played(mapper, way[99:], 100 + PAUSE, way[99])
    assert min(health) > 0.5 and mapper.stats.loops_closed == 0
    gap = se2.between(way[99:], mapper.trajectory().T_map_base[100:])
    assert np.hypot(gap[:, 0], gap[:, 1]).max() < 0.08


@pytest.mark.parametrize("jump_m", [(0.0, 0.9), (-1.2, 0.4)])
def test_odometry_that_jumped_while_nothing_was_seen_does_not_place_the_robot(jump_m: tuple[float, float]) -> None:
    mapper, way = Mapper(MapperConfig(particles=6, threads=1), seed=1), drive(200)
    played(mapper, way[:150], 0, np.zeros(3))
    jumped = se2.compose(way[149], se2.between(way[149], way[170]) + np.array([*jump_m, 0.1]))
    played(mapper, way[170:], 150 + PAUSE, jumped)
    gap = se2.between(way[170:], mapper.trajectory().T_map_base[150:])
    assert np.hypot(gap[:, 0], gap[:, 1]).max() < 0.1 and np.abs(gap[:, 2]).max() < 0.05


WING = [[0, 0, 6, 0], [0, 0, 0, 5], [0, 5, 6, 5], [6, 0, 6, 2], [6, 3, 6, 5], [1, 1, 1.5, 1], [4, 3.8, 4, 4.4]]
CORRIDOR = [[6, 2, 18, 2], [6, 3, 18, 3]]


def test_a_house_whose_halves_are_alike_does_not_turn_a_robot_that_drove_blind(monkeypatch: pytest.MonkeyPatch) -> None:
    other_half = np.tile([24.0, 5.0], 2) - np.array(WING)
    monkeypatch.setattr(rooms, "WALLS", np.concatenate([WING, other_half, CORRIDOR]))
    monkeypatch.setattr(rooms, "T_WORLD_START", np.zeros(3))
    east = [np.array([24.0 - x, 5.0 - y, np.pi + turn]) for x, y, turn in wing_round()]
    along = [np.array([x, 2.5, np.pi]) for x in np.arange(19.0, 4.9, -0.1)]
    way = np.array([*east, *along, *wing_round()])
    mapper = Mapper(MapperConfig(particles=6, threads=1), seed=1)
    played(mapper, way, 0, way[0])
    there = np.array([24.0, 5.0, np.pi]) - way[-1] * [1.0, 1.0, -1.0]  # sees the same
    after = np.array([se2.compose(there, np.array([0.05 * k, 0.0, 0.0])) for k in range(20)])
    played(mapper, after, way.shape[0] + PAUSE, after[0])
    assert np.abs(se2.between(se2.between(way[0], after[-1]), mapper.T_map_base)).max() < 0.2


def wing_round() -> NDArray[np.float64]:
    """Poses of a round through the western wing of that house, from its door and back to its middle."""
    corners = np.array([[5.0, 2.5], [3.0, 2.0], [1.5, 3.5], [3.0, 3.0]])
    places = np.concatenate([np.linspace(a, b, 25)[:-1] for a, b in pairwise(corners)])
    steps = np.diff(places, axis=0, append=places[-1:] + places[-1:] - places[-2:-1])
    return np.column_stack([places, np.arctan2(steps[:, 1], steps[:, 0])])


def test_a_checkpoint_of_a_carried_robot_continues_the_same(tmp_path: Path) -> None:
    way = drive(200)
    states = []
    for saved in (False, True):
        mapper = Mapper(MapperConfig(particles=6, threads=1), seed=1)
        played(mapper, way[:190], 0, np.zeros(3))
        played(mapper, way[90:130], 190 + PAUSE, way[189])
        assert mapper.health < 0.5
        if saved:
            save_checkpoint(mapper, tmp_path / "carried.ckpt")
            mapper = load_checkpoint(tmp_path / "carried.ckpt")
        played(mapper, way[130:], 230 + PAUSE, se2.compose(way[189], se2.between(way[90], way[130])))
        states.append(pack(mapper.state()))
    assert states[0] == states[1]


TWINS = np.array(
    [
        [0, 0, 30, 0], [30, 0, 30, 8], [30, 8, 0, 8], [0, 8, 0, 0],  # a hall with two equal niches, and unlike ends
        [6, 0, 6, 2], [6, 2, 8, 2], [8, 2, 8, 0], [18, 0, 18, 2], [18, 2, 20, 2], [20, 2, 20, 0],
        [1, 8, 1, 6.5], [1, 6.5, 2.5, 6.5], [28, 3, 29, 4],
    ],
    dtype=float,
)  # fmt: skip


def test_after_a_pause_a_place_that_only_the_whole_map_shows_is_where_the_robot_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("tests.rbpf.rooms.WALLS", TWINS)
    monkeypatch.setattr("tests.rbpf.rooms.T_WORLD_START", np.array([3.0, 5.0, 0.0]))
    mapper = Mapper(MapperConfig(particles=6, threads=1, usable_range_m=5.0), seed=1)
    east = np.column_stack([np.arange(0.0, 25.0, 0.1), np.zeros(250), np.zeros(250)])
    played(mapper, east, 0, east[0])
    back = np.column_stack([np.arange(1.0, 6.0, 0.1), np.zeros(50), np.zeros(50)])  # 24 m back in the pause
    told = back[0] + np.array([0.6, -0.4, 0.2])
    health = played(mapper, back, 250 + PAUSE, told)
    gap = se2.between(back, mapper.trajectory().T_map_base[250:])
    assert np.hypot(gap[:, 0], gap[:, 1]).max() < 0.1 and np.abs(gap[:, 2]).max() < 0.03 and min(health) > 0.5


@pytest.mark.parametrize("particles", [1, 8])
def test_particles_follow_all_places_that_look_alike(monkeypatch: pytest.MonkeyPatch, particles: int) -> None:
    monkeypatch.setattr("tests.rbpf.rooms.WALLS", TWINS)
    monkeypatch.setattr("tests.rbpf.rooms.T_WORLD_START", np.array([3.0, 5.0, 0.0]))
    near = 4.0  # metres that the laser sees: not the ends from the niches

    def seen(mapper: Mapper, x: NDArray[np.float64], first: int, told: float) -> int:
        guesses = 0
        for k, at in enumerate(x):
            scan = make_scan(np.array([at, 0.0, 0.0]), (first + k) * 10**8, fov=2 * np.pi, rng=np.random.default_rng(k))
            ranges = np.where(scan.ranges_m < near, scan.ranges_m, np.inf).astype(np.float32)
            mapper.update(replace(scan, ranges_m=ranges), np.array([told + at - x[0], 0.0, 0.0]))
            guesses = max(guesses, len(mapper._back.loops.histories))
        return guesses

    mapper = Mapper(MapperConfig(particles=particles, threads=1), seed=1)
    seen(mapper, np.arange(0.0, 24.0, 0.15), 0, 0.0)
    guesses = seen(mapper, np.arange(2.5, 8.0, 0.15), 1000, 24.0)
    assert (guesses > 1) == (particles > 1)


@pytest.mark.parametrize("noise_m", [0.03, 0.05])
def test_a_robot_that_is_carried_after_scans_that_were_noisier_than_usual_notices(noise_m: float) -> None:
    mapper, rng, told = Mapper(MapperConfig(particles=4, threads=1), seed=1), np.random.default_rng(1), np.zeros(3)
    poses = np.concatenate([drive(200)[:90], drive(200)[150:175]])
    steps = np.vstack([np.zeros(3), se2.between(poses[:-1], poses[1:])])
    steps[90] = steps[89]  # the wheels do not tell
    health = []
    for k, (pose, step) in enumerate(zip(poses, steps, strict=True)):
        told = se2.compose(told, step)
        scan = make_scan(pose, k * 10**8, fov=2 * np.pi, rng=rng)
        noise = rng.normal(0.0, noise_m if 86 <= k < 90 else 0.0, scan.ranges_m.size)
        health.append(mapper.update(replace(scan, ranges_m=(scan.ranges_m + noise).astype(np.float32)), told).health)
    assert min(health[:90]) > 0.8 and max(health[90:]) < 0.5
