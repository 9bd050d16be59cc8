"""Hours of mission time in the virtual shell: what memory, threads and open files do, as one JSON line.

    python -m bench.endurance [--hours 2] [--robots 2] [--world office] [--particles 30] [--samples OUT.csv]

The robots patrol between a few places for ever, so that after the first rounds nothing is left to be discovered: memory
that goes on growing then grows with time. ``last_quarter`` is the least-squares slope of the resident memory over the
last quarter, MB an hour, with its standard error; ``noise_mb`` is what is left of that quarter without the slope.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import Progress

from bench.patrol import patrol
from mrslam.sim_driver.kernels import ensure_compiled
from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.run.run_virtual import VirtualTeam, run_in_virtual_time

SAMPLE_S = 30.0


def long_patrol(options: argparse.Namespace) -> Mission:
    """Return a mission of hours whose robots drive in rounds, each its own."""
    tables = {
        "mission": {"name": "endurance", "shell": "virtual", "seed": options.seed, "record": False,
                    "duration_s": 3600.0 * options.hours},
        "world": {"name": options.world},
        "robots": [{"id": f"r{i + 1}"} for i in range(options.robots)],
        "rbpf": {"particles": options.particles, "threads": 1},
        "comms": {"exchange_timeout_s": 30.0},
    }  # fmt: skip
    return patrol(tables, "endurance")


def resident_mb() -> float:
    """Return this process's resident memory."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def main() -> None:
    """Run and tell."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=2.0)
    parser.add_argument("--robots", type=int, default=2)
    parser.add_argument("--world", default="office")
    parser.add_argument("--particles", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--samples", type=Path, help="CSV of all samples")
    options = parser.parse_args()
    console = Console(stderr=True)
    ensure_compiled(console.print)
    samples: list[tuple[float, float, int, int]] = []
    begun_s = time.monotonic()

    def watch(team: VirtualTeam, now_ns: int) -> None:
        if now_ns / 1e9 >= SAMPLE_S * len(samples):
            files = len(list(Path("/proc/self/fd").iterdir()))
            samples.append((now_ns / 1e9, resident_mb(), threading.active_count(), files))

    with tempfile.TemporaryDirectory() as folder, Progress(console=console) as bar:
        task = bar.add_task("mission", total=3600.0 * options.hours)
        metrics = run_in_virtual_time(
            long_patrol(options), Path(folder), lambda now_s, total_s, text: bar.update(task, completed=now_s), watch
        )
    rows = np.array(samples)
    if options.samples is not None:
        np.savetxt(options.samples, rows, delimiter=",", header="mission_s,resident_mb,threads,files", fmt="%.3f")
    print(json.dumps({"what": "endurance", **figures(rows), "mission_s": metrics["mission_s"],
                      "wall_s": round(time.monotonic() - begun_s, 1), "robots": options.robots}))  # fmt: skip


def figures(rows: np.ndarray) -> dict[str, object]:
    """Return what the samples say."""
    last = rows[rows[:, 0] >= 0.75 * rows[-1, 0]]
    hours = (last[:, 0] - last[:, 0].mean()) / 3600.0
    slope = float(hours @ last[:, 1] / (hours @ hours))
    rest = last[:, 1] - last[:, 1].mean() - slope * hours
    error = float(np.sqrt(rest @ rest / (len(rest) - 2) / (hours @ hours)))
    quarters = [part.round(1).tolist() for part in (chunk[:, 1].mean() for chunk in np.array_split(rows, 4))]
    return {
        "resident_mb_by_quarter": quarters,
        "last_quarter": {"mb_an_hour": round(slope, 2), "error": round(error, 2)},
        "noise_mb": round(float(rest.std()), 2),
        "threads": [int(rows[:, 2].min()), int(rows[:, 2].max())],
        "files": [int(rows[:, 3].min()), int(rows[:, 3].max())],
    }


if __name__ == "__main__":
    main()
