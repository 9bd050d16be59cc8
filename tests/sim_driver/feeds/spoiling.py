"""Files as broken disks and broken transfers leave them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

TIMES = 40


def spoilt(raw: bytes) -> Iterator[bytes]:
    """Yield the file with three bytes changed, every other time cut off as well; the same each time."""
    rng = np.random.default_rng(0)
    for i in range(TIMES):
        content = bytearray(raw[: rng.integers(1, len(raw))] if i % 2 else raw)
        for at in rng.integers(0, len(content), 3):
            content[at] = rng.integers(256)
        yield bytes(content)
