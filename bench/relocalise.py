"""Relocalisation in saved maps of buildings: one JSON line a run, and what must hold of all at the end.

    python bench/relocalise.py --out DIR [--cuts 6] [--seconds 150] [--near right|wrong] [--survey 600] [--half 2]
        [BUILDING ...]
    python bench/relocalise.py --out DIR --cuts 10 office:1 office:2 hotel:3

The first half of a log (of isr and arena: the first of two) is mapped and saved; of a simulated world what a robot maps
that explores it for ten minutes (``--survey``: for so many seconds, which shows a part of it). ``--half 2`` saves the
second half of a log, and robots begin in its first. Robots that begin at
places of the rest, or at random places of the world, look for themselves in it and in the saved map of another building
(``foreign``), for ``--seconds`` at most. What was played before into the same ``--out`` is judged again, not played.

seconds, metres : mission time and path until the event "localised"; None where it never came.
error_m, error_deg : of the pose in the saved map then. Expected is where scans of the saved drive near by have it, each
moved by what lies between it and a scan of the robot within ``WITHIN_S`` of the event: the median of all of them, for
the heading of a single scan, of the reference or of the saved drive, is off by up to 11 degrees while robots turn.
Between the two lies a relation verified by hand (Kuemmerle et al. 2009) where there are ``FEW_RELATIONS`` (``by``:
"relations"), else what the reference trajectory has (``by``: "reference"). isr has neither, but its robot stood still
between the two logs, so the second log's trajectory, mapped whole, continues the first's. Simulated robots have the
truth. Stamps of intel run up to a second to and fro, so a recorded robot's pose is held against those of the second
around the event, and the nearest counts: a wrong place is wrong for all of them.
known_m : from the robot's true start to the nearest place of the saved trajectory. Robots that begin farther off than
``KNOWN_M`` may find nothing of what was saved within 10 m of driving: they are not counted in the last line, but for
wrong places.
stayed_m : the path until the robot is farther off than that, or the drive ends. ``stayed`` are those of the robots
counted for which that is 10 m or more, for the others did not drive as far as they may; ``stayed_in_time`` of these.
--near : robots are told where they begin in the saved map, half a metre off, or a place 15 m away from that, without a
heading (intel, mit-csail and aces, whose reference knows it).
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.run.run import run_mission
from mrslam.spatial import read_tum, se2
from mrslam.spatial.se2 import Transform

HALVES = {name: (f"slam/{name}.clf.gz", 0.0, 0.5) for name in ("intel", "aces", "mit-csail")}
DAYS = {"isr": "multi_session/isr_small_raw_{}.clf.gz", "arena": "multi_session/arena_raw_{}.clf.gz"}
NEXT = {"intel": "mit-csail", "mit-csail": "aces", "aces": "intel", "isr": "arena", "arena": "isr"}
"""Building -> another, whose map is foreign there."""
NEAR_S = 0.2
AROUND_S = 1.0
"""Poses of a recorded robot this long before and after the event are compared."""
TICK_S = 0.2
"""And of a simulated one, whose stamps are right: the last scan's, which may be a tick older than the event."""
STAMP_NS = 5e6
"""Files of relations round stamps to 10 ms."""
WITHIN_S, NEAR_M, FEW_RELATIONS = 10.0, 2.0, 3
"""Scans of the robot this long before and after the event say where it was, with scans of the saved drive so near: in
that time its own map drifts by centimetres. Relations from which these alone do."""
PAIRS = 10
"""Nearest scans of the saved drive that the reference compares with one of the robot's."""
KNOWN_M, DRIVEN_M, RIGHT_M, RIGHT_DEG = 3.0, 10.0, 0.3, 5.0
"""A place counts as saved when the saved drive passed so near; found in time, and rightly."""
SURVEY_S = 600.0


def play(
    folder: Path, robot: dict[str, Any], saved: Path | None, seconds: float | None, near: list[float] | None = None
) -> Path:
    """Run a mission of one robot in virtual time; return the robot's folder."""
    if (folder / "r1" / "robot.json").exists():
        return folder / "r1"
    seed = robot.get("seed", 1)
    tables: dict[str, Any] = {"mission": {"shell": "virtual", "seed": seed, "linger_s": 1.0, "record": False}}
    tables["robots"] = [{"id": "r1", **{key: value for key, value in robot.items() if key not in ("world", "seed")}}]
    if "world" in robot:
        tables["world"] = {"name": robot["world"]}
    if seconds is not None:
        tables["mission"]["duration_s"] = seconds
    if saved is not None:
        tables["maps"] = [{"path": str(saved.resolve()), "id": "saved@map"} | ({"near": near} if near else {})]
    mission = make_mission(tables, folder.parent / f"{folder.name}.toml")
    run_mission(mission, folder, lambda *_: None, lambda text: print(text, file=sys.stderr))
    return folder / "r1"


def save(name: str, out: Path, survey_s: float = SURVEY_S) -> Path:
    """Return the folder of a building's saved map; it is made where it is not there."""
    folder = out / f"saved-{name.replace(':', '-')}"
    if ":" in name:
        return play(folder, {"world": name}, None, survey_s)
    log, first, last = HALVES.get(name) or (DAYS[name].format(1), 0.0, 1.0)
    return play(folder, {"log": log, "first": first, "last": last}, None, None)


def second_day(name: str, out: Path) -> Path:
    """Return the folder of the second log mapped whole, from where the first ended."""
    return play(out / f"second-{name}", {"log": DAYS[name].format(2)}, None, None)


def at(way: tuple[Any, Transform], stamps_ns: Any) -> Transform:
    """Return the poses of a trajectory nearest in time; NaN where there is none within ``NEAR_S``."""
    order = np.argsort(way[0])
    stamps = way[0][order]
    k = np.clip(np.searchsorted(stamps, stamps_ns), 1, len(stamps) - 1)
    k -= np.abs(stamps[k - 1] - stamps_ns) < np.abs(stamps[k] - stamps_ns)
    poses = way[1][order][k].copy()
    poses[np.abs(stamps[k] - stamps_ns) > NEAR_S * 1e9] = np.nan
    return poses


def judge(name: str, saved: Path, robot: Path, data: Path, is_foreign: bool) -> dict[str, Any]:
    """Return the row of one run."""
    events = [json.loads(line) for line in (robot / "events.jsonl").read_text().splitlines()]
    (place,) = json.loads((robot / "robot.json").read_text())["saved_maps"]
    found = next((event for event in events if event["event"] == "localised"), None)
    lost = sum(event["event"] == "not_localised" for event in events)
    row: dict[str, Any] = {
        "found": found is not None,
        "lost_again": lost,
        "end": place["state"],
        "why": place["reason"],
    }
    way, saved_way = read_tum(robot / "trajectory.tum"), read_tum(saved / "trajectory.tum")
    reference = data / f"slam/{name}.reference.tum"
    truth = read_tum(reference) if reference.exists() and not is_foreign else None
    driven = np.append(0.0, np.cumsum(np.hypot(*np.diff(way[1][:, :2], axis=0).T)))
    row["stayed_m"] = round(float(driven[-1]), 2)
    if truth is not None:
        true_saved, true_way = at(truth, saved_way[0]), at(truth, way[0])
        row |= stays(true_saved, true_way, driven)
    if (saved / "truth.tum").exists() and not is_foreign:
        row |= stays(read_tum(saved / "truth.tum")[1], at(read_tum(robot / "truth.tum"), way[0]), driven)
    if found is None:
        return {**row, "seconds": None, "metres": None}
    stamp_ns = way[0][0] + found["t"] * 1e9
    row["seconds"] = found["t"]
    row["metres"] = round(float(driven[np.flatnonzero(way[0] <= stamp_ns)[-1]]), 2)
    T_base_laser = way[1][0]  # for the map begins where the base did
    T_saved_laser = se2.compose(np.array([found["x_m"], found["y_m"], found["theta_rad"]]), T_base_laser)
    if is_foreign:
        return row
    is_simulated = (saved / "truth.tum").exists()
    around = np.flatnonzero(np.abs(way[0] - stamp_ns) <= (TICK_S if is_simulated else AROUND_S) * 1e9)
    if is_simulated:
        start, now = read_tum(saved / "truth.tum")[1][0], at(read_tum(robot / "truth.tum"), way[0][around])
        expected = se2.compose(se2.between(start, now), T_base_laser)
    elif truth is not None:
        row["by"], pairs = "relations", related(data / f"slam/{name}.relations", saved_way, way, stamp_ns)
        if len(pairs) < FEW_RELATIONS:
            row["by"], pairs = "reference", referred((saved_way, true_saved), (way, true_way), stamp_ns)
        if not len(pairs):
            return row
        off_first = se2.between(pairs[0], pairs)
        expected = se2.compose(se2.compose(pairs[0], np.median(off_first, axis=0)), way[1][around])
    elif name == "isr":
        whole = read_tum(second_day(name, saved.parents[1]) / "trajectory.tum")
        expected = se2.compose(saved_way[1][-1], se2.between(whole[1][0], at(whole, way[0][around])))
    else:
        return row
    off = se2.between(expected, T_saved_laser)
    off_m, off_deg = np.hypot(off[:, 0], off[:, 1]), np.degrees(np.abs(off[:, 2]))
    best = int(np.nanargmin(off_m / RIGHT_M + off_deg / RIGHT_DEG))
    row["error_m"], row["error_deg"] = round(float(off_m[best]), 3), round(float(off_deg[best]), 2)
    return row


def stays(saved: Transform, way: Transform, driven: Any) -> dict[str, float | None]:
    """Return how far off what was saved a robot begins, and its path until it leaves that, metres.

    ``saved``, ``way`` : true poses ``(N, 3)``, ``(M, 3)`` of both drives, NaN where unknown; ``driven (M,)``.
    """
    is_known = np.isfinite(way[:, 0])
    off_m = np.asarray(cKDTree(saved[np.isfinite(saved[:, 0]), :2]).query(way[is_known, :2])[0])
    left = driven[is_known][off_m > KNOWN_M]
    return {
        "known_m": round(float(off_m[0]), 2) if len(off_m) else None,
        "stayed_m": round(float(left[0] if len(left) else driven[-1]), 2),
    }


def related(path: Path, saved: tuple[Any, Transform], own: tuple[Any, Transform], stamp_ns: float) -> Transform:
    """Return ``T_saved_own (N, 3)`` by the relations between scans of both drives, of the own near a time."""
    found = []
    for t_1, t_2, x, y, *_, theta in np.loadtxt(path):
        T_1_2 = np.array([x, y, theta])
        for t_saved, t_own, T in ((t_1, t_2, T_1_2), (t_2, t_1, se2.inverse(T_1_2))):
            k, j = (int(np.argmin(np.abs(way[0] - t * 1e9))) for way, t in ((saved, t_saved), (own, t_own)))
            off_ns = max(abs(saved[0][k] - t_saved * 1e9), abs(own[0][j] - t_own * 1e9))
            if off_ns <= STAMP_NS and abs(own[0][j] - stamp_ns) <= WITHIN_S * 1e9:
                found.append(se2.compose(se2.compose(saved[1][k], T), se2.inverse(own[1][j])))
    return np.array(found).reshape(-1, 3)


def referred(saved: tuple[Any, Transform], own: tuple[Any, Transform], stamp_ns: float) -> Transform:
    """Return ``T_saved_own (N, 3)`` by the reference: ``saved``, ``own`` are drives with their poses in it."""
    (saved_way, true_saved), (way, true_way), found = saved, own, []
    near = np.flatnonzero(np.isfinite(true_way[:, 0]) & (np.abs(way[0] - stamp_ns) <= WITHIN_S * 1e9))
    for j in near:
        apart_m = np.hypot(*(true_saved[:, :2] - true_way[j, :2]).T)  # NaN where the reference has no pose: sorted last
        for k in np.argsort(apart_m)[:PAIRS]:
            if apart_m[k] <= NEAR_M:
                T = se2.compose(saved_way[1][k], se2.between(true_saved[k], true_way[j]))
                found.append(se2.compose(T, se2.inverse(way[1][j])))
    return np.array(found).reshape(-1, 3)


def verdict(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return what must hold: how many of the saved places were found in time and rightly, and how many wrongly."""
    own = [row for row in rows if row["map"] == "own"]
    foreign = [row for row in rows if row["map"] == "foreign"]
    counted = [row for row in own if (row.get("known_m") or 0.0) <= KNOWN_M]
    found = [row for row in counted if row["found"]]
    wrong = [row for row in own if row.get("error_m", 0.0) > RIGHT_M or row.get("error_deg", 0.0) > RIGHT_DEG]
    in_time = [row for row in found if row not in wrong and row["metres"] <= DRIVEN_M]
    stayed = [row for row in counted if row["stayed_m"] >= DRIVEN_M]
    figures = {
        name: [round(float(np.percentile([row[name] for row in found if name in row], q)), 2) for q in (50, 95)]
        for name in ("seconds", "metres", "error_m", "error_deg")
        if any(name in row for row in found)
    }
    return {
        "own": len(own), "begin_where_saved": len(counted), "found": len(found), "in_time_and_right": len(in_time),
        "stayed": len(stayed), "stayed_in_time": sum(row in in_time for row in stayed),
        "wrong": len(wrong), "foreign": len(foreign), "foreign_found": sum(row["found"] for row in foreign),
        "median_and_95th_percentile": figures,
    }  # fmt: skip


def hint(name: str, saved: Path, robot: Path, data: Path, kind: str) -> list[float]:
    """Return where a robot began in the saved map, as a finger on a map would tell it, or a wrong place."""
    truth = read_tum(data / f"slam/{name}.reference.tum")
    way, saved_way = read_tum(robot / "trajectory.tum"), read_tum(saved / "trajectory.tum")
    true_saved, true_way = at(truth, saved_way[0]), at(truth, way[0])
    j = int(np.flatnonzero(np.isfinite(true_way[:, 0]))[0])
    k = int(np.nanargmin(np.hypot(*(true_saved[:, :2] - true_way[j, :2]).T)))
    T_saved_then = se2.compose(saved_way[1][k], se2.between(true_saved[k], true_way[j]))
    x, y, _ = se2.compose(T_saved_then, se2.between(way[1][j], way[1][0]))
    off = 0.4 if kind == "right" else 15.0
    return [round(float(x) + off, 2), round(float(y) - 0.3, 2)]


def runs(name: str, cuts: int) -> list[tuple[bool, dict[str, Any]]]:
    """Return (is the saved map foreign, what the robot plays) of a building's runs."""
    if ":" in name:
        return [(is_foreign, {"world": name, "seed": 100 + k}) for is_foreign in (False, True) for k in range(cuts)]
    if name in DAYS:
        log, shares = DAYS[name].format(2), np.arange(cuts) / cuts
    else:
        log, saved_from, _ = HALVES[name]
        shares = 0.5 - saved_from + 0.45 * np.arange(cuts) / cuts
    plays = [{"log": log, "first": float(share), "last": 1.0} for share in shares]
    return [(is_foreign, one) for is_foreign in (False, True) for one in plays]


def main() -> None:
    """Play every building and cut asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=[*HALVES, *DAYS])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("MRSLAM_DATA", "../shared/data")))
    parser.add_argument("--half", type=int, choices=(1, 2), default=1, help="which half of a log is saved")
    parser.add_argument("--cuts", type=int, default=6)
    parser.add_argument("--seconds", type=float, default=150.0)
    parser.add_argument("--near", choices=("right", "wrong"))
    parser.add_argument("--survey", type=float, default=SURVEY_S)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    if options.half == 2:
        HALVES.update({name: (log, 0.5, 1.0) for name, (log, *_) in HALVES.items()})
    rows = []
    for number, name in enumerate(options.names):
        for is_foreign, begins in runs(name, options.cuts):
            other = NEXT.get(name) or options.names[number - 1]
            if is_foreign and (other == name or options.near):
                continue
            saved = save(other if is_foreign else name, options.out, options.survey)
            kind = "foreign" if is_foreign else "own"
            first = begins.get("first", begins.get("seed"))
            folder, near = options.out / f"{name.replace(':', '-')}-{kind}-{first:.3f}", None
            if options.near:
                if name not in HALVES:
                    continue
                near = hint(name, saved, play(folder, begins, saved, 10.0), options.data, options.near)
                folder = folder.with_name(f"{folder.name}-{options.near}")
            before_s = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
            robot = play(folder, begins, saved, options.seconds, near)
            cpu_s = round(sum(resource.getrusage(resource.RUSAGE_SELF)[:2]) - before_s, 1)
            row = {"building": name, "map": kind, "near": near, "first": round(first, 3), "cpu_s": cpu_s}
            rows.append({**row, **judge(name, saved, robot, options.data, is_foreign)})
            print(json.dumps(rows[-1]), flush=True)
    print(json.dumps(verdict(rows)))


if __name__ == "__main__":
    main()
