"""The page's map: one image of what is where, seen when and by whom, with the robots' ways and meetings on it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.report.layout import Layout
from mrslam.sim_driver.report.png import png_uri
from mrslam.sim_driver.report.seen import mission_trajectory, spread
from mrslam.sim_driver.report.tied import tied_s
from mrslam.spatial import se2

PATH_POINTS = 500
"""Points of a trajectory that the page draws."""
TIME_LEVELS = 250
"""Steps of the mission's length in which the time of first sight is given: one byte of the picture."""


def map_data(
    run: RunResults, layout: Layout, first_seen_s: dict[str, NDArray[np.float32]], end_s: float
) -> dict[str, Any]:
    """Return the map as an image whose red, green and blue say what, when first seen and by whom; ways and meetings."""
    ids = [robot.id for robot in run.mission.robots]
    never = np.full(layout.cells.shape, np.inf, dtype=np.float32)
    stack = np.stack([first_seen_s.get(robot, never) for robot in ids])
    known = layout.cells > 0
    first = spread(stack.min(axis=0), known)
    who = np.argmin(stack, axis=0)
    whose = spread(np.where(np.isfinite(stack.min(axis=0)), who, np.inf).astype(np.float32), known)
    image = np.zeros((*layout.cells.shape, 3), dtype=np.uint8)
    image[..., 0] = layout.cells
    level = np.where(np.isfinite(first), first, 0.0) / max(end_s, 1e-3) * TIME_LEVELS
    image[..., 1] = np.where(known, np.clip(level, 0, TIME_LEVELS), 0).astype(np.uint8)
    image[..., 2] = np.where(known & np.isfinite(whose), np.where(np.isfinite(whose), whose, 0) + 1, 0).astype(np.uint8)
    image[~known] = 0
    height, width = layout.cells.shape
    return {
        "uri": png_uri(image[::-1]),
        "width": width,
        "height": height,
        "cell_m": round(layout.cell_m, 5),
        "levels": TIME_LEVELS,
        "anchor": layout.anchor,
        "joined_s": joined_s(run, layout),
        "paths": {robot: _path(run, layout, robot) for robot in run.robots},
        "meetings": _meetings(run, layout),
    }


def joined_s(run: RunResults, layout: Layout) -> dict[str, float | None]:
    """Return when each robot's map was first tied to the anchor's, None for never."""
    joined: dict[str, float | None] = {robot.id: None for robot in run.mission.robots}
    joined |= tied_s(run.events[layout.anchor], layout.frame)
    return {robot: time for robot, time in joined.items() if robot in layout.placed or time is None}


def _path(run: RunResults, layout: Layout, robot_id: str) -> list[list[float]]:
    """Return ``[t_s, col, row from the top, heading]`` along a trajectory."""
    times_ns, poses = mission_trajectory(run, robot_id)
    if len(times_ns) == 0:
        return []
    chosen = np.unique(np.linspace(0, len(times_ns) - 1, min(PATH_POINTS, len(times_ns))).round().astype(int))
    in_plane = se2.compose(layout.T_plane_map[robot_id], poses[chosen])
    height = layout.cells.shape[0]
    return [
        [round(t / 1e9, 1), round(x / layout.cell_m, 1), round(height - y / layout.cell_m, 1), round(heading, 2)]
        for t, (x, y, heading) in zip(times_ns[chosen].tolist(), in_plane.tolist(), strict=True)
    ]


def _meetings(run: RunResults, layout: Layout) -> list[dict[str, Any]]:
    """Return every completed exchange with the places of both ends; one that has none is drawn at the other's."""
    paths = {robot: np.array(_path(run, layout, robot)).reshape(-1, 4) for robot in run.robots}
    found = []
    for robot in sorted(run.robots):
        for event in run.events[robot]:
            peer = event.get("peer")
            if event["event"] != "exchange_done" or peer is None or not robot < peer or peer not in paths:
                continue
            ways = [paths[one] for one in (robot, peer) if len(paths[one])]
            if not ways:
                continue
            ends = [way[min(int(np.searchsorted(way[:, 0], event["t"])), len(way) - 1)] for way in (ways[0], ways[-1])]
            row = {"t": event["t"], "a": robot, "b": peer, "bytes": event["bytes_sent"] + event["bytes_received"]}
            found.append({**row, "at": [[float(end[1]), float(end[2])] for end in ends]})
    return found
