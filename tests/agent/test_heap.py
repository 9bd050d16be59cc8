from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from agent.heap import give_back


def resident_kb() -> int:
    line = next(x for x in Path("/proc/self/status").read_text().splitlines() if x.startswith("VmRSS:"))
    return int(line.split()[1])


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_pages_between_blocks_in_use_go_back() -> None:
    if not give_back() and not give_back():
        pytest.skip("this system's allocator has no malloc_trim")
    blocks = [np.ones(8192) for _ in range(1000)]  # 64 KiB each: below the size that is mapped on its own
    kept, full = blocks[::10], resident_kb()
    del blocks
    give_back()
    assert resident_kb() < full - 40_000
    assert sum(block.sum() for block in kept) == 100 * 8192
