"""Hough spectra against a slow twin."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.alignment import AlignmentConfig, acceptance_index
from mrslam.alignment.prepared import prepare
from mrslam.alignment.proposals.hough import hough, hough_spectrum
from mrslam.spatial import se2
from tests.alignment.conftest import House


def test_hough_spectrum_like_its_twin():
    points = np.random.default_rng(0).normal(0, 2, (50, 2))
    got = hough_spectrum(points, 24, 0.25)
    for k in range(24):
        rho = np.floor(points @ [math.cos(k * math.pi / 24), math.sin(k * math.pi / 24)] / 0.25)
        assert got[k] == (np.unique(rho, return_counts=True)[1] ** 2).sum()


def test_every_likely_turn_and_its_opposite_is_proposed_those_that_agree_most_first(house: House) -> None:
    whole = slice(0, 400), slice(0, 520)
    a = prepare(grid_a := house.part(*whole, np.zeros(3)), 0.05)
    for turn_deg in (20.0, 200.0):
        b = prepare(grid_b := house.part(*whole, se2.transform(1.0, 2.0, math.radians(turn_deg))), 0.05)
        found = hough(a, b, AlignmentConfig(), None)
        assert len(found) >= 8
        turns = np.degrees([one.T_a_b[2] for one in found])
        assert abs(math.remainder(turns[0] + turn_deg, 360.0)) < 0.5
        assert min(abs(math.remainder(turn + turn_deg + 180.0, 360.0)) for turn in turns) < 0.5
        scores = [one.score for one in found]
        assert scores == sorted(scores, reverse=True)
        assert scores[0] == pytest.approx(acceptance_index(grid_a, grid_b, found[0].T_a_b), abs=0.01)
