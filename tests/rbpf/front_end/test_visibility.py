"""What one scan says of another where a laser's beams are far apart."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.rbpf.front_end.elsewhere import TORN
from mrslam.rbpf.front_end.visibility import contradicted

NICHE_DEG = 12.0
STILL, ORIGIN = np.zeros(3), np.zeros(2)


def scan(beams_deg: float, first_deg: float, *, nearer: float = 1.0) -> NDArray[np.float64]:
    """Points ``(N, 5)`` of a wall 5 m away all round, every other ``NICHE_DEG`` of it 3 m away."""
    bearings = np.arange(first_deg - 179.0, 179.0, beams_deg)
    ranges_m = nearer * np.where(np.floor(bearings / NICHE_DEG) % 2 == 0, 3.0, 5.0)
    points = np.zeros((bearings.size, 5))
    points[:, 0] = ranges_m * np.cos(np.radians(bearings))
    points[:, 1] = ranges_m * np.sin(np.radians(bearings))
    return points


@pytest.mark.parametrize("beams_deg", [1.0, 2.0, 3.0, 4.0, 6.0])
def test_beams_far_apart_bound_what_lies_between_them(beams_deg: float) -> None:
    one, other = scan(beams_deg, 0.0), scan(beams_deg, 0.45 * beams_deg)
    assert contradicted(one, other, STILL, ORIGIN) == contradicted(other, one, STILL, ORIGIN) == 0.0


@pytest.mark.parametrize("beams_deg", [1.0, 3.0, 6.0])
def test_a_scan_of_another_place_contradicts_however_far_apart_beams_are(beams_deg: float) -> None:
    one, other = scan(beams_deg, 0.0), scan(beams_deg, 0.45 * beams_deg, nearer=0.4)
    assert contradicted(one, other, STILL, ORIGIN) > TORN
    assert contradicted(other, one, STILL, ORIGIN) > TORN


def test_beams_where_a_laser_sees_nothing_bound_nothing() -> None:
    one, other = scan(3.0, 0.0), scan(3.0, 1.5, nearer=0.4)
    ahead = other[np.abs(np.arctan2(other[:, 1], other[:, 0])) < np.radians(30.0)]
    behind = one[one[:, 0] < 0.0]
    assert contradicted(behind, ahead, STILL, ORIGIN) == 0.0
