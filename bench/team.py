"""A team of real processes in real time, as one JSON line: age of scans when they are mapped, memory and CPU of robots.

    python bench/team.py [--robots 4] [--seconds 120] [--world office] [--speed 1] [--seed 1] [--out DIR]

``scan_age_ms`` is wall time from the simulated sweep to the end of its mapping, the worst of the robots; CPU is in
seconds a second of the mission; ``scans_lost`` are sweeps a robot was too slow to take. ``load_before`` tells what else
the machine did.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path

from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.run.run import run_mission


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, default=4)
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--world", default="office")
    parser.add_argument("--speed", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    tables = {
        "mission": {"name": "bench-team", "seed": args.seed, "duration_s": args.seconds, "speed": args.speed},
        "world": {"name": args.world},
        "robots": [{"id": f"r{i + 1}"} for i in range(args.robots)],
        "comms": {"exchange_timeout_s": 10.0},
    }
    load_before = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as scratch:
        out = args.out or Path(scratch)
        mission = make_mission(tables, Path("bench-team.toml"))
        metrics = run_mission(mission, out, lambda *_: None, lambda text: print(text, file=sys.stderr))
        usage = [json.loads((out / f"r{i + 1}" / "usage.json").read_text()) for i in range(args.robots)]
    ages = [robot["scan_age_ms"] for robot in usage]
    seconds = metrics["mission_s"]
    row = {
        "robots": args.robots,
        "mission_s": seconds,
        "wall_s": metrics["wall_s"],
        "scan_age_ms": {name: max(age[name] for age in ages) for name in ("p50", "p99", "max")},
        "scans": sum(robot["scans"] for robot in metrics["robots"]),
        "scans_lost": sum(metrics["scans_lost"].values()),
        "peak_rss_mb": max(robot["peak_rss_mb"] for robot in usage),
        "cpu_a_robot": round(max(robot["cpu_s"] for robot in usage) / seconds, 3),
        "pairs_merged": sum(pair["status"] == "accepted" for pair in metrics["pairs"]),
        "team": metrics["team"],
        "load_before": round(load_before, 2),
        "cores": len(os.sched_getaffinity(0)),
    }
    print(json.dumps(row))


if __name__ == "__main__":
    main()
