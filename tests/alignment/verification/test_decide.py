"""What becomes of candidates: which rival forbids which answer."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.alignment import Alignment, AlignmentConfig, Candidate, Rejection
from mrslam.alignment.prepared import PreparedMap, prepare
from mrslam.alignment.verification.decide import decide
from mrslam.spatial import OccupancyGrid, se2

APART_M = 7.0
"""From a room to another like it."""


@pytest.fixture(scope="module")
def rooms() -> tuple[PreparedMap, PreparedMap]:
    """Two equal rooms, and one of them."""
    room = np.zeros((90, 110), dtype=np.int8)
    room[0], room[-1], room[:, 0], room[:, -1], room[20:32, 30:60], room[60:63, 10:40] = (100,) * 6
    gap = np.full((90, 30), -1, dtype=np.int8)
    gap[40:52] = 0
    both = OccupancyGrid(np.concatenate([room, gap, room], axis=1), 0.05)
    return prepare(both, 0.05), prepare(OccupancyGrid(room, 0.05), 0.05)


@pytest.mark.parametrize(
    ("proposed_m", "rivals_m"), [((0.0, APART_M), (0.0,)), ((0.0, APART_M), None), ((0.0,), (0.0, APART_M))]
)
def test_another_place_that_fits_forbids_an_answer_whoever_proposed_it(
    rooms: tuple[PreparedMap, PreparedMap], proposed_m: tuple[float, ...], rivals_m: tuple[float, ...] | None
) -> None:
    def at(places_m: tuple[float, ...]) -> list[Candidate]:
        return [Candidate(se2.transform(x_m, 0.0, 0.0)) for x_m in places_m]

    config = AlignmentConfig(strain=0.0)
    found = decide(*rooms, at(proposed_m), "orb", config, None if rivals_m is None else lambda: at(rivals_m))
    assert isinstance(found, Rejection) and found.ambiguous and "ambiguous" in found.reason
    places_m = sorted(T[0] for T in (found.T_a_b, *found.rivals) if T is not None)
    assert places_m == pytest.approx([0.0, APART_M], abs=0.05)
    assert isinstance(decide(*rooms, at((0.0,)), "orb", config, lambda: at((0.0,))), Alignment)


def test_a_place_farther_along_a_corridor_is_a_rival_that_nobody_needs_to_propose() -> None:
    cells = np.full((46, 612), -1, dtype=np.int8)
    corridor = cells[3:43, 6:606]
    corridor[:] = 0
    corridor[[0, -1]] = corridor[:, [0, -1]] = 100  # 30 m long, and 2 m across at either end
    whole = prepare(OccupancyGrid(cells, 0.05), 0.05)
    found = decide(whole, whole, [Candidate(np.zeros(3))], "orb", AlignmentConfig(strain=0.0))
    assert isinstance(found, Rejection) and found.reason.startswith("ambiguous") and found.evidence is not None
    assert found.evidence.crosswise_m > 2.0 and 0.0 < found.evidence.margin < 0.4
