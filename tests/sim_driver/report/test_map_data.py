"""What the page's map says of robots beside where they drove."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from mrslam.sim_driver.report.layout import Layout
from mrslam.sim_driver.report.map_data import joined_s


def merged(t: float, a: str, b: str) -> dict[str, Any]:
    return {"t": t, "event": "merged", "a": a, "b": b}


def test_a_map_joins_the_anchors_once_merges_lead_there_by_way_of_others_too() -> None:
    ids = ("r1", "r2", "r3", "r4", "r5")
    events = [merged(5.0, "r3", "r4"), merged(6.0, "r2", "r3"), merged(9.0, "r1", "r2"), merged(12.0, "r1", "r4")]
    run: Any = SimpleNamespace(
        mission=SimpleNamespace(robots=[SimpleNamespace(id=one) for one in ids]), events={"r1": events}
    )
    shown = Layout("r1", "r1", {one: np.zeros(3) for one in ids}, ids[:4], 0.1, np.zeros((1, 1), dtype=np.int8))
    assert joined_s(run, shown) == {"r1": 0.0, "r2": 9.0, "r3": 9.0, "r4": 9.0, "r5": None}
