"""The particle filter: weights, resampling, the best particle, and maps that follow their particles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.rbpf import MapperConfig
from mrslam.rbpf.filter.particle_filter import BEST_SWITCH_LOG_WEIGHT, ParticleFilter
from mrslam.rbpf.outcome import Stopwatch
from mrslam.spatial import se2
from mrslam.spatial.hits.store import TileStore
from mrslam.spatial.runtime.crew import Crew
from tests.rbpf.rooms import drive, keyframe

CONFIG = MapperConfig(particles=6, threads=1, neff_fraction=0.0, use_walls=False)
"""Never resamples."""
ASTRAY = np.array([2.0, 1.0, 1.0])
"""Far beyond what the matcher can put right."""


def begun(config: MapperConfig = CONFIG, keys: int = 6) -> tuple[ParticleFilter, NDArray[np.float64]]:
    """A filter after the first keyframes of a drive, and the whole drive ``(20, 3)``."""
    particles, way = ParticleFilter(config, 1, Crew(1), Stopwatch()), drive(20)
    for k in range(keys):
        move(particles, way, k)
    return particles, way


def move(particles: ParticleFilter, way: NDArray[np.float64], k: int) -> None:
    """Take the k-th keyframe of a drive."""
    key = keyframe(se2.between(way[max(k - 1, 0)], way[k]), way[k], np.random.default_rng(k))
    particles.move(key)
    particles.draw(key, beside=lambda: None)


def lead_astray(particles: ParticleFilter, indices: list[int]) -> None:
    """Put particles where the robot is not."""
    particles.ends[indices] = se2.compose(particles.ends[indices], ASTRAY)


def off_m(particles: ParticleFilter, truth: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of each particle from the truth ``(N,)``."""
    away: NDArray[np.float64] = np.hypot(*(particles.ends - truth)[:, :2].T)
    return away


def test_particles_whose_maps_do_not_fit_lose_weight() -> None:
    particles, way = begun()
    assert particles.weights.min() > 0.01
    lead_astray(particles, [0, 2, 5])
    move(particles, way, 6)
    astray = off_m(particles, way[6]) > 0.5
    assert np.flatnonzero(astray).tolist() == [0, 2, 5]
    assert particles.weights[astray].max() < 0.1 * particles.weights[~astray].min()
    before = particles.weights[astray].sum()
    move(particles, way, 7)  # weights are a product over all keyframes
    assert particles.weights[astray].sum() < 0.1 * before


@pytest.mark.parametrize("empty", [0, 3])
def test_every_particle_is_matched_to_its_own_map(empty: int) -> None:
    particles, way = begun()
    particles.store.clear(empty)
    move(particles, way, 6)
    others = np.delete(particles.weights, empty)
    assert particles.weights[empty] < 0.1 * others.min()


def test_where_few_particles_matter_they_are_resampled() -> None:
    particles, way = begun(replace(CONFIG, neff_fraction=0.6))
    assert particles.resamplings == 0
    lead_astray(particles, [0, 1, 2, 4, 5])
    move(particles, way, 6)
    assert particles.resamplings == 1 and particles.neff < 0.6 * 6
    assert off_m(particles, way[6]).max() < 0.2
    assert not particles.log_weights.any()
    assert len({pose.tobytes() for pose in particles.ancestry.apart[:, -1]}) == 1  # children of one


def test_maps_and_trajectories_follow_their_particles() -> None:
    particles, way = begun(replace(CONFIG, neff_fraction=1.0), keys=1)  # resampled at every keyframe
    for k in range(1, 12):
        if k % 3 == 1:
            lead_astray(particles, [k % 6])
        move(particles, way, k)
    assert particles.resamplings > 3
    trajectories = [particles.ancestry.of(i) for i in range(6)]
    assert len({one.tobytes() for one in trajectories}) > 1
    for i, trajectory in enumerate(trajectories):
        drawn = TileStore(1, CONFIG.resolution_m)
        drawn.cover(np.full(2, -60.0), np.full(2, 60.0))
        for k in range(12):
            beams = keyframe(np.zeros(3), way[k], np.random.default_rng(k)).beams
            drawn.draw(0, beams.origin[None], trajectory[k : k + 1], [beams.points], 0.1)
        assert content(particles.store, i) == content(drawn, 0) != {}


def content(store: TileStore, index: int) -> dict[tuple[int, int], bytes]:
    """The tiles of a map, by place, but for empty ones."""
    tiles = store.tiles(index)
    held = {
        (int(r) + tiles.row0, int(c) + tiles.col0): tiles.pool[tiles.table[r, c]] for r, c in np.argwhere(tiles.table)
    }
    return {place: cells.tobytes() for place, cells in held.items() if cells.any()}


@pytest.mark.parametrize("best", [0, 3, 5])
def test_the_heir_of_the_best_particle_is_the_best(best: int) -> None:
    particles, _ = begun()
    particles.best = best
    trajectory, tiles = particles.trajectory, content(particles.store, best)
    particles.log_weights[:] = 0.1 * np.arange(6)  # all of them live on
    assert not any(np.array_equal(trajectory, particles.ancestry.of(i)) for i in range(6) if i != best)
    particles.resize(7)
    assert np.array_equal(particles.trajectory, trajectory)
    assert content(particles.store, particles.best) == tiles


def test_a_best_particle_that_dies_is_succeeded_by_the_heaviest() -> None:
    particles, way = begun(replace(CONFIG, neff_fraction=0.9))
    particles.best = 2
    particles.log_weights[:] = [-9.0, -9.0, -1.9, -9.0, 0.0, -9.0]
    chosen = particles.trajectory
    move(particles, way, 6)
    assert particles.resamplings == 1
    heir = particles.trajectory[:-1]
    assert np.array_equal(heir, chosen) or off_m(particles, way[6])[particles.best] < 0.05


def test_the_best_particle_changes_where_another_is_far_better_only() -> None:
    particles, way = begun()
    particles.best = 4
    particles.log_weights[:] = 0.0
    particles.log_weights[4] = -0.5 * BEST_SWITCH_LOG_WEIGHT
    move(particles, way, 6)
    assert particles.best == 4
    lead_astray(particles, [4])
    move(particles, way, 7)
    assert particles.best != 4
    assert off_m(particles, way[7])[particles.best] < 0.1
    assert particles.log_weights[particles.best] == 0.0


def test_straight_walls_turn_particles_back() -> None:
    """Where the map says nothing of the heading, the directions of walls do."""
    off = np.radians(0.8)
    headings = []
    for use_walls in (True, False):
        particles, way = begun(replace(CONFIG, use_walls=use_walls), keys=1)
        particles.ends[:, 2] += off
        for i in range(6):
            particles.store.clear(i)
        key = keyframe(np.zeros(3), way[0], np.random.default_rng(9))
        key.arrival[3] = 20.0  # so much way that the map may have turned
        particles.move(key)
        headings.append(particles.ends[:, 2].copy())
    with_walls, without = headings
    assert np.abs(with_walls).max() < 0.8 * np.abs(without).min()
    assert np.ptp(with_walls - without) < 1e-9  # all by the same angle
