"""Alignment on pairs of partial maps with known transforms, one JSON line per method.

    python bench/alignment.py [--pairs DIR] [--method auto] [--every 1] [--predictions OUT.json]

``--method`` may be given several times, or be ``all``; ``--every 3`` takes every third pair, for slow ones.
OUT.json maps pair ids to ``{tx, ty, theta, accepted, confidence, time}``.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
import time
from pathlib import Path

import numpy as np

from mrslam import alignment
from mrslam.sim_driver.missions.usage import peak_kb
from mrslam.spatial import read_map, se2

LOOSE, STRICT = (0.5, math.radians(5.0)), (0.15, math.radians(1.0))


def default_pairs() -> Path:
    root = os.environ.get("MRSLAM_DATA", str(Path(__file__).parents[2] / "shared" / "data"))
    return Path(root) / "pairs"


def run(folder: Path, method: str, every: int = 1) -> tuple[dict[str, object], dict[str, dict[str, object]]]:
    """Align every pair; return the summary and the predictions."""
    pairs = json.loads((folder / "index.json").read_text())["pairs"][::every]
    rows, predictions, wall_s, cpu_s = [], {}, [], []
    for pair in pairs:
        a, b = (read_map(folder / pair["file"], key) for key in "ab")
        wall, cpu = time.perf_counter(), time.process_time()
        found = alignment.align(a, b, method=method)
        wall_s.append(time.perf_counter() - wall)
        cpu_s.append(time.process_time() - cpu)
        accepted = isinstance(found, alignment.Alignment)
        predictions[pair["id"]] = {"accepted": accepted, "confidence": found.confidence, "time": cpu_s[-1]}
        if found.T_a_b is not None:
            predictions[pair["id"]] |= dict(zip(("tx", "ty", "theta"), map(float, found.T_a_b), strict=True))
        apart = (math.inf, math.inf)
        if pair["gt"] and found.T_a_b is not None:
            T = np.array([pair["gt"][k] for k in ("tx", "ty", "theta")])
            at = np.array(pair["eval_point_b"])
            apart = (
                float(np.hypot(*(se2.apply(found.T_a_b, at) - se2.apply(T, at)))),
                se2.difference(found.T_a_b, T)[1],
            )
        rows.append((pair["bin"], pair["negative"], accepted, apart, "aliased" in pair["tags"]))

    def block(chosen: list[tuple[float, bool, bool, tuple[float, float], bool]]) -> dict[str, float]:
        within = [
            (acc, e[0] < LOOSE[0] and e[1] < LOOSE[1], e[0] < STRICT[0] and e[1] < STRICT[1])
            for _, _, acc, e, _ in chosen
        ]
        n = max(len(chosen), 1)
        return {
            "n": len(chosen),
            "success": round(sum(acc and ok for acc, ok, _ in within) / n, 3),
            "strict": round(sum(acc and ok for acc, _, ok in within) / n, 3),
            "wrong": sum(acc and not ok for acc, ok, _ in within),
        }

    clear = [r for r in rows if not r[4]]
    bins = sorted({r[0] for r in rows if not r[1]}, reverse=True)
    summary: dict[str, object] = {
        "method": method,
        "pairs": len(rows),
        "bins": {str(b): block([r for r in clear if r[0] == b and not r[1]]) for b in bins},
        "all": block([r for r in clear if not r[1]]),
        "false_accepts": sum(r[2] for r in clear if r[1]),
        "negatives": sum(r[1] for r in clear),
        "aliased": {
            **block([r for r in rows if r[4] and not r[1]]),
            "false_accepts": sum(r[2] for r in rows if r[4] and r[1]),
            "negatives": sum(r[1] for r in rows if r[4]),
        },
        "wall_s": {"median": round(float(np.median(wall_s)), 4), "p95": round(float(np.quantile(wall_s, 0.95)), 4)},
        "cpu_s": {
            "median": round(float(np.median(cpu_s)), 4),
            "p95": round(float(np.quantile(cpu_s, 0.95)), 4),
            "max": round(max(cpu_s), 4),
        },
        "peak_rss_mb": round(peak_kb() / 1024, 1),
        "python": platform.python_version(),
        "numpy": np.__version__,
    }
    return summary, predictions


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--pairs", type=Path, default=None, help="folder with index.json and pairs/ (default: the recorded data's)"
    )
    parser.add_argument("--method", action="append", choices=[*alignment.ALIGNERS, "all"], help="default: auto")
    parser.add_argument("--every", type=int, default=1, help="take every so manieth pair")
    parser.add_argument("--predictions", type=Path, help="write the predictions of the last method here")
    args = parser.parse_args()
    alignment.warm_up()
    methods = args.method or ["auto"]
    for method in list(alignment.ALIGNERS) if "all" in methods else methods:
        summary, predictions = run(args.pairs or default_pairs(), method, args.every)
        print(json.dumps(summary), flush=True)
        if args.predictions:
            args.predictions.write_text(json.dumps(predictions))


if __name__ == "__main__":
    main()
