"""Where the real data is (``$MRSLAM_DATA``, else ``../shared/data`` beside the checkout); no hypothesis deadlines."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("no-deadline", deadline=None)  # first calls compile, and machines are shared
settings.load_profile("no-deadline")


@pytest.fixture(scope="session")
def data_dir() -> Path:
    folder = Path(os.environ.get("MRSLAM_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no recorded data at {folder}: set MRSLAM_DATA to run this test")
    return folder
