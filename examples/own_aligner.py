"""Add a way to align maps: python examples/own_aligner.py A.yaml B.yaml.

An aligner only proposes. Its candidates are refined and judged like those of the built-in ones, so a bad idea finds
nothing instead of merging wrongly. Robots use it with ``agent.align_method = "compass"``.
"""

import sys
from pathlib import Path

import numpy as np

from mrslam.alignment import ALIGNERS, Candidate, align
from mrslam.spatial import read_map, se2

CELL_M, BEST = 0.2, 50


def compass(a, b, config, prior):
    """Propose shifts alone, for robots with a compass: those that lay the most walls on walls, by correlation."""
    low = np.minimum(a.points.min(axis=0), b.points.min(axis=0))
    cells = [np.floor((side.points - low) / CELL_M).astype(int) for side in (a, b)]
    size = 2 * (1 + np.maximum(cells[0].max(axis=0), cells[1].max(axis=0)))
    images = np.zeros((2, *size))
    for image, cell in zip(images, cells, strict=True):
        image[tuple(cell.T)] = 1.0
    spectra = np.fft.rfft2(images)
    votes = np.fft.irfft2(spectra[0] * np.conj(spectra[1]), s=tuple(size))
    best = np.argsort(-votes, axis=None, kind="stable")[:BEST]
    shifts = np.stack(np.unravel_index(best, votes.shape), axis=-1)
    shifts = np.where(shifts > size // 2, shifts - size, shifts) * CELL_M
    return [Candidate(se2.transform(x, y, 0.0), float(votes.flat[i])) for (x, y), i in zip(shifts, best, strict=True)]


ALIGNERS["compass"] = compass
outcome = align(*(read_map(Path(name)) for name in sys.argv[1:3]), method="compass")
print(f"T_a_b = {np.round(outcome.T_a_b, 3)}" if outcome.accepted else f"not merged: {outcome.reason}")
