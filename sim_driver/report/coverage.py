"""How much each robot knew over time, of its own and with its team."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.report.layout import Layout
from mrslam.sim_driver.report.tied import tied_s
from mrslam.sim_driver.simulation.simulation import make_world
from mrslam.spatial import se2

CURVE_POINTS = 80
"""Points of a curve over time."""


def coverage_data(
    run: RunResults, layout: Layout, first_seen_s: dict[str, NDArray[np.float32]], end_s: float
) -> dict[str, Any]:
    """Return what each robot knew over time, of its own and with its team: square metres, or share of a known world."""
    counted = layout.cells > 0
    unit, whole = "m²", 1.0 / layout.cell_m**2
    if run.mission.world is not None and layout.frame in run.T_world_map:
        world = make_world(run.mission)
        T_plane_world = se2.compose(layout.T_plane_map[layout.frame], se2.inverse(run.T_world_map[layout.frame]))
        floor = np.zeros_like(counted)
        row, col = layout.pixels(se2.apply(T_plane_world, world.grid.centres(world.reachable)))
        inside = (row >= 0) & (row < floor.shape[0]) & (col >= 0) & (col < floor.shape[1])
        floor[row[inside], col[inside]] = True
        if floor.any() and inside.any():
            counted, unit, whole = floor & (layout.cells == 1), "%", floor.sum() / inside.mean() / 100.0
    times = np.linspace(0.0, end_s, CURVE_POINTS)
    curves: dict[str, Any] = {}
    for robot in run.robots:
        own = first_seen_s[robot][counted]
        own = np.sort(own[np.isfinite(own)])
        curves[robot] = {"own": [round(float(v), 2) for v in np.searchsorted(own, times, side="right") / whole]}
        if robot in layout.placed or robot == layout.anchor:
            curves[robot]["team"] = [
                round(float(v), 2) for v in _team_curve(run, robot, first_seen_s, counted, times) / whole
            ]
    return {"unit": unit, "times": [round(float(t), 2) for t in times], "curves": curves}


def _team_curve(
    run: RunResults,
    robot: str,
    first_seen_s: dict[str, NDArray[np.float32]],
    counted: NDArray[np.bool_],
    times: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return how many counted places the robot's team map held over time: what teammates had seen when it was told."""
    told: dict[str, list[float]] = {}
    merged_s = tied_s(run.events[robot], run.robots[robot].get("frame") or robot)
    for event in run.events[robot]:
        if event["event"] == "map_updated":
            told.setdefault(event["robot_id"], []).append(event["t"])
    mine = {other: first_seen_s[other][counted] for other in run.robots[robot]["placed"] if other in first_seen_s}
    counts = np.empty(len(times))
    for i, t in enumerate(times):
        knows = mine[robot] <= t if robot in mine else np.zeros(np.count_nonzero(counted), dtype=np.bool_)
        for other, first in mine.items():
            news = [s for s in told.get(other, []) if s <= t]
            if other != robot and news and merged_s.get(other, np.inf) <= t:
                knows = knows | (first <= news[-1])
        counts[i] = np.count_nonzero(knows)
    return counts
