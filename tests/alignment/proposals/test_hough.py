"""Hough spectra against a slow twin."""

from __future__ import annotations

import math

import numpy as np

from mrslam.alignment.proposals.hough import hough_spectrum


def test_hough_spectrum_like_its_twin():
    points = np.random.default_rng(0).normal(0, 2, (50, 2))
    got = hough_spectrum(points, 24, 0.25)
    for k in range(24):
        rho = np.floor(points @ [math.cos(k * math.pi / 24), math.sin(k * math.pi / 24)] / 0.25)
        assert got[k] == (np.unique(rho, return_counts=True)[1] ** 2).sum()
