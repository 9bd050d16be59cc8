"""When places were first seen: the kernel against points along the beams, one by one."""

from __future__ import annotations

import numpy as np

from mrslam.sim_driver.report.cast_kernel import see_along


def test_places_along_beams_have_the_earliest_time_and_their_ends_count() -> None:
    rng = np.random.default_rng(0)
    seen = np.full((40, 50), np.inf, dtype=np.float32)
    wanted = seen.copy()
    for t_s in (3.0, 1.0, 2.0):
        angles, reach_m = rng.uniform(-3.0, 3.0, 30), rng.uniform(0.0, 8.0, 30)
        reach_m[0] = 0.0
        start_m = np.array([3.3, 2.7])
        see_along(seen, np.float32(t_s), start_m, np.cos(angles), np.sin(angles), reach_m, 0.2, 0.1)
        for angle, reach in zip(angles, reach_m, strict=True):
            for along in [*(0.2 * np.arange(int(reach / 0.2) + 1)), reach]:
                col, row = np.floor((start_m + along * np.array([np.cos(angle), np.sin(angle)])) / 0.1).astype(int)
                if 0 <= row < 40 and 0 <= col < 50:
                    wanted[row, col] = min(wanted[row, col], t_s)
    np.testing.assert_array_equal(seen, wanted)
    assert np.isfinite(seen).sum() > 300
