from __future__ import annotations

import numpy as np

from mrslam.rbpf.rows import Rows


def test_rows_grow_and_go_on_from_what_was_saved() -> None:
    rows = Rows(2, np.int64)
    early = rows.rows
    for k in range(1000):
        rows.add((k, -k))
    assert early.shape == (0, 2)
    assert rows.rows.dtype == np.int64
    assert np.array_equal(rows.rows[:, 0], np.arange(1000))
    again = Rows.of(rows.rows[:100])
    again.add((7, 7))
    assert again.size == 101 and again.rows[-1].tolist() == [7, 7]
    assert rows.rows[100].tolist() == [100, -100]  # the copy is its own


def test_rows_grow_by_several_at_a_time() -> None:
    rows = Rows(2, np.uint16)
    parts = [np.full((count, 2), k) for k, count in enumerate((0, 3, 60, 1, 500, 64))]
    for part in parts:
        held = rows.rows
        before = held.tobytes()
        rows.extend(part)
        assert held.tobytes() == before
    rows.add((9, 9))
    assert np.array_equal(rows.rows, np.concatenate([*parts, [[9, 9]]]))
