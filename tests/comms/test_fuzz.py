from __future__ import annotations

import os

from bench.fuzz_codec import fuzz

COUNT = int(os.environ.get("MRSLAM_FUZZ", "15000"))


def test_broken_messages_never_crash_hang_or_swell_a_robot():
    report = fuzz(COUNT, seed=1)
    assert report.mutants >= COUNT
    assert report.exchanges > 5  # the team goes on working among them
    assert {"malformed", "corrupt", "foreign team", "bad tiles", "bad manifest", "forged"} <= set(report.dropped)
    assert report.slowest_ms < 1000
    assert report.memory_growth_mb < 100
