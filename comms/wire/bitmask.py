"""Sets of small numbers as bits."""

from __future__ import annotations

import numpy as np


def to_mask(items: list[int]) -> bytes:
    """Return bytes in which bit ``i % 8`` (lowest first) of byte ``i // 8`` is set for each item."""
    if not items:
        return b""
    bits = np.zeros(max(items) + 1, dtype=np.uint8)
    bits[items] = 1
    return np.packbits(bits, bitorder="little").tobytes()


def from_mask(mask: bytes, size: int) -> list[int]:
    """Return the items below ``size``, ascending."""
    bits = np.unpackbits(np.frombuffer(mask, dtype=np.uint8), bitorder="little")[:size]
    items: list[int] = np.flatnonzero(bits).tolist()
    return items
