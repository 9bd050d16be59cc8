"""The source's experiments and the office with one to six robots, ten seeds each: figures, a table and a plot.

    python bench/experiments.py --out DIR [--only arena1 office-3 ...] [--seeds 10]

One line a run goes to ``DIR/runs.jsonl``; what is there already is not run again, so that it can be stopped at any
time. ``DIR/table.md`` sums up; ``DIR/coverage.png`` (with matplotlib) shows how much the best informed robot knows over
time.

agree : share of the occupied cells of a robot's team map within two cells of a true wall (cells of the robots' own
maps), the worst robot; the map is laid over the world as a whole, for where its frame lies is judged by the errors.
coverage : share of the reachable floor known to be free, the best robot; explored : known at all (the rim of the floor,
half a cell from a wall, often counts as wall). pairs aligned : of two robots whose maps are aligned with each other;
error : of their transforms against the true starts. in one map : pairs of which each robot has the other in its team
map, by itself or through third robots; way : how far the other's trajectory in it is off the true one, where the own
one lies on its own, the mean over a trajectory.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from experiments_table import draw, summary  # beside this file; must come before the next line
from scipy.spatial import cKDTree

from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.evaluate.trajectories import fit, matched
from mrslam.sim_driver.evaluate.truth import MUST_MERGE, field_at, is_false_merge, overlap, values_at
from mrslam.sim_driver.missions.mission import Mission, load_mission, make_mission
from mrslam.sim_driver.robots import LASERS
from mrslam.sim_driver.run.run import run_mission
from mrslam.sim_driver.simulation.simulation import make_world
from mrslam.sim_driver.worlds import World
from mrslam.spatial import OccupancyGrid, read_map, se2
from mrslam.spatial.distance import euclidean
from mrslam.spatial.files.tum import read_tum
from mrslam.spatial.se2 import Transform

HERE = Path(__file__).resolve().parent

MISSIONS = HERE.parent / "missions"
OFFICE = {"mission": {"shell": "virtual", "duration_s": 400.0, "linger_s": 15.0}, "world": {"name": "office"},
          "comms": {"exchange_timeout_s": 10.0}}  # fmt: skip


def mission_of(name: str, seed: int) -> Mission:
    """Return an experiment's mission: one of the shipped ones, or ``office-N``."""
    options = [f"mission.seed={seed}", "mission.record=false"]
    if not name.startswith("office-"):
        return load_mission(MISSIONS / f"{name}.toml", options)
    robots = [{"id": f"r{i + 1}"} for i in range(int(name.partition("-")[2]))]
    tables = {**OFFICE, "mission": {**OFFICE["mission"], "seed": seed, "record": False}, "robots": robots}
    return make_mission(tables, Path(f"{name}.toml"))


EXPERIMENTS = ("arena1", "arena2-two", "arena2-three", *(f"office-{n}" for n in range(1, 7)))


def run(name: str, seed: int) -> dict[str, Any]:
    """Run one experiment with one seed and return its figures."""
    mission = mission_of(name, seed)
    cpu = time.process_time()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        metrics = run_mission(mission, folder, lambda *_: None, lambda text: print(text, file=sys.stderr))
        figures = judge(mission, folder, metrics)
    return {"name": name, "seed": seed, **figures, "cpu_s": round(time.process_time() - cpu, 1)}


def judge(mission: Mission, folder: Path, metrics: dict[str, Any]) -> dict[str, Any]:
    """Return what a finished run is worth."""
    world = make_world(mission)
    near_m = 2.0 * mission.settings.rbpf.resolution_m
    frames, own, agree, coverage, explored = {}, {}, {}, {}, {}
    for robot in mission.robots:
        frames[robot.id] = frame(folder / robot.id, LASERS[robot.laser].T_base_laser)
        own[robot.id] = read_map(folder / robot.id / "map.yaml")
        team = read_map(folder / robot.id / "team_map.yaml")
        T_world_team = laid_over(world, team, frames[robot.id])
        agree[robot.id], coverage[robot.id], explored[robot.id] = against(world, team, T_world_team, near_m)
    pairs, false, missed = [], 0, 0
    accepted = {(pair["a"], pair["b"]): pair for pair in metrics["pairs"] if pair["status"] == "accepted"}
    for a, b in combinations(sorted(own), 2):
        pair = accepted.get((a, b))
        shared = overlap(own[a], own[b], frames[a], frames[b])
        if pair is None:
            missed += shared >= MUST_MERGE
            continue
        off_m, off_deg = pair["error_m"], pair["error_deg"]
        false += is_false_merge(off_m, off_deg)
        pairs.append([a, b, off_m, off_deg, pair["accepted_at_s"]])
    ways = ways_in_team_maps(RunResults.read(folder))
    rejected = [[p["a"], p["b"], p["reason"]] for p in metrics["pairs"] if p["status"] != "accepted"]
    return {
        "mission_s": metrics["mission_s"], "agree": round(min(agree.values()), 4),
        "coverage": round(max(coverage.values()), 4), "explored": round(max(explored.values()), 4),
        "pairs": pairs, "ways": ways, "rejected": rejected, "missed_merges": missed,
        "false_merges": false + sum(is_false_merge(*off) for _, _, *off in ways),
        "one_sided": sum(pair["both_at_s"] is None for pair in accepted.values()),
        "known": known_over_time(folder),
    }  # fmt: skip


def ways_in_team_maps(run: RunResults) -> list[list[Any]]:
    """Return [robot, teammate, m, deg]: how far a teammate's trajectory in a robot's team map is off, in the mean."""
    rows = []
    truth = {robot: way for robot in sorted(run.robots) if (way := run.laser_truth(robot)) is not None}
    for a in truth:
        placed = run.team_trajectories(a)
        T_world_team = fit(placed[a], truth[a]) if a in placed else None
        if T_world_team is None:
            continue
        for b in sorted(placed.keys() & truth.keys() - {a}):
            _, ours, theirs = matched(placed[b], truth[b])
            off = se2.compose(T_world_team, ours) - theirs
            off_deg = np.degrees(np.abs(se2.wrap(off[:, 2])))
            rows.append([a, b, round(float(np.hypot(*off[:, :2].T).mean()), 4), round(float(off_deg.mean()), 4)])
    return rows


def frame(folder: Path, T_base_laser: tuple[float, float, float]) -> Transform:
    """Return ``T_world_map`` that lays a robot's mapped path over the true one."""
    (stamps, poses), (true_stamps, true_poses) = read_tum(folder / "trajectory.tum"), read_tum(folder / "truth.tum")
    _, i, k = np.intersect1d(stamps, true_stamps, return_indices=True)
    true_laser = se2.compose(true_poses[k], np.array(T_base_laser))
    fitted = se2.fit_rigid(true_laser[:, :2], poses[i][:, :2])
    path_m = float(np.hypot(*np.ptp(true_laser[:, :2], axis=0)))
    return fitted if path_m > 1.0 else true_poses[0]


def laid_over(world: World, team: OccupancyGrid, T_world_map: Transform) -> Transform:
    """Return the place of a map where its walls are nearest to the true ones: a few steps from where its robot was."""
    true_walls = world.grid.centres(world.is_wall)
    tree, points = cKDTree(true_walls), team.centres(team.is_occupied)
    for _ in range(10):
        away_m, nearest = tree.query(se2.apply(T_world_map, points))
        close = away_m < 0.4
        if close.sum() < 10:
            break
        T_world_map = se2.fit_rigid(true_walls[nearest[close]], points[close])
    return T_world_map


def against(world: World, team: OccupancyGrid, T_world_map: Transform, near_m: float) -> tuple[float, float, float]:
    """Return which share of a map's walls is near true ones, of the floor is known to be free, and is known at all."""
    # A laser's noise puts walls outside the world, too.
    rim = round(1.0 / world.resolution_m)
    far_m = euclidean(np.pad(world.is_wall, rim)) * world.resolution_m
    x0, y0 = world.grid.origin_m
    around = OccupancyGrid(np.pad(world.grid.cells, rim), world.resolution_m, (x0 - 1.0, y0 - 1.0))
    walls = se2.apply(T_world_map, team.centres(team.is_occupied))
    floor = se2.apply(se2.inverse(T_world_map), world.grid.centres(world.reachable))
    near = field_at(around, far_m, walls) <= near_m + 1e-6
    known = values_at(team, floor)
    free = (known >= 0) & (known <= 35)
    return float(near.mean()) if len(near) else 1.0, float(free.mean()), float((known >= 0).mean())


def known_over_time(folder: Path) -> list[list[float]]:
    """Return [mission s, m2] of the largest team map, as it was reported; times in tens of seconds."""
    best: dict[float, float] = {}
    for path in folder.glob("*/events.jsonl"):
        for line in path.read_text().splitlines():
            event = json.loads(line)
            if event["event"] == "known":
                t = round(event["t"], -1)
                best[t] = max(best.get(t, 0.0), event["team_m2"])
    return [[t, best[t]] for t in sorted(best)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", nargs="+", default=list(EXPERIMENTS), choices=EXPERIMENTS)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--show", action="store_true", help="only sum up what is there")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    log = args.out / "runs.jsonl"
    rows = [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else []
    done = {(row["name"], row["seed"]) for row in rows}
    for seed in range(1, args.seeds + 1):
        for name in args.only:
            if (name, seed) in done or args.show:
                continue
            rows.append(run(name, seed))
            with log.open("a") as file:
                file.write(json.dumps(rows[-1]) + "\n")
            print(json.dumps({key: value for key, value in rows[-1].items() if key != "known"}), flush=True)
    (args.out / "table.md").write_text(summary(rows, EXPERIMENTS))
    draw(rows, args.out / "coverage.png")
    print(summary(rows, EXPERIMENTS))


if __name__ == "__main__":
    main()
