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
from typing import Any

import numpy as np

from mrslam import alignment
from mrslam.sim_driver.missions.usage import peak_kb
from mrslam.spatial import read_map, se2

KEY_POINT_M = 0.5
LOOSE, STRICT = (0.5, math.radians(5.0)), (0.15, math.radians(1.0))


def default_pairs() -> Path:
    root = os.environ.get("MRSLAM_DATA", str(Path(__file__).parents[2] / "shared" / "data"))
    return Path(root) / "pairs"


def apart_from(pair: dict[str, Any], T_a_b: np.ndarray | None) -> tuple[float, float]:
    """Return how far a transform is from the truth, metres at the middle of the overlap and radians."""
    if not pair["gt"] or T_a_b is None:
        return math.inf, math.inf
    T, at = np.array([pair["gt"][k] for k in ("tx", "ty", "theta")]), np.array(pair["eval_point_b"])
    return float(np.hypot(*(se2.apply(T_a_b, at) - se2.apply(T, at)))), se2.difference(T_a_b, T)[1]


def key_point_error_m(path: Path, T_a_b: np.ndarray | None) -> float | None:
    """Return the mean distance of annotated key points under a transform, metres; None where none are annotated."""
    with np.load(path) as pair:
        if "keypoints_a_m" not in pair or not len(pair["keypoints_a_m"]):
            return None
        if T_a_b is None:
            return math.inf
        return float(np.hypot(*(se2.apply(T_a_b, pair["keypoints_b_m"]) - pair["keypoints_a_m"]).T).mean())


def judged_by_key_points(rows: list[tuple[bool, bool, float | None]]) -> dict[str, float] | None:
    """Return how many are right by their key points (bent maps have no one transform), or None where there are none."""
    errors = [(accepted, error) for negative, accepted, error in rows if not negative and error is not None]
    if not errors:
        return None
    return {
        "n": len(errors),
        "right": sum(accepted and error <= KEY_POINT_M for accepted, error in errors),
        "wrong": sum(accepted and error > KEY_POINT_M for accepted, error in errors),
        "proposed": sum(error <= KEY_POINT_M for _, error in errors),
        "false_accepts": sum(accepted for negative, accepted, _ in rows if negative),
    }


def run(folder: Path, method: str, every: int = 1) -> tuple[dict[str, object], dict[str, dict[str, object]]]:
    """Align every pair; return the summary and the predictions."""
    pairs = json.loads((folder / "index.json").read_text())["pairs"][::every]
    rows, predictions, wall_s, cpu_s = [], {}, [], []
    by_key_points, ambiguous = [], 0
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
        rows.append((pair["bin"], pair["negative"], accepted, apart_from(pair, found.T_a_b), "aliased" in pair["tags"]))
        by_key_points.append((pair["negative"], accepted, key_point_error_m(folder / pair["file"], found.T_a_b)))
        ambiguous += isinstance(found, alignment.Rejection) and found.ambiguous

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
        "ambiguous": ambiguous,
        "key_points": judged_by_key_points(by_key_points),
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
