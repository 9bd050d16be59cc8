"""How honest the mapper's covariance is: normalised error squared over simulated drives (Bar-Shalom et al. 2001, 5.4).

    python bench/nees.py --drives 50 --plot nees.png

Each drive is 120 m through a random office. At every 10 m the error of the pose, in the map whose first pose is the
truth's, is squared and normalised by ``Mapper.covariance``. If that were exact, the mean over the drives would be 3 (x,
y, heading) and lie within the bounds of chi2 in 95 of 100 benches. Larger: the mapper is too sure of itself; smaller:
it is too careful. One JSON line at the end.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from drives import simulated, way_along  # beside this file
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from scipy.stats import chi2
from surveys import free_inside, office, way_through

from mrslam import rbpf
from mrslam.spatial import se2

EVERY_M = 10.0
LASER_M = 8.0


def errors_of(seed: int, length_m: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return normalised errors squared ``(N,)`` and errors ``(N, 2)``, metres and radians, at every ``EVERY_M``."""
    rng = np.random.default_rng(seed)
    plan = office(seed, 30.0)
    inside, room = free_inside(plan.cells != 0)
    way = way_along([(float(x), float(y)) for x, y, _ in way_through(inside, room, length_m, rng)], rng)
    drive = simulated(plan, way, seed, LASER_M)
    mapper = rbpf.Mapper(rbpf.MapperConfig(threads=1), seed=seed)
    gone_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way[:, :2], axis=0).T))])
    squared, plain = [], []
    for k, reading in enumerate(drive.readings):
        mapper.update(reading.scan, reading.T_odom_base)
        if gone_m[k] >= EVERY_M * (len(squared) + 1) and len(squared) < int(length_m / EVERY_M):
            error = mapper.T_map_base - se2.between(way[0], way[k])
            error[2] = se2.wrap(error[2])
            squared.append(float(error @ np.linalg.solve(mapper.covariance, error)))
            plain.append((float(np.hypot(error[0], error[1])), abs(float(error[2]))))
    return np.array(squared), np.array(plain)


def plot(path: Path, at_m: NDArray[np.float64], mean: NDArray[np.float64], bounds: tuple[float, float]) -> None:
    """Draw the mean by distance, and the bounds it should keep."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(6.0, 3.0))
    axes.axhspan(*bounds, color="0.9", label="95 % of chi2")
    axes.plot(at_m, mean, marker="o", color="tab:blue", label="mean over drives")
    axes.set(xlabel="driven, m", ylabel="normalised error squared", ylim=(0.0, None))
    axes.legend()
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main() -> None:
    """Drive, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drives", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0, help="of the first drive; the others follow")
    parser.add_argument("--length", type=float, default=120.0, help="metres of a drive")
    parser.add_argument("--plot", type=Path, help="picture of the means")
    options = parser.parse_args()
    seeds = range(options.seed, options.seed + options.drives)
    found = [errors_of(seed, options.length) for seed in track(seeds, "drives", console=Console(stderr=True))]
    count = min(len(squared) for squared, _ in found)
    squared, plain = (np.array([one[k][:count] for one in found]) for k in (0, 1))
    low, high = (float(chi2.ppf(p, 3 * len(found)) / len(found)) for p in (0.025, 0.975))
    mean, at_m = squared.mean(axis=0), EVERY_M * np.arange(1, count + 1)
    if options.plot is not None:
        plot(options.plot, at_m, mean, (low, high))
    within = float((squared < chi2.ppf(0.95, 3)).mean())
    error_m, error_rad = (float(np.median(plain[..., k])) for k in (0, 1))
    line = {
        "what": "nees", "drives": len(found), "seed": options.seed, "bounds": [round(low, 2), round(high, 2)],
        "by_10_m": [round(float(value), 2) for value in mean], "mean": round(float(squared.mean()), 2),
        "median": round(float(np.median(squared)), 2), "within_95": round(within, 3),
        "error_m": round(error_m, 4), "error_deg": round(float(np.degrees(error_rad)), 3),
    }  # fmt: skip
    print(json.dumps(line))


if __name__ == "__main__":
    main()
