from __future__ import annotations

import numpy as np

from sim_driver.spool import IN_MEMORY_BYTES, Spool


def test_rows_come_back_in_order_from_memory_and_from_disk() -> None:
    spool, steps = Spool(3), IN_MEMORY_BYTES // 24 + 500  # the last ones are on disk
    for k in range(steps):
        if k in (10, steps - 10):
            assert spool.rows.shape == (k, 3)  # reading takes nothing away
        spool.add(np.array([k, 0.1 * k, -k]))
    k = np.arange(steps)
    assert np.array_equal(spool.rows, np.stack([k, 0.1 * k, -k], axis=1))
