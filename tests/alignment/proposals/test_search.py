"""What the exhaustive search hands to its parts, and what it makes of their proposals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from mrslam.alignment import AlignmentConfig, Candidate, Prior
from mrslam.alignment.prepared import PreparedMap, prepare
from mrslam.alignment.proposals import search
from mrslam.spatial import OccupancyGrid, se2


def asked(monkeypatch: pytest.MonkeyPatch, a: PreparedMap, b: PreparedMap, prior: Prior | None) -> dict[str, Any]:
    """Return what the correlation is asked for."""
    calls: list[dict[str, Any]] = []

    def correlate(a: Any, b: Any, angles: list[float], cell_m: float, **others: Any) -> list[Candidate]:
        calls.append({"angles": angles, "cell_m": cell_m, **others})
        return []

    monkeypatch.setattr(search, "correlate", correlate)
    assert search.exhaustive(a, b, AlignmentConfig(), prior) == []
    return calls[0]


def hall(edge_m: float, cell_m: float) -> PreparedMap:
    n = round(edge_m / cell_m)
    cells = np.zeros((n, n), np.int8)
    cells[[0, -1]], cells[:, [0, -1]] = 100, 100
    return prepare(OccupancyGrid(cells, cell_m), cell_m)


@pytest.mark.parametrize(("edge_m", "cell_m", "asked_m"), [(10.0, 0.05, 0.2), (20.0, 0.2, 0.4), (400.0, 0.2, None)])
def test_the_correlations_cell_bounds_its_picture(
    monkeypatch: pytest.MonkeyPatch, edge_m: float, cell_m: float, asked_m: float | None
) -> None:
    one = hall(edge_m, cell_m)
    found = asked(monkeypatch, one, one, None)["cell_m"]
    across_m = edge_m * (1.0 + math.sqrt(2.0))  # one map, and the other turned, to either side of it
    assert found == pytest.approx(across_m / search.MOST_CELLS if asked_m is None else asked_m, rel=0.01)


def test_each_turn_that_walls_suggest_is_tried_with_a_degree_to_either_side(
    monkeypatch: pytest.MonkeyPatch, sides: tuple[PreparedMap, PreparedMap]
) -> None:
    angles = np.degrees(asked(monkeypatch, *sides, None)["angles"]).reshape(-1, 3)
    np.testing.assert_allclose(np.diff(angles, axis=1), 1.0)


@pytest.mark.parametrize("sigma_deg", [1.0, 10.0, 40.0, 180.0])
def test_of_a_vague_direction_only_the_turns_that_walls_suggest_are_tried(
    monkeypatch: pytest.MonkeyPatch,
    sides: tuple[PreparedMap, PreparedMap],
    pair: tuple[OccupancyGrid, OccupancyGrid, se2.Transform],
    sigma_deg: float,
) -> None:
    prior = Prior(pair[2], np.diag([2.0, 2.0, math.radians(sigma_deg)]) ** 2)  # too many places for a lattice
    angles = np.array(asked(monkeypatch, *sides, prior)["angles"])
    off_deg = np.degrees(np.abs([math.remainder(angle - pair[2][2], math.pi) for angle in angles]))
    assert len(angles) <= 40 and off_deg.min() <= 0.5
    if sigma_deg == 1.0:
        assert off_deg.max() > 3.0


def test_of_proposals_next_to_each_other_the_best_is_kept(sides: tuple[PreparedMap, PreparedMap]) -> None:
    b = sides[1]

    def place(x: float, y: float, turn: float) -> Candidate:
        """Lay the middle of b at (x, y)."""
        back = se2.apply(np.array([0.0, 0.0, turn]), b.centre)
        return Candidate(se2.transform(x - back[0], y - back[1], turn))

    first, near, turned = place(1.0, 2.0, 3.14), place(1.2, 1.8, -3.14), place(1.0, 2.0, 3.0)
    beside, far = place(1.0, 2.4, 3.14), place(9.0, 2.0, 0.0)
    assert search.distinct(b, [first, near, turned, beside, far], 9) == [first, turned, beside, far]
    assert search.distinct(b, [first, near, turned, beside, far], 2) == [first, turned]
    assert search.distinct(b, [], 9) == []


def test_settled_proposals_are_ranked_by_how_well_walls_agree(
    sides: tuple[PreparedMap, PreparedMap], pair: tuple[OccupancyGrid, OccupancyGrid, se2.Transform]
) -> None:
    a, b = sides
    wrong, right = (
        Candidate(pair[2] + np.array([x, 0.1, 0.0]), 1.0 + x, {"correlation_m": 1.0 + x}) for x in (3.0, 0.1)
    )
    found = search.settle(a, b, [wrong, right], AlignmentConfig())
    assert found[0].score > 2.0 * found[1].score
    assert [one.evidence["correlation_m"] for one in found] == [1.1, 4.0]
    assert np.hypot(*(se2.apply(found[0].T_a_b, b.centre) - se2.apply(pair[2], b.centre))) < 0.05
