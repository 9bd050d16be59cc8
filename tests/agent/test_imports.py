"""What importing the core loads: no network, no images, no viewer, no filter that a lone robot does not need."""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = {"zenoh", "cv2", "rerun", "rosbags", "filterpy"}


@pytest.mark.parametrize(
    ("module", "unwanted"), [("mrslam.agent.core", HEAVY), ("mrslam.rbpf", {"cv2"}), ("mrslam", {"numba", "numpy"})]
)
def test_importing_it_loads_none_of_these(module: str, unwanted: set[str]) -> None:
    code = f"import sys, {module}; print(*sorted({{name.split('.')[0] for name in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True)
    loaded = set(done.stdout.split())
    assert "mrslam" in loaded and not loaded & unwanted
