"""What a robot's process says it took of the machine."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from mrslam.sim_driver.missions import usage
from mrslam.sim_driver.missions.usage import peak_kb, read_usage, write_usage

HELD_MB = 300
HOLDS = f"""
import numpy as np
from mrslam.sim_driver.missions.usage import peak_kb
before_kb = peak_kb()
np.ones({HELD_MB} << 20, dtype=np.uint8)
print(peak_kb() - before_kb)
"""


def shell_of(robot_id: str, ages_ms: dict[str, float]) -> Any:
    """Return what stands in for a shell: whose it is, and how old its scans were."""
    return SimpleNamespace(
        runner=SimpleNamespace(agent=SimpleNamespace(robot_id=robot_id)), scan_age_ms=lambda: ages_ms
    )


def test_peak_memory_is_in_kib_and_stays_when_it_is_given_back() -> None:
    grown_kb = int(subprocess.run([sys.executable, "-c", HOLDS], capture_output=True, check=True, text=True).stdout)
    assert grown_kb == pytest.approx(1024 * HELD_MB, rel=0.1)


def test_a_robots_folder_says_what_its_process_took(tmp_path: Path) -> None:
    ages = {"p50": 3.0, "p99": 21.5}
    assert read_usage(tmp_path) is None
    write_usage(shell_of("r1", ages), tmp_path)
    row = read_usage(tmp_path)
    assert row is not None
    assert row["scan_age_ms"] == ages
    assert row["cpu_s"] > 0.0
    assert row["peak_rss_mb"] == pytest.approx(peak_kb() / 1024, rel=0.01)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full here")
def test_on_a_full_disk_the_usage_is_left_out_and_that_is_logged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(usage, "write_text", lambda path, text: Path("/dev/full").write_text(text))
    write_usage(shell_of("r1", {}), tmp_path)
    assert caplog.messages == [f"r1: {tmp_path / 'usage.json'} cannot be written (No space left on device)"]


@pytest.mark.parametrize("damaged", ["", '{"cpu_s": 3', "[1, 2]"])
def test_damaged_usage_is_none(tmp_path: Path, damaged: str) -> None:
    (tmp_path / "usage.json").write_text(damaged)
    assert read_usage(tmp_path) is None
