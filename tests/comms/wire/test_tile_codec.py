from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.tile_codec import compress, decompress, max_packed, pack_tiles, unknown_tile, unpack_tiles

seeds = st.integers(0, 2**16)


def tiles(seed: int, count: int, values: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    palette = rng.choice(np.arange(-1, 101, dtype=np.int8), size=values, replace=False)
    return rng.choice(palette, size=(count, 64, 64))


@given(seed=seeds, count=st.integers(1, 5), values=st.integers(1, 102), old_values=st.integers(1, 102))
@settings(max_examples=60, deadline=None)
def test_tiles_come_back(seed, count, values, old_values):
    cells, base = tiles(seed, count, values), tiles(seed + 1, count, old_values)
    raw = pack_tiles(cells, base)
    assert np.array_equal(unpack_tiles(raw, base), cells)
    assert len(raw) <= max_packed(count, 0)


def test_noise_is_sent_as_bit_planes():
    cells = np.random.default_rng(1).integers(-1, 63, size=(1, 64, 64), dtype=np.int8)
    raw = pack_tiles(cells, unknown_tile()[None])
    assert raw[0] == 128 + 64
    assert len(raw) == 1 + 64 + 6 * 4096 // 8
    assert np.array_equal(unpack_tiles(raw, unknown_tile()[None]), cells)


def test_a_few_changed_cells_cost_a_few_bytes():
    base = np.zeros((30, 64, 64), dtype=np.int8)
    cells = base.copy()
    cells[4, 10, 10:20] = 100
    assert len(pack_tiles(cells, base)) < 40


@given(seed=seeds, cut=st.integers(0, 400), planes=st.booleans())
@settings(max_examples=80, deadline=None)
def test_cut_off_or_lengthened_tiles_are_refused(seed, cut, planes):
    cells = tiles(seed, 1, 63 if planes else 3)
    base = unknown_tile()[None]
    raw = pack_tiles(cells, base)
    assert (raw[0] >= 128) == planes
    for wrong in (raw[: min(cut, len(raw) - 1)], raw + b"\0" * (1 + cut)):
        with pytest.raises(WireError):
            unpack_tiles(wrong, base)


@pytest.mark.parametrize("palette", [[], [1, 2], [0, 5, 5], [0, 9, 3], [0, 102]])
def test_bad_palettes_are_refused(palette):
    with pytest.raises(WireError, match="palette"):
        unpack_tiles(bytes([len(palette), *palette]) + b"\0" * 50, unknown_tile()[None])


def test_a_value_outside_the_palette_is_refused():
    planes = bytes([128 + 3, 0, 1, 50]) + b"\xff" * 1024  # two bits a cell, every index 3
    with pytest.raises(WireError, match="outside"):
        unpack_tiles(planes, unknown_tile()[None])


def test_decompression_is_bounded_before_it_begins():
    packed = compress(b"\0" * 1_000_000)
    assert len(packed) < 5000
    with pytest.raises(WireError, match="oversized"):
        decompress(packed, 1_000_000, 4096)
    with pytest.raises(WireError):
        decompress(packed, 4096, 4096)  # says less than it holds
    with pytest.raises(WireError):
        decompress(packed, 1_000_001, 1_000_001)  # says more
    with pytest.raises(WireError):
        decompress(b"\xff\xff\xff", 10, 4096)
    assert decompress(packed, 1_000_000, 1_000_000) == b"\0" * 1_000_000
