"""Levels of a published map."""

from __future__ import annotations

import numpy as np

from mrslam.rbpf.filter.publisher import EDGES, LEVELS, quantise


def test_levels_have_hysteresis() -> None:
    out = np.full((32, 32), -1, dtype=np.int8)
    words = np.zeros(1024, dtype=np.uint32)
    assert not quantise(words, EDGES, 0.3, LEVELS, out)
    words[0] = 3 | (10 << 5)
    assert quantise(words, EDGES, 0.3, LEVELS, out) and out[0, 0] == 75
    words[0] = 5 | (22 << 5)  # 0.227: below the edge of 0.25, but not by enough
    assert not quantise(words, EDGES, 0.3, LEVELS, out)
    words[0] = 2 | (22 << 5)
    assert quantise(words, EDGES, 0.3, LEVELS, out) and out[0, 0] < 65
