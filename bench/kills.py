"""A team of real processes, killed again and again, against the same team left in peace, as one JSON line.

    python bench/kills.py [--robots 4] [--kills 20] [--seconds 240] [--seeds 1 2 3] [--world office] [--out DIR]

``mission.restart`` is on: whoever dies is started again from its checkpoint. For each seed the mission runs twice; the
kills come at random moments between a tenth and nine tenths of it, SIGKILL, to a random robot. Told are the best team
map's coverage, merge errors (by where the maps began, and by their robots' whole ways: the alignments' own), trajectory
errors (means over the seeds), and that every robot ended well.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing as mp
import os
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np

from mrslam.sim_driver.evaluate import assess
from mrslam.sim_driver.kernels import ensure_compiled
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.run.run import run_mission


def tell(text: str) -> None:
    """Say it beside the result."""
    print(text, file=sys.stderr)


class Killer:
    """Kills robots' processes when mission time passes given moments."""

    def __init__(self, moments_s: list[float], rng: np.random.Generator) -> None:
        """Take when to strike, mission seconds."""
        self._moments_s, self._rng = sorted(moments_s), rng
        self.killed = 0

    def progress(self, now_s: float, total_s: float | None, text: str) -> None:
        """Strike what is due; called by the mission as it moves on."""
        while self._moments_s and now_s >= self._moments_s[0]:
            alive = sorted((p for p in mp.active_children() if p.name.startswith("mrslam-")), key=lambda p: p.name)
            if alive:
                os.kill(int(alive[int(self._rng.integers(len(alive)))].pid or 0), signal.SIGKILL)
                self.killed += 1
            self._moments_s.pop(0)


def play(options: argparse.Namespace, seed: int, kills: int) -> dict[str, float]:
    """Run one mission; return its figures."""
    tables = {
        "mission": {"name": "kills", "seed": seed, "duration_s": options.seconds, "restart": True},
        "world": {"name": options.world},
        "robots": [{"id": f"r{i + 1}"} for i in range(options.robots)],
        "comms": {"exchange_timeout_s": 10.0},
    }
    rng = np.random.default_rng(seed)
    killer = Killer(rng.uniform(0.1 * options.seconds, 0.9 * options.seconds, kills).tolist(), rng)
    with tempfile.TemporaryDirectory() as temporary:
        folder = (options.out or Path(temporary)) / f"seed{seed}_kills{kills}"
        metrics = run_mission(make_mission(tables, Path("kills.toml")), folder, killer.progress, tell)
        assessment = assess(folder)
    pairs = [pair for pair in assessment["pairs"] if pair["status"] == "accepted"]
    ate = [robot["trajectory"]["ate_rmse_m"] for robot in assessment["robots"].values() if robot.get("trajectory")]
    tell(f"seed {seed}, {killer.killed} kills: {metrics['team']}, restarts {metrics['restarts']}")
    return {
        "killed": killer.killed,
        "coverage": metrics["team"]["coverage"],
        "occupied_precision": metrics["team"]["occupied_precision"],
        "false_merges": metrics["team"]["false_merges"],
        "missed_merges": metrics["team"]["missed_merges"],
        "merge_error_m": mean_of(pairs, "error_m"),
        "merge_error_deg": mean_of(pairs, "error_deg"),
        "alignment_error_m": mean_of(pairs, "alignment_m"),
        "alignment_error_deg": mean_of(pairs, "alignment_deg"),
        "ate_m": float(np.mean(ate)) if ate else float("nan"),
        "ended_well": float(all(code == 0 for code in metrics["exit_codes"].values()) and not metrics["robots_lost"]),
        "threads_left": float(threading.active_count()),
    }


def mean_of(pairs: list[dict[str, Any]], key: str) -> float:
    """Return the mean over the pairs that were merged."""
    return float(np.mean([pair[key] for pair in pairs])) if pairs else float("nan")


def main() -> None:
    """Compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, default=4)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=240.0)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--world", default="office")
    parser.add_argument("--out", type=Path, help="folder that keeps the missions")
    options = parser.parse_args()
    ensure_compiled(tell)
    begun_s = time.monotonic()
    runs = {name: [play(options, seed, kills) for seed in options.seeds]
            for name, kills in (("peace", 0), ("kills", options.kills))}  # fmt: skip
    means = {name: {key: round(float(np.mean([row[key] for row in rows])), 4) for key in rows[0]}
             for name, rows in runs.items()}  # fmt: skip
    print(json.dumps({"what": "kills", "robots": options.robots, "seconds": options.seconds, "seeds": options.seeds,
                      **means, "wall_s": round(time.monotonic() - begun_s, 1)}))  # fmt: skip


if __name__ == "__main__":
    main()
