from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numba import njit

from mrslam.spatial.runtime import heap
from mrslam.spatial.runtime.heap import give_back, give_back_now_and_then


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


@pytest.mark.skipif(heap._ADVISE is None, reason="this system has no madvise")
def test_code_goes_and_comes_back_when_it_is_needed() -> None:
    @njit
    def add(a: int, b: int) -> int:
        return a + b

    assert add(1, 2) == 3
    before = resident_kb()
    give_back()
    assert resident_kb() < before - 10_000
    assert add(1.5, 2.0) == 3.5  # compiled for other types: the compiler is read again


def test_robots_of_one_process_give_back_once_for_all(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, given = iter((100.0, 100.0, 101.0, 129.0, 130.0, 130.0, 131.0)), []
    monkeypatch.setattr(heap._Last, "at_s", float("-inf"))
    monkeypatch.setattr(heap.time, "monotonic", lambda: next(clock))
    monkeypatch.setattr(heap, "give_back", lambda: given.append(True))
    assert [give_back_now_and_then() for _ in range(5)] == [True, False, False, True, False]
    assert len(given) == 2
