from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from agent import heap
from agent.heap import give_back


def resident_kb() -> int:
    line = next(x for x in Path("/proc/self/status").read_text().splitlines() if x.startswith("VmRSS:"))
    return int(line.split()[1])


@pytest.mark.skipif(heap._TRIM is None, reason="this system's allocator has no malloc_trim")
def test_pages_between_blocks_in_use_go_back() -> None:
    blocks = [np.ones(8192) for _ in range(1000)]  # 64 KiB each: below the size that is mapped on its own
    kept, full = blocks[::10], resident_kb()
    del blocks
    give_back()
    assert resident_kb() < full - 40_000
    assert sum(block.sum() for block in kept) == 100 * 8192
