"""What a team costs by robots and minutes, in virtual time: one JSON line a run, then the fitted laws.

    python bench/scale.py [--robots 2 4 8 16] [--minutes 3] [--world office] [--seed 1] [--rows FILE]

CPU seconds are those of all robots together, without compiling, by room: ``simulation`` (lasers, radio, driving),
``mapping``, ``alignment`` (whole maps), ``joint`` (scans matched, poses solved), ``placing`` and ``drawing`` (team
maps), ``exchange`` (beacons, messages, coding), ``rest``. Bytes are those a robot sends in a minute, by lane.
``--rows`` adds the lines to a file, and the laws are fitted to all of it: y ~ n^p over robots at the same number of
minutes, where there are at least three numbers of robots.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from mrslam.agent import Agent
from mrslam.agent.effects import AlignJob
from mrslam.agent.shells import runner as runner_module
from mrslam.agent.shells.runner import Runner
from mrslam.agent.team import Team
from mrslam.comms import CommsNode
from mrslam.rbpf import Mapper
from mrslam.sim_driver.kernels import load_kernels
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.missions.usage import peak_kb
from mrslam.sim_driver.run.run import run_mission
from mrslam.sim_driver.simulation.simulated import SimulatedBody

ROOMS: dict[str, list[tuple[Any, str]]] = {
    "simulation": [(SimulatedBody, "sense"), (SimulatedBody, "act")],
    "mapping": [(Mapper, "update"), (Mapper, "snapshot")],
    "alignment": [(Runner, "_align")],
    "joint": [(runner_module, "join")],
    "placing": [(Team, "_place")],
    "drawing": [(Team, "map"), (Agent, "own_map")],
    "exchange": [(CommsNode, name) for name in ("on_message", "on_tick", "publish")],
}
"""By room: the calls whose time is its own; none of them calls another."""


def clocked(
    call: Callable[..., Any], room: str, spent_s: dict[str, float], calls: dict[str, int]
) -> Callable[..., Any]:
    """Return the same function, whose CPU time in its thread is added to a room's."""

    def timed(*args: Any, **kwargs: Any) -> Any:
        begin = time.thread_time()
        try:
            return call(*args, **kwargs)
        finally:
            spent_s[room] += time.thread_time() - begin
            calls[room] += 1

    return timed


def by_kind(align: Callable[..., Any], kinds: dict[str, int]) -> Callable[..., Any]:
    """Return the same method of :class:`Runner`, which counts alignments by what made them.

    ``searched`` : everywhere or by a prior; ``examined`` : at a place found before; ``hinted`` : at a teammate's hint,
    of which ``hints_failed`` were not followed by a search for rivals.
    """

    def counted(runner: Runner, job: AlignJob) -> Any:
        outcome = align(runner, job)
        kinds["hinted" if job.hinted_by is not None else "searched" if job.place is None else "examined"] += 1
        kinds["hints_failed"] += job.hinted_by is not None and not outcome.accepted
        return outcome

    return counted


def run(robots: int, minutes: float, world: str, seed: int) -> dict[str, Any]:
    """Play one mission and return its row."""
    load_kernels()
    spent_s: dict[str, float] = defaultdict(float)
    calls: dict[str, int] = defaultdict(int)
    kinds: dict[str, int] = dict.fromkeys(("searched", "examined", "hinted", "hints_failed"), 0)
    Runner._align = by_kind(Runner._align, kinds)
    for room, entries in ROOMS.items():
        for owner, name in entries:
            setattr(owner, name, clocked(getattr(owner, name), room, spent_s, calls))
    tables = {
        "mission": {"name": "bench-scale", "seed": seed, "duration_s": 60.0 * minutes, "shell": "virtual"},
        "world": {"name": world},
        "robots": [{"id": f"r{i + 1:02d}"} for i in range(robots)],
    }
    with tempfile.TemporaryDirectory() as scratch:
        begin, wall = time.process_time(), time.monotonic()
        metrics = run_mission(make_mission(tables, Path("bench-scale.toml")), Path(scratch), lambda *_: None, print)
        cpu_s, wall_s = time.process_time() - begin, time.monotonic() - wall
    sent = [robot["sent_bytes"] for robot in metrics["robots"]]
    spent_s["rest"] = cpu_s - sum(spent_s.values())
    return {
        "robots": robots, "minutes": minutes, "world": world, "seed": seed, "cpu_s": round(cpu_s, 1),
        "wall_s": round(wall_s, 1), "cpu_by_room_s": {room: round(spent_s[room], 2) for room in (*ROOMS, "rest")},
        "alignments": calls["alignment"], "by_kind": kinds, "joint_solutions": calls["joint"],
        "peak_rss_mb": round(peak_kb() / 1024),
        "bytes_a_robot_minute": {
            lane: round(sum(one[lane] for one in sent) / robots / minutes) for lane in ("beacon", "control", "bulk")
        },
        "pairs": len(metrics["pairs"]), "pairs_merged": sum(p["status"] == "accepted" for p in metrics["pairs"]),
        "most_placed": max(len(robot["placed"]) for robot in metrics["robots"]),
    }  # fmt: skip


def laws(rows: list[dict[str, Any]]) -> list[str]:
    """Return the fitted exponents over the number of robots, a line for each figure."""
    groups: dict[tuple[float, str], list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        groups[row["minutes"], row["world"]].append(row)
    lines = []
    for (minutes, world), group in sorted(groups.items()):
        if len({row["robots"] for row in group}) < 3:
            continue
        figures: dict[str, list[float]] = {
            "CPU of all": [row["cpu_s"] for row in group],
            **{f"CPU of {room}": [row["cpu_by_room_s"][room] for row in group] for room in (*ROOMS, "rest")},
            "alignments": [row["alignments"] for row in group],
            "memory": [row["peak_rss_mb"] for row in group],
            "bytes a robot": [sum(row["bytes_a_robot_minute"].values()) for row in group],
        }
        log_n = [math.log(row["robots"]) for row in group]
        for name, values in figures.items():
            if min(values) > 0:
                power = float(np.polyfit(log_n, np.log(values), 1)[0])
                lines.append(f"{world}, {minutes:g} min: {name} ~ robots^{power:.2f}")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", nargs="*", type=int, default=[2, 4, 8, 16])
    parser.add_argument("--minutes", nargs="+", type=float, default=[3.0])
    parser.add_argument("--world", default="office")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rows", type=Path, help="file that rows are added to; laws are fitted to all of it")
    args = parser.parse_args()
    rows = [json.loads(line) for line in args.rows.read_text().splitlines()] if args.rows and args.rows.exists() else []
    context = multiprocessing.get_context("spawn")  # a process a run: peak memory is the run's own
    for minutes in args.minutes:
        for robots in args.robots:
            with context.Pool(1) as pool:
                rows.append(pool.apply(run, (robots, minutes, args.world, args.seed)))
            print(json.dumps(rows[-1]), flush=True)
            if args.rows:
                with args.rows.open("a") as file:
                    file.write(json.dumps(rows[-1]) + "\n")
    print("\n".join(laws(rows)))


if __name__ == "__main__":
    main()
