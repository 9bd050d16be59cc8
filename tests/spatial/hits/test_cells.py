"""Cells of the map."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.spatial.hits.cells import add_hit, add_pass, hits_of, visits_of


def test_cells_count_and_average() -> None:
    rng = np.random.default_rng(0)
    cell, xs, ys = 0, rng.uniform(0.2, 0.6, 25), rng.uniform(0.5, 0.9, 25)
    for x, y in zip(xs, ys, strict=True):
        cell = add_hit(np.int64(cell), x, y, 0.0, 1.0, 0.9)
    for _ in range(10):
        cell = add_pass(np.int64(cell))
    assert hits_of(np.int64(cell)) == 25 and visits_of(np.int64(cell)) == 35
    assert ((cell >> 11) & 0x3F) / 64 == pytest.approx(xs.mean(), abs=0.04)
    assert ((cell >> 17) & 0x3F) / 64 == pytest.approx(ys.mean(), abs=0.04)
    assert abs(((cell >> 23) & 0xFF) - 64) <= 1  # 90 degrees


@pytest.mark.parametrize(("times", "is_taken"), [(1, True), (2, False)])
def test_a_cell_of_a_thin_wall_holds_the_side_that_was_seen_more_than_once(times: int, is_taken: bool) -> None:
    cell = 0
    for _ in range(times):
        cell = add_hit(np.int64(cell), 0.25, 0.5, 0.0, 1.0, 0.9)
    cell = add_hit(np.int64(cell), 0.75, 0.5, 0.0, -1.0, 0.9)
    x, direction = (cell >> 11) & 0x3F, (cell >> 23) & 0xFF
    assert direction == (192 if is_taken else 64)
    assert x == pytest.approx(48 if is_taken else 16, abs=1)
    assert hits_of(np.int64(cell)) == times + 1


@pytest.mark.parametrize(
    ("toward_laser", "quality", "direction"), [((0.0, -1.0), 0.0, 192), ((0.0, -1.0), 0.1, 0), ((-0.0, 0.0), 0.0, 0)]
)
def test_a_cell_without_a_normal_knows_from_which_side_it_was_seen(
    toward_laser: tuple[float, float], quality: float, direction: int
) -> None:
    cell = add_hit(np.int64(0), 0.5, 0.5, *toward_laser, quality)
    assert ((cell >> 23) & 0xFF, cell >> 31) == (direction, 0)
    cell = add_hit(np.int64(cell), 0.5, 0.5, 0.0, 1.0, 0.9)
    assert ((cell >> 23) & 0xFF, cell >> 31) == (64, 1)


def test_counts_never_overflow_and_what_went_away_fades() -> None:
    cell = 0
    for _ in range(1000):
        cell = add_hit(np.int64(cell), 0.5, 0.5, 1.0, 0.0, 1.0)
        assert (
            0 < hits_of(np.int64(cell)) == visits_of(np.int64(cell)) < 64
        )  # a wall stays one however often it is seen
    for _ in range(300):
        cell = add_pass(np.int64(cell))
        assert visits_of(np.int64(cell)) < 64
    assert hits_of(np.int64(cell)) == 0
    assert 0 <= cell < 2**32
