"""Places of a building that looks nearly the same turned by half: told apart by what stands in one half."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.alignment import Alignment, AlignmentConfig, Rejection, align
from mrslam.alignment.verification import apart
from mrslam.alignment.verification.apart import told_apart
from mrslam.spatial import OccupancyGrid

CONFIG = AlignmentConfig(strain=0.0)


def hall(*boxes: tuple[float, float, float, float]) -> OccupancyGrid:
    """Return a hall of 12 m by 6 m, the same turned by half, in which boxes (x, y, width, depth; metres) stand."""
    cells = np.full((140, 260), -1, dtype=np.int8)
    cells[9:131, 9:251] = 100
    cells[10:130, 10:250] = 0
    for rows, cols in ((slice(10, 50), slice(90, 92)), (slice(90, 130), slice(168, 170))):  # two partitions
        cells[rows, cols] = 100
    for x, y, width, depth in boxes:
        r, c, rows, cols = (round(v / 0.05) for v in (y, x, depth, width))
        cells[10 + r : 10 + r + rows, 10 + c : 10 + c + cols] = 100
    return OccupancyGrid(cells, 0.05)


CUPBOARD, TABLE = (1.0, 1.5, 1.6, 0.8), (8.0, 2.0, 0.6, 0.6)


def asked(a: OccupancyGrid, b: OccupancyGrid) -> tuple[Rejection, Alignment | None]:
    """Return the ambiguous answer of the alignment, and what is made of it."""
    outcome = align(a, b, config=CONFIG)
    assert isinstance(outcome, Rejection) and len(outcome.rivals) == 1, outcome
    return outcome, told_apart(a, b, outcome, CONFIG)


def test_what_stands_in_one_half_tells_the_halves_apart() -> None:
    outcome, found = asked(hall(CUPBOARD), hall(CUPBOARD))
    assert "ambiguous" in outcome.reason
    assert found is not None and found.T_a_b == pytest.approx(np.zeros(3), abs=0.03)
    assert found.confidence == apart.CONFIDENCE and found.evidence.margin < CONFIG.min_margin
    assert found.covariance.shape == (3, 3) and found.covariance[0, 0] < 0.01


def test_halves_that_look_the_same_are_not_told_apart() -> None:
    assert asked(hall(), hall())[1] is None


def test_where_something_has_moved_nothing_is_told_apart() -> None:
    assert asked(hall(CUPBOARD), hall(CUPBOARD, TABLE))[1] is None


def half(grid: OccupancyGrid, columns: slice) -> OccupancyGrid:
    """Return a map of which these columns are not known."""
    cells = grid.cells.copy()
    cells[:, columns] = -1
    return OccupancyGrid(cells, 0.05)


@pytest.mark.parametrize(
    ("saved", "what"),
    [
        (half(hall(), slice(0, 110)), "wall that is not known at the other place"),
        (hall(CUPBOARD), "what contradicts at the other place, where as much wall agrees"),
    ],
)
def test_one_of_the_two_tells_nothing_apart(saved: OccupancyGrid, what: str) -> None:
    seen, turned = half(hall(), slice(0, 130)), np.array([13.0, 7.0, np.pi])
    alike = Rejection("ambiguous", 0.3, None, "auto", np.zeros(3), rivals=(turned,))
    assert told_apart(saved, seen, alike, CONFIG) is None, what


def test_a_small_thing_tells_nothing_apart() -> None:
    assert asked(hall((1.0, 1.5, 0.4, 0.4)), hall((1.0, 1.5, 0.4, 0.4)))[1] is None


def test_among_as_many_places_as_are_named_there_may_be_more() -> None:
    outcome, found = asked(hall(CUPBOARD), hall(CUPBOARD))
    many = replace(outcome, rivals=outcome.rivals * apart.MOST_RIVALS)
    assert found is not None and told_apart(hall(CUPBOARD), hall(CUPBOARD), many, CONFIG) is None
    assert told_apart(hall(CUPBOARD), hall(CUPBOARD), replace(outcome, rivals=()), CONFIG) is None


def test_a_place_that_can_slide_along_its_walls_is_not_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    outcome, found = asked(hall(CUPBOARD), hall(CUPBOARD))
    monkeypatch.setattr(apart, "margin_over", lambda *_: 0.5)
    assert found is not None and told_apart(hall(CUPBOARD), hall(CUPBOARD), outcome, CONFIG) is None
