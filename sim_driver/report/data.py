"""Everything the page shows, as plain JSON values."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agent import Settings
from merge.draw import colours
from sim_driver.evaluate import References, assess
from sim_driver.evaluate.network import quality_over_time
from sim_driver.evaluate.results import RunResults
from sim_driver.report.layout import Layout, lay_out
from sim_driver.report.png import png_uri
from sim_driver.report.seen import first_seen_s, mission_trajectory, spread
from sim_driver.report.story import event_words, headline, sentences
from sim_driver.settings import as_table
from sim_driver.simulation import make_world
from spatial import se2

PATH_POINTS = 500
"""Points of a trajectory that the page draws."""
CURVE_POINTS = 80
"""Points of a curve over time."""
TIME_LEVELS = 250
"""First sight is told in this many steps of the mission's length."""
TICKER_LINES = 400


def page_data(run: RunResults, references: References | None = None) -> dict[str, Any]:
    """Return what the page is made of."""
    assessment = assess(run.folder, references)
    end_s = float(run.metrics["mission_s"])
    data: dict[str, Any] = {
        "name": run.metrics["name"],
        "headline": headline(run),
        "sentences": sentences(run, assessment),
        "end_s": end_s,
        "robots": [
            {"id": robot, "colour": "#{:02x}{:02x}{:02x}".format(*colour)}
            for robot, colour in colours([robot.id for robot in run.mission.robots]).items()
        ],
        "links": [_link(run, a, b, end_s) for a, b in combinations(sorted(run.events), 2)],
        "threshold": run.mission.settings.comms.link_threshold,
        "attempts": _attempts(run),
        "traffic": {**assessment["mission"]["bytes"], "curve": _traffic_curve(run, end_s)},
        "ticker": _ticker(run),
        "assessment": assessment,
        "settings": _settings(run),
        "map": None,
        "coverage": None,
    }
    if run.robots:
        layout = lay_out(run)
        data["map"], seen = _map(run, layout, end_s)
        data["coverage"] = _coverage(run, layout, seen, end_s)
    return data


def _map(run: RunResults, layout: Layout, end_s: float) -> tuple[dict[str, Any], dict[str, NDArray[np.float32]]]:
    """Return the map as an image whose red, green and blue say what, when first seen and by whom; and when by robot."""
    ids = [robot.id for robot in run.mission.robots]
    seen = {robot: first_seen_s(run, layout, robot) for robot in run.robots}
    stack = np.stack([seen.get(robot, np.full(layout.cells.shape, np.inf, dtype=np.float32)) for robot in ids])
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
    }, seen


def joined_s(run: RunResults, layout: Layout) -> dict[str, float | None]:
    """Return when each robot's map was first tied to the anchor's, None for never."""
    joined: dict[str, float | None] = {robot.id: None for robot in run.mission.robots}
    joined[layout.anchor] = 0.0
    edges: list[tuple[str, str]] = []
    for event in run.events[layout.anchor]:
        if event["event"] != "merged":
            continue
        edges.append((event["a"], event["b"]))
        for _ in edges:
            for a, b in edges:
                for one, other in ((a, b), (b, a)):
                    if joined.get(one) is not None and joined.get(other) is None:
                        joined[other] = event["t"]
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
    """Return every completed exchange with the places of both ends."""
    paths = {robot: np.array(_path(run, layout, robot)) for robot in run.robots}
    found = []
    for robot in sorted(run.robots):
        for event in run.events[robot]:
            peer = event.get("peer")
            if event["event"] != "exchange_done" or peer is None or not robot < peer or peer not in paths:
                continue
            ends = [
                paths[one][min(int(np.searchsorted(paths[one][:, 0], event["t"])), len(paths[one]) - 1)]
                for one in (robot, peer)
            ]
            row = {"t": event["t"], "a": robot, "b": peer, "bytes": event["bytes_sent"] + event["bytes_received"]}
            found.append({**row, "at": [[float(end[1]), float(end[2])] for end in ends]})
    return found


def _coverage(run: RunResults, layout: Layout, seen: dict[str, NDArray[np.float32]], end_s: float) -> dict[str, Any]:
    """Return what each robot knew over time, of its own and with its team: square metres, or share of a known world."""
    counted = layout.cells > 0
    unit, whole = "m²", 1.0 / layout.cell_m**2
    if run.mission.world is not None and layout.anchor in run.T_world_map:
        world = make_world(run.mission)
        T_plane_world = se2.compose(layout.T_plane_map[layout.anchor], se2.inverse(run.T_world_map[layout.anchor]))
        floor = np.zeros_like(counted)
        row, col = layout.pixels(se2.apply(T_plane_world, world.grid.centres(world.reachable)))
        inside = (row >= 0) & (row < floor.shape[0]) & (col >= 0) & (col < floor.shape[1])
        floor[row[inside], col[inside]] = True
        if floor.any() and inside.any():
            counted, unit, whole = floor & (layout.cells == 1), "%", floor.sum() / inside.mean() / 100.0
    times = np.linspace(0.0, end_s, CURVE_POINTS)
    curves: dict[str, Any] = {}
    for robot in run.robots:
        own = seen[robot][counted]
        own = np.sort(own[np.isfinite(own)])
        curves[robot] = {"own": [_short(v) for v in np.searchsorted(own, times, side="right") / whole]}
        if robot in layout.placed:
            curves[robot]["team"] = [_short(v) for v in _team_curve(run, robot, seen, counted, times) / whole]
    return {"unit": unit, "times": [_short(t) for t in times], "curves": curves}


def _team_curve(
    run: RunResults,
    robot: str,
    seen: dict[str, NDArray[np.float32]],
    counted: NDArray[np.bool_],
    times: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return how many counted places the robot's team map held over time: what teammates had seen when it was told."""
    told: dict[str, list[float]] = {}
    merged_s: dict[str, float] = {}
    for event in run.events[robot]:
        if event["event"] == "map_updated":
            told.setdefault(event["robot_id"], []).append(event["t"])
        elif event["event"] == "merged":
            for other in (event["a"], event["b"]):
                merged_s.setdefault(other, event["t"])
    mine = {other: seen[other][counted] for other in run.robots[robot]["placed"] if other in seen}
    counts = np.empty(len(times))
    for i, t in enumerate(times):
        knows = mine[robot] <= t
        for other, first in mine.items():
            news = [s for s in told.get(other, []) if s <= t]
            if other != robot and news and merged_s.get(other, np.inf) <= t:
                knows = knows | (first <= news[-1])
        counts[i] = np.count_nonzero(knows)
    return counts


def _link(run: RunResults, a: str, b: str, end_s: float) -> dict[str, Any]:
    times, values = quality_over_time(run.events[a], b, end_s)
    marks = [
        [event["t"], event["event"].removeprefix("exchange_")]
        for event in run.events[a]
        if event.get("peer") == b and event["event"] in ("exchange_done", "exchange_failed")
    ]
    merged = [e["t"] for r in (a, b) for e in run.events[r] if e["event"] == "merged" and {e["a"], e["b"]} == {a, b}]
    curve = [[_short(t), round(float(v), 3)] for t, v in zip(times, values, strict=True)]
    return {"a": a, "b": b, "quality": curve, "exchanges": marks, "merged_s": min(merged, default=None)}


def _attempts(run: RunResults) -> list[dict[str, Any]]:
    return [
        {
            "t": event["t"],
            "robot": event["robot"],
            "pair": f"{event['a']}-{event['b']}",
            "accepted": event["status"] == "accepted",
            "reason": event["reason"],
            "confidence": round(event["confidence"], 2),
            "overlap": event["evidence"].get("overlap"),
        }
        for events in run.events.values()
        for event in events
        if event["event"] == "alignment"
    ]


def _traffic_curve(run: RunResults, end_s: float) -> list[list[float]]:
    """Return ``[t, sent, whole maps with LZ4, whole maps raw]``, bytes in all exchanges so far."""
    done = sorted((e for events in run.events.values() for e in events if e["event"] == "exchange_done"), key=_at)
    curve = [[0.0, 0, 0, 0]]
    for event in done:
        costs = (event["bytes_sent"], event["bytes_full_lz4"], event["bytes_full_raw"])
        curve.append([event["t"], *(before + cost for before, cost in zip(curve[-1][1:], costs, strict=True))])
    return [*curve, [end_s, *curve[-1][1:]]]


def _at(event: dict[str, Any]) -> float:
    return float(event["t"])


def _ticker(run: RunResults) -> list[list[Any]]:
    lines = [
        [event["t"], *words]
        for events in run.events.values()
        for event in events
        if (words := event_words(event)) is not None
    ]
    lines.sort(key=lambda line: line[0])
    if len(lines) > TICKER_LINES:  # what matters stays
        lines = [line for line in lines if line[1] != "plain"][:TICKER_LINES] or lines[:TICKER_LINES]
    return lines


def _settings(run: RunResults) -> list[list[Any]]:
    """Return ``[section.key, value, differs from the default]`` of every setting, those that differ first."""
    chosen, default = as_table(run.mission.settings), as_table(Settings())
    rows: list[list[Any]] = [
        ["mission.seed", run.mission.mission.seed, False],
        ["mission.shell", run.mission.mission.shell, False],
    ]
    for section, table in chosen.items():
        for key, value in table.items():
            rows.append([f"{section}.{key}", value, value != default[section][key]])
    return sorted(rows, key=lambda row: not row[2])


def _short(value: float) -> float:
    return round(float(value), 2)
