"""What a driver says of its laser reaches the mapper."""

from __future__ import annotations

import numpy as np

from mrslam.comms.transport.sensors import decode_scan, encode_scan
from mrslam.spatial import Scan


def test_the_lasers_place_and_bounds_survive_the_way() -> None:
    sent = Scan(
        stamp_ns=5, ranges_m=np.array([1.0, 0.2, 9.0], dtype=np.float32), angle_min_rad=2.0, angle_increment_rad=-0.5,
        range_max_m=10.0, range_min_m=0.1, T_base_laser=np.array([0.3, -0.1, 3.0]), beam_interval_s=1e-4,
    )  # fmt: skip
    back, _ = decode_scan(encode_scan(sent))
    assert np.array_equal(back.T_base_laser, sent.T_base_laser)
    for name in ("stamp_ns", "angle_min_rad", "angle_increment_rad", "range_max_m", "range_min_m", "beam_interval_s"):
        assert getattr(back, name) == getattr(sent, name)
