"""Relocalisation in saved maps of recorded buildings: one JSON line a run.

    python bench/relocalise.py --out DIR [--cuts 6] [--seconds 150] [--near right|wrong] [BUILDING ...]

The first half of a log (of isr and arena: the first of two) is mapped and saved. Robots that begin at places
of the rest look for themselves in it and in the saved map of another building (``foreign``), for ``--seconds`` at most.

seconds, metres : mission time and path until the event "localised"; None where it never came.
error_m, error_deg : of the pose in the saved map then. Expected is the saved trajectory's pose nearest by, moved by
what the reference trajectory has between the two; isr has none, but its robot stood still
between the two logs, so the second log's trajectory, mapped whole, continues the first's.
known_m : from the robot's true start to the nearest place of the saved trajectory; far off, there is nothing to find.
--near : robots are told where they begin in the saved map, half a metre off, or a place 15 m away from that, without a
heading (intel, mit-csail and aces, whose reference knows it).
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
from pathlib import Path
from typing import Any

import numpy as np

from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.run.run import run_mission
from mrslam.spatial import read_tum, se2
from mrslam.spatial.se2 import Transform

HALVES = {name: (f"slam/{name}.clf.gz", 0.0, 0.5) for name in ("intel", "aces", "mit-csail")}
DAYS = {"isr": "multi_session/isr_small_raw_{}.clf.gz", "arena": "multi_session/arena_raw_{}.clf.gz"}
NEXT = {"intel": "mit-csail", "mit-csail": "aces", "aces": "intel", "isr": "arena", "arena": "isr"}
"""Building -> another, whose map is foreign there."""
NEAR_S = 0.2


def play(
    folder: Path, robot: dict[str, Any], saved: Path | None, seconds: float | None, near: list[float] | None = None
) -> Path:
    """Run a mission of one robot in virtual time; return the robot's folder."""
    tables: dict[str, Any] = {"mission": {"shell": "virtual", "seed": 1, "linger_s": 1.0}}
    tables["robots"] = [{"id": "r1", **robot}]
    if seconds is not None:
        tables["mission"]["duration_s"] = seconds
    if saved is not None:
        tables["maps"] = [{"path": str(saved.resolve()), "id": "saved@map"} | ({"near": near} if near else {})]
    mission = make_mission(tables, folder.parent / f"{folder.name}.toml")
    run_mission(mission, folder, lambda *_: None, lambda text: print(text, file=sys.stderr))
    return folder / "r1"


def save(name: str, out: Path) -> Path:
    """Return the folder of a building's saved map; it is made where it is not there."""
    log, first, last = HALVES.get(name) or (DAYS[name].format(1), 0.0, 1.0)
    folder = out / f"saved-{name}"
    done = folder / "r1"
    return (
        done if (done / "map.yaml").exists() else play(folder, {"log": log, "first": first, "last": last}, None, None)
    )


def second_day(name: str, out: Path) -> Path:
    """Return the folder of the second log mapped whole, from where the first ended."""
    done = out / f"second-{name}" / "r1"
    return done if (done / "map.yaml").exists() else play(done.parent, {"log": DAYS[name].format(2)}, None, None)


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
    if truth is not None:
        true_saved, true_way = at(truth, saved_way[0]), at(truth, way[0])
        start = true_way[np.isfinite(true_way[:, 0])][:1, :2]
        row["known_m"] = round(float(np.nanmin(np.hypot(*(true_saved[:, :2] - start).T))), 2) if len(start) else None
    if found is None:
        return {**row, "seconds": None, "metres": None}
    until = way[0] <= way[0][0] + found["t"] * 1e9
    row["seconds"] = found["t"]
    row["metres"] = round(float(np.hypot(*np.diff(way[1][until, :2], axis=0).T).sum()), 2)
    T_base_laser = way[1][0]  # for the map begins where the base did
    T_saved_laser = se2.compose(np.array([found["x_m"], found["y_m"], found["theta_rad"]]), T_base_laser)
    if truth is not None:
        j = int(np.flatnonzero(until & np.isfinite(true_way[:, 0]))[-1])  # the reference has few scans of some logs
        now = true_way[j]
        k = int(np.nanargmin(np.hypot(*(true_saved[:, :2] - now[:2]).T)))
        T_then_now = se2.between(way[1][j], way[1][until][-1])
        expected = se2.compose(saved_way[1][k], se2.compose(se2.between(true_saved[k], now), T_then_now))
    elif name == "isr" and not is_foreign:
        whole = read_tum(second_day(name, saved.parents[1]) / "trajectory.tum")
        expected = se2.compose(saved_way[1][-1], se2.between(whole[1][0], at(whole, way[0][until][-1:])[0]))
    else:
        return row
    off = se2.between(expected, T_saved_laser)
    row["error_m"], row["error_deg"] = round(float(np.hypot(*off[:2])), 3), round(float(np.degrees(abs(off[2]))), 2)
    return row


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


def runs(name: str, cuts: int) -> list[tuple[bool, str, float]]:
    """Return (is the saved map foreign, log, share of it where the robot begins) of a building's runs."""
    if name in DAYS:
        log, shares = DAYS[name].format(2), np.arange(cuts) / cuts
    else:
        log, shares = HALVES[name][0], 0.5 + 0.45 * np.arange(cuts) / cuts
    return [(is_foreign, log, float(share)) for is_foreign in (False, True) for share in shares]


def main() -> None:
    """Play every building and cut asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=[*HALVES, *DAYS])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--cuts", type=int, default=6)
    parser.add_argument("--seconds", type=float, default=150.0)
    parser.add_argument("--near", choices=("right", "wrong"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    for name in options.names:
        for is_foreign, log, first in runs(name, options.cuts):
            saved = save(NEXT[name] if is_foreign else name, options.out)
            kind = "foreign" if is_foreign else "own"
            before_s = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
            folder = options.out / f"{name}-{kind}-{first:.3f}"
            begins, near = {"log": log, "first": first, "last": 1.0}, None
            if options.near and (is_foreign or name not in HALVES):
                continue
            if options.near:
                without = folder if (folder / "r1").exists() else play(folder, begins, saved, 10.0).parent
                near = hint(name, saved, without / "r1", options.data, options.near)
                folder = folder.with_name(f"{folder.name}-{options.near}")
            robot = play(folder, begins, saved, options.seconds, near)
            cpu_s = round(sum(resource.getrusage(resource.RUSAGE_SELF)[:2]) - before_s, 1)
            row = {"building": name, "map": kind, "near": near, "first": round(first, 3), "cpu_s": cpu_s}
            print(json.dumps({**row, **judge(name, saved, robot, options.data, is_foreign)}), flush=True)


if __name__ == "__main__":
    main()
