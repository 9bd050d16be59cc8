"""Loops of the correlation against slow twins."""

from __future__ import annotations

import numpy as np

from mrslam.alignment.kernels import correlation as correlate_kernels


def test_products_of_spectra_like_their_twin():
    rng = np.random.default_rng(5)
    one, two = ((rng.normal(size=(5, 6, 4)) + 1j * rng.normal(size=(5, 6, 4))).astype(np.complex64) for _ in range(2))
    out = np.empty((2, 6, 4), dtype=np.complex64)
    correlate_kernels.multiply(one, two, out)
    np.testing.assert_allclose(out[0], (one * two.conj()).sum(axis=0), rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(out[1], (one * two[[2, 3, 0, 1, 4]]).sum(axis=0), rtol=1e-4, atol=1e-4)


def test_peaks_like_sorting():
    score = np.random.default_rng(0).normal(0, 1, (40, 50)).astype(np.float32)
    where, value = correlate_kernels.peaks(score, 5, 2)
    assert (np.diff(value) <= 0).all()
    assert value[0] == score.max()
    assert tuple(where[0]) == np.unravel_index(int(score.argmax()), score.shape)
    for i in range(5):
        for j in range(i):
            gap = np.abs(where[i] - where[j])
            assert np.minimum(gap, np.array(score.shape) - gap).max() > 2
