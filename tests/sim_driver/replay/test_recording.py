"""What a simulated robot sensed, where it cannot be written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrslam.agent import Agent, Sensed, Settings
from mrslam.sim_driver.replay import recording
from mrslam.sim_driver.replay.recording import Recorder
from mrslam.spatial import Scan
from tests.full_disk import full_disk

SCAN = Scan(stamp_ns=5, ranges_m=np.ones(3, np.float32), angle_min_rad=-1.0, angle_increment_rad=1.0, range_max_m=10.0)


def test_on_a_full_disk_the_scans_are_left_out_and_that_is_logged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(recording, "write_bytes", full_disk)
    agent, recorder = Agent("r1", Settings()), Recorder(tmp_path)
    recorder.on_scan(agent, Sensed(0, SCAN, None), 0)
    recorder.close(agent, 0)
    assert caplog.messages == [f"r1: {tmp_path / 'scans.npz'} cannot be written (No space left on device)"]
