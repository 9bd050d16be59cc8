"""Scans drawn into maps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.spatial import se2
from mrslam.spatial.hits.cells import TILE, hits_of, visits_of
from mrslam.spatial.hits.drawing import Touched, insert_scan, mark_tiles
from mrslam.spatial.hits.store import TileStore
from mrslam.spatial.hits.views import Beams
from tests.rbpf.rooms import seen_room, word_at


def test_beams_clear_what_a_slow_walk_along_them_passes() -> None:
    store, points = seen_room()
    res = store.resolution_m
    hit_cells = {(math.floor(y / res), math.floor(x / res)) for x, y in points[:, :2]}
    assert all(hits_of(np.int64(word_at(store, *cell))) > 0 for cell in hit_cells)
    for x, y in points[::7, :2]:
        length = math.hypot(x, y)
        for t in np.arange(0.02, length - 0.2, 0.02):
            cell = math.floor(y * t / length / res), math.floor(x * t / length / res)
            # The slow walk may cut a corner that the exact one takes on the other side.
            assert visits_of(np.int64(word_at(store, *cell))) > 0
    outside = [(row, col) for row in (-200, 200) for col in (-200, 250)]
    assert all(word_at(store, *cell) == 0 for cell in outside)


RES = 0.05
POSE = np.array([0.4, -0.3, 2.1])


def one_beam() -> Beams:
    """Return a laser ahead of the base and one beam of four metres that hits a wall, seen at a slant."""
    return Beams(np.array([0.2, 0.0]), np.array([[4.2, 0.0, -0.8, 0.6, 1.0]]), np.empty((0, 2)))


def covered(maps: int = 1) -> TileStore:
    store = TileStore(maps, RES)
    store.cover(np.full(2, -8.0), np.full(2, 8.0))
    return store


def test_a_hit_has_its_place_and_its_normal_in_the_maps_frame() -> None:
    beams, store = one_beam(), covered()
    store.draw(0, beams.origin[None], POSE[None], [beams.points], 0.0)
    x, y = se2.apply(POSE, beams.points[0, :2]) / RES
    word = word_at(store, math.floor(y), math.floor(x))
    place = np.array([(word >> 11) & 0x3F, (word >> 17) & 0x3F]) / 64.0
    np.testing.assert_allclose(place, [x % 1.0, y % 1.0], atol=1 / 64)
    angle = 2.0 * math.pi * ((word >> 23) & 0xFF) / 256.0
    facing = POSE[2] + math.atan2(0.6, -0.8)
    assert word >> 31 == 1 and math.cos(angle - facing) > 0.999


def test_a_beam_shorter_than_what_it_leaves_before_a_wall_clears_nothing() -> None:
    store, origin = covered(), np.array([0.2, 0.0])
    points = np.array([[0.32, 0.0, -1.0, 0.0, 1.0]])
    store.draw(0, origin[None], np.zeros((1, 3)), [points], 0.4)
    seen = [col for col in range(-20, 20) if visits_of(np.int64(word_at(store, 0, col))) > 0]
    assert seen == [math.floor(0.32 / RES)]  # what it hit, and not what lies behind the laser


@pytest.mark.parametrize("skip_m", [0.0, 0.3])
def test_beams_clear_up_to_a_little_before_what_they_hit(skip_m: float) -> None:
    beams, store = one_beam(), covered()
    store.draw(0, beams.origin[None], POSE[None], [beams.points], skip_m)

    def visits(along_m: float) -> int:
        x, y = se2.apply(POSE, np.array([0.2 + along_m, 0.0])) / RES
        return int(visits_of(np.int64(word_at(store, math.floor(y), math.floor(x)))))

    assert visits(0.1) == 1 and visits(4.0 - skip_m - 0.1) == 1
    assert visits(4.0 - 0.12) == (skip_m == 0.0)


def test_tiles_that_other_maps_hold_as_well_are_left_alone() -> None:
    beams, store = one_beam(), covered(2)
    store.draw(0, beams.origin[None], POSE[None], [beams.points], 0.0)
    store.resample(np.zeros(2, dtype=np.int64))
    before = store.pool.copy()
    insert_scan(store.tiles(1), store.refs, beams, POSE, 0.0)
    np.testing.assert_array_equal(store.pool, before)
    store.resample(np.array([1], dtype=np.int64))
    insert_scan(store.tiles(0), store.refs, beams, POSE, 0.0)
    assert (store.pool != before).any()


@pytest.mark.parametrize("through", [True, False])
def test_each_tile_that_a_scan_touches_is_listed_once(through: bool) -> None:
    rng, store = np.random.default_rng(5), covered()
    points = np.zeros((40, 5))
    points[:, :2] = rng.uniform(-4.0, 4.0, (40, 2))
    beams = Beams(np.array([0.2, 0.0]), points, rng.uniform(-5.0, 5.0, (5, 2)))
    tiles = store.tiles(0)
    room = tiles.table.size
    touched = Touched(np.zeros_like(tiles.table), np.empty(room, dtype=np.int32), np.empty(room, dtype=np.int32))
    origin, ends = se2.apply(POSE, beams.origin), se2.apply(POSE, np.concatenate([points[:, :2], beams.ends]))
    for number in (1, 2):  # what was listed before is listed again under a new number
        count = mark_tiles(touched, number, tiles, beams, POSE, through)
        listed = list(zip(touched.rows[:count].tolist(), touched.cols[:count].tolist(), strict=True))
        ways = np.linspace(0.0 if through else 1.0, 1.0, 2000)[:, None, None]
        places = np.floor((origin + ways * (ends - origin)) / (RES * TILE)).astype(int)
        walked = {(int(row) - tiles.row0, int(col) - tiles.col0) for col, row in places.reshape(-1, 2)}
        assert len(set(listed)) == len(listed) and walked <= set(listed)
        assert len(set(listed) - walked) <= (2 if through else 0)  # the slow walk may step over a corner
