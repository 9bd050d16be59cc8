"""The nearest surface against a slow, obvious twin."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.spatial.hits.store import TileStore
from mrslam.spatial.matching.nearest import nearest
from mrslam.spatial.matching.scan_points import POINT_COLUMNS
from tests.rbpf.rooms import seen_room, word_at


def facing_walls(
    store: TileStore, x: float, y: float, normal: np.ndarray, radius: int, has_normal: bool = False
) -> dict[tuple[int, int], float]:
    """Return the squared distances of the walls around a point that look the same way, by cell.

    Without a normal of the point's own, ``normal`` is the direction to the laser that saw it, or 0.
    """
    found = {}
    for row in range(math.floor(y) - radius, math.floor(y) + radius + 1):
        for col in range(math.floor(x) - radius, math.floor(x) + radius + 1):
            word = word_at(store, row, col)
            hits, visits = word & 0x1F, (word >> 5) & 0x3F
            direction = (word >> 23) & 0xFF
            angle, least = 2.0 * math.pi * direction / 256, 0.35 if has_normal and word >> 31 else 0.0
            is_told = word >> 31 or direction > 0
            looks_away = normal.any() and is_told and normal @ (math.cos(angle), math.sin(angle)) < least
            if hits and 5 * hits >= visits and not looks_away:
                mx, my = (((word >> 11) & 0x3F) + 0.5) / 64, (((word >> 17) & 0x3F) + 0.5) / 64
                found[row, col] = (col + mx - x) ** 2 + (row + my - y) ** 2
    return found


def test_nearest_is_the_nearest_or_within_half_a_cell() -> None:
    store, points = seen_room()
    rng = np.random.default_rng(4)
    found = 0
    for x, y in points[rng.integers(0, len(points), 200), :2] / store.resolution_m + rng.normal(0, 1.0, (200, 2)):
        for radius in (1, 2, 3):
            word, _, _, d2, _ = nearest(store.tiles(0), x, y, 0.0, 0.0, 0.0, radius)
            truth = min(facing_walls(store, x, y, np.zeros(2), radius).values(), default=math.inf)
            assert (word == 0) == math.isinf(truth)
            if word != 0:
                found += 1
                assert d2 == pytest.approx(truth) or truth <= d2 < 0.25
    assert found > 200


def random_store(rng: np.random.Generator) -> TileStore:
    """Return a map of 5 x 5 tiles about the origin with any words in its cells, half of them empty."""
    store = TileStore(1, 0.05)
    corners = np.zeros((25, POINT_COLUMNS))
    corners[:, :2] = [(1.6 * col + 0.8, 1.6 * row + 0.8) for row in range(-2, 3) for col in range(-2, 3)]
    store.add_points(0, np.zeros(3), corners)
    tiles = store.tiles(0)
    for tile in np.unique(tiles.table[tiles.table != 0]):
        visits = rng.integers(1, 62, 1024)
        hits = np.minimum(rng.integers(0, 31, 1024), visits)
        rest = rng.integers(0, 2**21, 1024)  # mean point, direction, whether there is a normal
        words = hits | (visits << 5) | (rest << 11)
        tiles.pool[tile] = np.where(rng.random(1024) < 0.5, 0, words).astype(np.uint32)
    return store


@pytest.mark.parametrize(("has_normal", "has_side"), [(True, True), (False, True), (False, False)])
@pytest.mark.parametrize("radius", [1, 3])
def test_any_words_are_understood_as_the_twin_does(has_normal: bool, has_side: bool, radius: int) -> None:
    rng = np.random.default_rng(7)
    store = random_store(rng)
    away = 0
    for x, y in rng.uniform(-40, 40, (1500, 2)):
        angle = rng.uniform(-math.pi, math.pi)
        normal = np.array([math.cos(angle), math.sin(angle)]) * has_side
        surface = nearest(store.tiles(0), x, y, *normal, float(has_normal), radius)
        walls = facing_walls(store, x, y, normal, radius, has_normal)
        own = walls.get((math.floor(y), math.floor(x)), math.inf)
        expected = own if own < 0.25 else min(walls.values(), default=math.inf)
        if surface.word == 0:
            away += 1
            assert not walls and surface.visits == (word_at(store, math.floor(y), math.floor(x)) >> 5) & 0x3F
        else:
            assert surface.distance2 == pytest.approx(expected)
            assert surface.dx**2 + surface.dy**2 == pytest.approx(expected)
    assert (away > 0) == (radius == 1)
