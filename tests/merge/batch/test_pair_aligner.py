"""What is asked of each pair of many maps."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from mrslam.alignment import Rejection
from mrslam.merge import MergeConfig
from mrslam.merge.batch import pair_aligner
from mrslam.merge.batch.pair_aligner import PairAligner
from mrslam.spatial import OccupancyGrid
from tests.merge.joint.blocks import drive

NOWHERE = Rejection("nothing fits", 0.0, None, "auto")
GRIDS = {name: OccupancyGrid(np.zeros((50, 50), dtype=np.int8), 0.05) for name in "abc"}


def test_only_maps_with_the_scans_that_bend_them_are_looked_at_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[bool, bool]] = []

    def align(*_: object, config: object = None, by_parts: bool, **__: object) -> Rejection:
        asked.append((config is not None, by_parts))
        return NOWHERE

    monkeypatch.setattr(pair_aligner, "align", align)
    trails = {name: drive(0.0, 2.0).trail for name in "ab"}
    with ThreadPoolExecutor(1) as pool:
        pairs = PairAligner(GRIDS, "auto", pool, MergeConfig(), trails=trails)
        assert pairs.align_pairs([("a", "b", None), ("a", "c", None)]) == []
        assert pairs.align_grids(GRIDS["a"], [GRIDS["c"]]) == [NOWHERE]
    assert asked == [(True, True), (False, False), (False, False)]
