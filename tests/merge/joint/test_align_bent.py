"""Maps that fit nowhere rigidly are bent by their scans and looked at again: they must fit where they were tied."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from mrslam.alignment import Alignment, AlignmentConfig, Rejection
from mrslam.merge import LocalMatcher
from mrslam.merge.joint.align_bent import Scanned, align_bent
from mrslam.spatial import OccupancyGrid, se2
from tests.merge.joint.blocks import drawn, drive
from tests.merge.plans import building

A, B = drive(0.0, 70.0, 0.001, seed=1), drive(30.0, 80.0, -0.001, seed=2)
T_A_B = se2.between(A.truth[0], B.truth[0])
ONE, TWO = (Scanned(drawn(one.trail, len(one.trail)), one.trail) for one in (A, B))
BENDABLE = Rejection("walls lie where the other map is free", 0.1, None, "auto", T_A_B, may_bend=True)


def bent(two: Scanned = TWO, rejected: Rejection = BENDABLE) -> Alignment | Rejection:
    return align_bent(ONE, two, rejected, "auto", AlignmentConfig(), LocalMatcher())


def test_maps_that_fit_once_bent_are_aligned_where_the_joint_solution_starts() -> None:
    outcome = bent()
    assert isinstance(outcome, Alignment) and np.array_equal(outcome.T_a_b, T_A_B)


def test_what_is_not_to_be_bent_is_left_as_it_is() -> None:
    firm = Rejection("too little in common", 0.1, None, "auto", T_A_B)
    assert bent(rejected=firm) is firm


def test_two_places_in_common_are_too_few_to_bend_by() -> None:
    short = drive(30.0, 5.0, -0.001, seed=2)
    assert bent(Scanned(TWO.grid, short.trail)) is BENDABLE


@pytest.mark.parametrize("grid", [building(3), OccupancyGrid(np.zeros((400, 400), dtype=np.int8), 0.05)])
def test_bent_maps_that_fit_nowhere_are_refused_and_why(grid: OccupancyGrid) -> None:
    outcome = bent(Scanned(grid, B.trail))
    assert isinstance(outcome, Rejection)
    assert outcome.reason.startswith(f"{BENDABLE.reason}; bent to fit: ")


def test_bent_maps_that_fit_elsewhere_than_their_scans_are_refused() -> None:
    moved = OccupancyGrid(TWO.grid.cells, TWO.grid.resolution_m, tuple(np.add(TWO.grid.origin_m, (3.0, 0.0))))
    outcome = bent(Scanned(moved, B.trail))
    assert isinstance(outcome, Rejection)
    assert outcome.reason == f"{BENDABLE.reason}; bent to fit, they fit 3.0 m elsewhere"


def cleared(share: float) -> Scanned:
    """Return the second robot's map with open floor in place of its walls, along so large a share of its columns."""
    cells = TWO.grid.cells.copy()
    gone = np.random.default_rng(3).permutation(cells.shape[1] // 20) < share * (cells.shape[1] // 20)
    columns = np.resize(np.repeat(gone, 20), cells.shape[1])
    behind = cv2.dilate(np.uint8(cells == 100), np.ones((17, 17), dtype=np.uint8)) > 0
    cells[behind & columns] = 0
    return Scanned(OccupancyGrid(cells, TWO.grid.resolution_m, TWO.grid.origin_m), TWO.trail)


def test_of_maps_that_fit_in_parts_less_must_contradict_than_agrees() -> None:
    in_parts = replace(BENDABLE, is_in_parts=True)
    for share, fits_whole, fits_in_parts in ((0.0, True, True), (0.3, False, True), (0.44, False, False)):
        assert isinstance(bent(cleared(share)), Alignment) == fits_whole, share
        found = bent(cleared(share), in_parts)
        assert isinstance(found, Alignment) == fits_in_parts, share
        assert isinstance(found, Rejection) or found.is_in_parts
