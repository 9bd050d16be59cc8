"""What must come through copying and files as it was."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrslam.spatial import Scan
from mrslam.spatial.files.tum import read_tum


def test_a_scan_with_other_ranges_is_swept_as_fast() -> None:
    scan = Scan(
        stamp_ns=7, ranges_m=np.ones(4, dtype=np.float32), angle_min_rad=-0.5, angle_increment_rad=0.1, range_max_m=5.0,
        range_min_m=0.2, beam_interval_s=1e-3,
    )  # fmt: skip
    masked = scan.with_ranges(np.full(4, 2.0))
    kept = ("stamp_ns", "angle_min_rad", "angle_increment_rad", "range_max_m", "range_min_m", "beam_interval_s")
    assert [getattr(masked, name) for name in kept] == [getattr(scan, name) for name in kept]


def test_headings_of_sloping_poses_are_the_yaw(tmp_path: Path) -> None:
    roll, pitch, yaw = 0.4, -0.3, 1.1
    cr, sr, cp, sp, cy, sy = (f(angle / 2) for angle in (roll, pitch, yaw) for f in (np.cos, np.sin))
    x, y = sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy
    z, w = cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy
    (tmp_path / "slope.tum").write_text(f"1 0 0 0 {x} {y} {z} {w}\n")
    assert np.isclose(read_tum(tmp_path / "slope.tum")[1][0, 2], yaw)
