"""Levels of a published map, and which of its tiles are written again."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.rbpf.filter.publisher import EDGES, LEVELS, Publisher, quantise
from mrslam.spatial import TILE_CELLS
from mrslam.spatial.hits.store import TileStore


def test_levels_have_hysteresis() -> None:
    out = np.full((32, 32), -1, dtype=np.int8)
    words = np.zeros(1024, dtype=np.uint32)
    assert not quantise(words, EDGES, 0.3, LEVELS, out)
    words[0] = 3 | (10 << 5)
    assert quantise(words, EDGES, 0.3, LEVELS, out) and out[0, 0] == 75
    words[0] = 5 | (22 << 5)  # 0.227: below the edge of 0.25, but not by enough
    assert not quantise(words, EDGES, 0.3, LEVELS, out)
    words[0] = 2 | (22 << 5)
    assert quantise(words, EDGES, 0.3, LEVELS, out) and out[0, 0] < 65


def drawn(store: TileStore, at_m: tuple[float, float]) -> None:
    """Draw a wall of two metres north of a place, seen from there."""
    points = np.array([[x, 2.0, 0.0, -1.0, 1.0] for x in np.arange(-1.0, 1.0, 0.05)])
    place = np.array([*at_m, 0.0])
    store.cover(place[:2] - 4.0, place[:2] + 4.0)
    for _ in range(3):
        store.draw(0, np.zeros((1, 2)), place[None], [points], 0.0)


def test_only_tiles_that_changed_are_written_again_while_the_window_grows_in_any_direction(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    looked_at: list[object] = []
    monkeypatch.setattr(
        "mrslam.rbpf.filter.publisher.quantise", lambda words, *rest: looked_at.append(words) or quantise(words, *rest)
    )
    store, publisher = TileStore(1, 0.05), Publisher()
    edge_m = 0.05 * TILE_CELLS
    held: dict[tuple[int, int], int] = {}
    for at_m in ((0.0, 0.0), (40.0, 3.0), (-70.0, -50.0), (2.0, 90.0), (0.7, -0.6)):
        drawn(store, at_m)
        looked_at.clear()
        tiles = publisher.publish(store, 0, 1).tiles
        assert len(looked_at) <= 16  # pool tiles around what was drawn, however much there is by now
        changed = {index for index, tile in tiles.items() if held.get(index) != tile.revision}
        assert changed, f"nothing of {at_m} was published"
        for row, col in changed:
            assert abs((col + 0.5) * edge_m - at_m[0]) < 2 * edge_m
            assert abs((row + 0.5) * edge_m - at_m[1]) < 2 * edge_m
        assert held.keys() <= tiles.keys()
        held = {index: tile.revision for index, tile in tiles.items()}
    fresh = Publisher().publish(store, 0, 1)
    assert {index: tile.cells.tobytes() for index, tile in fresh.tiles.items()} == {
        index: tile.cells.tobytes() for index, tile in tiles.items()
    }


def test_the_stamps_saved_are_those_of_the_pool_tiles_one_by_one() -> None:
    for away in ((0.0, 0.0), (37.0, -58.3), (-81.7, 22.9)):  # windows that begin at even and odd tiles
        store, publisher = TileStore(1, 0.05), Publisher()
        drawn(store, (0.0, 0.0))
        drawn(store, away)
        publisher.publish(store, 0, 1)
        slow: dict[tuple[int, int], list[int]] = {}
        for r, c in zip(*np.nonzero(store.tables[0]), strict=True):
            row, col = int(r) + store.row0, int(c) + store.col0
            stamps = slow.setdefault((row // 2, col // 2), [0] * 4)
            stamps[row % 2 * 2 + col % 2] = int(store.stamps[store.tables[0, r, c]])
        seen = publisher.state()["seen"]
        assert {(row, col): stamps for row, col, *stamps in seen} == slow
        assert len(slow) >= 2


def test_a_publisher_that_was_saved_goes_on_as_it_would_have() -> None:
    store, publisher = TileStore(1, 0.05), Publisher()
    drawn(store, (-7.0, 11.0))
    publisher.publish(store, 0, 1)
    resumed = Publisher()
    resumed.restore(publisher.state())
    assert resumed.state() == publisher.state()
    before = resumed.publish(store, 0, 1)
    assert before.revision == publisher.revision
    drawn(store, (20.0, 11.0))
    one, two = publisher.publish(store, 0, 1), resumed.publish(store, 0, 1)
    assert one.revision == two.revision == before.revision + 1
    assert {i: (t.revision, t.cells.tobytes()) for i, t in one.tiles.items()} == {
        i: (t.revision, t.cells.tobytes()) for i, t in two.tiles.items()
    }


def test_new_keyframes_are_a_new_revision_though_no_wall_has_moved() -> None:
    store, publisher = TileStore(1, 0.05), Publisher()
    drawn(store, (-7.0, 11.0))
    assert [publisher.publish(store, 0, keyframes).revision for keyframes in (1, 1, 2, 2, 5)] == [1, 1, 2, 2, 3]
    resumed = Publisher()
    resumed.restore(publisher.state())
    assert resumed.publish(store, 0, 5).revision == 3
