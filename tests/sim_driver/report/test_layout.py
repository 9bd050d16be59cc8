"""Where the maps of a run lie on the page."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrslam.sim_driver.report.layout import GAP_M, MOST_PIXELS, lay_out
from mrslam.spatial import OccupancyGrid, se2

PLACED = {"r1": [0.0, 0.0, 0.0], "r2": [2.0, 1.0, 0.5]}


def hall(width: int, height: int, resolution_m: float = 0.05) -> OccupancyGrid:
    """Return floor with a wall along its lower edge."""
    cells = np.zeros((height, width), dtype=np.int8)
    cells[0] = 100
    return OccupancyGrid(cells, resolution_m, (-1.0, 0.5))


def robot(placed: dict[str, Any], area_m2: float, **more: Any) -> dict[str, Any]:
    return {"placed": placed, "team_area_m2": area_m2, "mode": "distributed", **more}


def run(robots: dict[str, Any], maps: dict[str, OccupancyGrid]) -> Any:
    return SimpleNamespace(robots=robots, map=lambda name, which="map": maps[name])


def test_the_team_map_of_who_placed_most_is_shown_whatever_its_size() -> None:
    alone = {"r3": [0.0, 0.0, 0.0]}
    robots = {"r3": robot(alone, 90.0), "r1": robot(PLACED, 20.0), "r2": robot(PLACED, 19.0)}
    layout = lay_out(run(robots, {name: hall(100, 60) for name in robots}))
    assert (layout.anchor, layout.frame, layout.placed) == ("r1", "r1", ("r1", "r2"))


def test_the_maps_of_robots_nobody_could_place_stand_beside_it() -> None:
    robots = {
        "base": robot(PLACED, 20.0, mode="central", frame="r2"),
        "other": robot({}, 0.0, mode="central"),
        "r3": robot({}, 5.0),
        **{name: robot({name: [0.0, 0.0, 0.0]}, 9.0) for name in PLACED},
    }
    layout = lay_out(run(robots, {"base": hall(100, 60), "r3": hall(40, 80)}))
    assert (layout.anchor, layout.frame) == ("base", "r2")
    assert set(layout.T_plane_map) == {"r1", "r2", "r3"}
    T_plane_team = np.array([GAP_M / 2 + 1.0, GAP_M / 2 - 0.5, 0.0])
    for name, T in PLACED.items():
        assert layout.T_plane_map[name] == pytest.approx(se2.compose(T_plane_team, np.array(T)))
    assert layout.T_plane_map["r3"] == pytest.approx(T_plane_team + np.array([5.0 + GAP_M, 0.0, 0.0]))
    walls = layout.cells == 2
    row = int(GAP_M / 2 / layout.cell_m + 0.5)
    first = [int(x / layout.cell_m + 0.5) for x in (GAP_M / 2, 5.0 + 1.5 * GAP_M)]
    assert np.flatnonzero(walls.any(axis=1)).tolist() == [row]
    assert np.flatnonzero(walls[row]).tolist() == [*range(first[0], first[0] + 100), *range(first[1], first[1] + 40)]
    assert (layout.cells == 1).sum() == 100 * 59 + 40 * 79


def test_a_large_map_is_drawn_coarser() -> None:
    layout = lay_out(run({"r1": robot({"r1": [0.0, 0.0, 0.0]}, 9.0)}, {"r1": hall(4000, 100)}))
    assert layout.cell_m == pytest.approx((4000 * 0.05 + 1.5 * GAP_M) / MOST_PIXELS, rel=0.01)
    assert max(layout.cells.shape) <= MOST_PIXELS + 1
    assert (layout.cells == 2).any(axis=1).sum() == 1
