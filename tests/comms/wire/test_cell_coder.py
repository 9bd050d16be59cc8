from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrslam.comms.wire.binary_coder import READ_AHEAD
from mrslam.comms.wire.cell_coder import SIDE, code


class PlainCoder:
    """The same code, written to be read: Python integers, contexts by name in a dict, one list of bytes."""

    def __init__(self) -> None:
        self.low, self.high, self.out, self.chances = 0, 0xFFFFFFFF, [], {}

    def write(self, context: tuple, start: int, bit: int) -> None:
        p, count = self.chances.get(context, (start, 0))
        span = self.high - self.low
        middle = self.low + (span >> 16) * p + (((span & 0xFFFF) * p) >> 16)
        self.low, self.high = (self.low, middle) if bit else (middle + 1, self.high)
        while self.low >> 24 == self.high >> 24:
            self.out.append(self.high >> 24)
            self.low, self.high = (self.low << 8) & 0xFFFFFFFF, (self.high << 8) & 0xFFFFFFFF | 255
        p = p + (65536 - p) // (count + 2) if bit else p - p // (count + 2)
        self.chances[context] = (min(max(p, 64), 65536 - 64), min(count + 1, 38))

    def finish(self) -> bytes:
        return bytes([*self.out, self.high >> 24])


def plain(cells: np.ndarray, held: np.ndarray, bits: int) -> bytes:
    coder = PlainCoder()
    for new, old in zip(cells.astype(int), held.astype(int), strict=True):
        busy, even = {}, {}

        def at(array, r, c):
            return array[r, c] if 0 <= r < 64 and 0 <= c < 64 else 0

        def write_value(value, near):
            digits = f"{value:0{bits}b}"
            for k, digit in enumerate(digits):
                coder.write(("value", *[min(v, 7) for v in near], digits[:k]), 32768, int(digit))

        def moved(r, c, new=new, old=old):
            a, b = at(new, r, c), at(old, r, c)
            return 0 if a == b else 1 if a == 0 else 2

        for i in range(8):
            for j in range(8):
                part = (slice(8 * i, 8 * i + 8), slice(8 * j, 8 * j + 8))
                busy[i, j] = bool((new[part] != old[part]).any())
                context = ("square", busy.get((i - 1, j), False), busy.get((i, j - 1), False), bool(old[part].any()))
                coder.write(context, 32768, int(busy[i, j]))
                if not busy[i, j]:
                    continue
                even[i, j] = len(np.unique(new[part])) == 1
                context = ("even", even.get((i - 1, j), False), even.get((i, j - 1), False), bool(old[part].any()))
                coder.write(context, 32768, int(even[i, j]))
                if even[i, j]:
                    r, c = 8 * i, 8 * j
                    write_value(new[r, c], (old[r, c], at(new, r, c - 1), at(new, r - 1, c)))
                    continue
                for r in range(8 * i, 8 * i + 8):
                    for c in range(8 * j, 8 * j + 8):
                        known = [at(new, r, c - 1), at(new, r - 1, c), at(old, r, c + 1), at(old, r + 1, c)]
                        around = (moved(r, c - 1), moved(r - 1, c), moved(r - 1, c - 1))
                        context = ("keep", min(old[r, c], 7), *[v != 0 for v in known], around)
                        changed = int(new[r, c] != old[r, c])
                        coder.write(context, 16384, changed)
                        if changed:
                            write_value(new[r, c], (old[r, c], known[0], known[1]))
    return coder.finish()


def patch(bits: int, tiles: int, share: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    held = np.zeros((tiles, 64, 64), dtype=np.uint8)
    held[:, 10:50, 5:40] = rng.integers(0, 1 << bits, dtype=np.uint8)
    cells = held.copy()
    where = rng.random(cells.shape) < share
    cells[where] = rng.integers(0, 1 << bits, int(where.sum()))
    return cells, held


def encoded(cells: np.ndarray, held: np.ndarray, bits: int) -> bytes:
    room = np.zeros(2 * cells.size + 16, dtype=np.uint8)
    return room[: code(cells.copy(), held, bits, room, True)].tobytes()


@pytest.mark.parametrize(("bits", "share"), [(1, 0.0), (1, 0.02), (3, 0.1), (3, 1.0), (7, 0.3)])
def test_kernel_writes_what_the_plain_coder_writes(bits, share):
    cells, held = patch(bits, 2, share, seed=bits)
    assert encoded(cells, held, bits) == plain(cells, held, bits)


def test_squares_of_a_single_value_and_others_beside_them_share_what_values_they_expect():
    rng = np.random.default_rng(4)
    cells = np.kron(rng.integers(0, 3, (3, 8, 8)), np.ones((1, 8, 8), dtype=np.int64)).astype(np.uint8)
    ragged = np.kron(rng.random((3, 8, 8)) < 0.4, np.ones((1, 8, 8), dtype=np.bool_)) & (rng.random(cells.shape) < 0.3)
    cells[ragged] = rng.integers(0, 3, int(ragged.sum()))
    held = np.where(rng.random(cells.shape) < 0.1, 1, 0).astype(np.uint8)
    assert encoded(cells, held, 2) == plain(cells, held, 2)


@given(
    bits=st.integers(1, 7),
    tiles=st.integers(1, 4),
    share=st.sampled_from([0.0, 0.001, 0.1, 1.0]),
    seed=st.integers(0, 999),
)
@settings(max_examples=60, deadline=None)
def test_what_was_written_is_read(bits, tiles, share, seed):
    cells, held = patch(bits, tiles, share, seed)
    packed = np.frombuffer(bytearray(encoded(cells, held, bits)), dtype=np.uint8)
    read = np.full_like(cells, 255)
    assert code(read, held, bits, packed, False) == packed.size + READ_AHEAD
    assert np.array_equal(read, cells)


def test_too_little_room_is_reported_and_nothing_is_written_behind_it():
    cells, held = patch(3, 1, 1.0, seed=1)
    room = np.zeros(100, dtype=np.uint8)
    guard = np.concatenate([room, np.full(50, 7, dtype=np.uint8)])
    assert code(cells, held, 3, guard[:100], True) > 100
    assert (guard[100:] == 7).all()


def test_any_bytes_can_be_read():
    rng = np.random.default_rng(0)
    held = np.zeros((2, 64, 64), dtype=np.uint8)
    for size in (0, 1, 3, 4, 1000):
        cells = np.empty_like(held)
        code(cells, held, 3, rng.integers(0, 256, size, dtype=np.uint8), False)
        assert cells.max() < 8


def test_an_unchanged_tile_costs_next_to_nothing():
    cells, held = patch(3, 64, 0.0, seed=3)
    assert len(encoded(cells, held, 3)) < 20
    assert SIDE == 64
