"""Table 1 of Carpin, Birk and Jucikas (2005) on our maps: dissimilarity reached by each search at 2000 evaluations.

    python bench/carpin_table.py [--pairs DIR] [--cases p030 p144 p126 p183] [--runs 50] [--lattice 200000]

Brute force looks at a lattice of ``--lattice`` transforms and then climbs down from its best; the others'
figures are means over runs with other seeds. One JSON line per case, then a table.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from pathlib import Path

import numpy as np

from mrslam.alignment import AlignmentConfig
from mrslam.alignment.prepared import prepare, working_resolution
from mrslam.alignment.proposals import walks
from mrslam.alignment.proposals.dissimilarity import Dissimilarity
from mrslam.spatial import read_map

SEARCHES = {
    "algorithm 2": walks.multi_point_hill_climb,
    "hill climbing": walks.hill_climb,
    "algorithm 3": walks.simulated_annealing,
    "annealing": walks.annealing,
    "random walk": walks.plain_walk,
    "adaptive": walks.adaptive_walk,
}


def case(path: Path, runs: int, evaluations: int, lattice: int) -> dict[str, float]:
    """Return the psi each search reaches on one pair of maps."""
    grids = [read_map(path, key).cropped() for key in "ab"]
    res = working_resolution(grids[0], grids[1], AlignmentConfig())
    a, b = (prepare(grid, res) for grid in grids)
    psi = Dissimilarity(a, b, 0.4)
    start, low, high = walks.bounds(a, b, None)

    def objective(s: np.ndarray) -> float:
        return psi(walks.about(s, b))

    visited = walks.brute_force(objective, start, low, high, lattice, np.random.default_rng(0))
    best = visited[np.argmin(visited[:, 3])]
    reach = (high - low) / 40.0
    fine = walks.hill_climb(objective, best[:3], best[:3] - reach, best[:3] + reach, 3000, np.random.default_rng(0))
    row = {"brute force": float(min(best[3], fine[:, 3].min()))}
    for name, search in SEARCHES.items():
        found = [
            search(objective, start, low, high, evaluations, np.random.default_rng(k))[:, 3].min() for k in range(runs)
        ]
        row[name] = float(np.mean(found))
        row[f"{name} sd"] = float(np.std(found))
    return row


def main() -> None:
    root = Path(os.environ.get("MRSLAM_DATA", str(Path(__file__).parents[2] / "shared" / "data")))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=Path, default=root / "pairs")
    parser.add_argument("--cases", nargs="+", default=["p030", "p144", "p126", "p183"])
    parser.add_argument("--runs", type=int, default=50)
    parser.add_argument("--evaluations", type=int, default=2000)
    parser.add_argument("--lattice", type=int, default=200_000)
    args = parser.parse_args()
    rows = {}
    for name in args.cases:
        began = time.process_time()
        rows[name] = case(args.pairs / "pairs" / f"{name}.npz", args.runs, args.evaluations, args.lattice)
        print(json.dumps({"case": name, "cpu_s": round(time.process_time() - began, 1)} | rows[name]), flush=True)
    columns = ["brute force", *SEARCHES]
    print("| case | " + " | ".join(columns) + " |\n|" + "---|" * (len(columns) + 1))
    for name, row in rows.items():
        print(f"| {name} | " + " | ".join(f"{row[c]:.2f}" for c in columns) + " |")


if __name__ == "__main__":
    main()
