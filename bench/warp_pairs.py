"""Warp pairs of maps as other mappers warp them: scales that differ by up to 3 %, walls bent by 0.3 m over 10 m.

    python bench/warp_pairs.py --pairs DIR --out DIR [--scale 0.03] [--bend 0.3] [--seed 0] [--every 1]

Each map gets a scale and a smooth bend of its own; the truth is then the rigid transform that fits key points best,
places that both maps know, written beside the maps (``keypoints_a_m``, ``keypoints_b_m``) as in annotated data.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from mrslam.spatial import OccupancyGrid, read_map, se2

Places = Callable[[np.ndarray], np.ndarray]
WAVE_M = 20.0
"""Length of the waves that walls are bent by: half of it is where the bend is largest, 10 m."""
KEY_POINTS = 20
"""Key points of a pair at most."""


def warp(centre: np.ndarray, scale: float, bend_m: float, rng: np.random.Generator) -> Places:
    """Return where places ``(N, 2)`` of a map go: scaled about its centre, and bent by two waves across each other."""
    turn, phases = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(0.0, 2.0 * math.pi, 2)
    along = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])

    def moved(at: np.ndarray) -> np.ndarray:
        waves = np.sin((at - centre) @ along.T * (2.0 * math.pi / WAVE_M) + phases)
        # A wave shifts across its own direction: walls along it are bent, not pressed together.
        return centre + scale * (at - centre) + 0.5 * bend_m * waves @ along[::-1]

    return moved


def warped(grid: OccupancyGrid, moved: Places, inverse_rounds: int = 4) -> OccupancyGrid:
    """Return the map drawn where its places go; every cell takes the state of the place that comes to its middle."""
    res, (x0, y0) = grid.resolution_m, grid.origin_m
    height, width = grid.shape
    pad = int(math.ceil(1.0 / res + 0.05 * max(height, width)))
    out = OccupancyGrid(
        np.full((height + 2 * pad, width + 2 * pad), -1, dtype=np.int8), res, (x0 - pad * res, y0 - pad * res)
    )
    target = out.centres(np.ones(out.shape, dtype=np.bool_))
    source = target.copy()
    for _ in range(inverse_rounds):
        source += target - moved(source)
    c, r = (np.floor((source[:, k] - grid.origin_m[k]) / res).astype(int) for k in (0, 1))
    inside = (r >= 0) & (c >= 0) & (r < height) & (c < width)
    cells = np.full(len(target), -1, dtype=np.int8)
    cells[inside] = grid.cells[r[inside], c[inside]]
    drawn = cells.reshape(out.shape)
    on = moved(grid.centres(grid.is_occupied))  # thin walls are not lost between two cells
    c, r = (np.floor((on[:, k] - out.origin_m[k]) / res).astype(int) for k in (0, 1))
    drawn[r, c] = 100
    return OccupancyGrid(drawn, res, out.origin_m).cropped()


def shared_places(a: OccupancyGrid, b: OccupancyGrid, T_a_b: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return up to ``KEY_POINTS`` places ``(N, 2)`` of map b that both maps know."""
    at = b.centres(b.is_known)
    on_a = se2.apply(T_a_b, at)
    c, r = (np.floor((on_a[:, k] - a.origin_m[k]) / a.resolution_m).astype(int) for k in (0, 1))
    inside = (r >= 0) & (c >= 0) & (r < a.shape[0]) & (c < a.shape[1])
    inside[inside] &= a.is_known[r[inside], c[inside]]
    at = at[inside]
    return at[rng.permutation(len(at))[:KEY_POINTS]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--scale", type=float, default=0.03, help="largest difference of the two maps' scales")
    parser.add_argument("--bend", type=float, default=0.3, help="metres over 10 m")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--every", type=int, default=1)
    args = parser.parse_args()
    rng = np.random.default_rng(args.seed)
    (args.out / "pairs").mkdir(parents=True, exist_ok=True)
    index = json.loads((args.pairs / "index.json").read_text())
    index["pairs"] = index["pairs"][:: args.every]
    for pair in index["pairs"]:
        a, b = (read_map(args.pairs / pair["file"], key) for key in "ab")
        scale = 1.0 + rng.uniform(-0.5, 0.5) * args.scale
        moves = [
            warp(grid.centres(grid.is_known).mean(axis=0), s, args.bend, rng)
            for grid, s in ((a, scale), (b, 2.0 - scale))
        ]
        one, two = (warped(grid, moved) for grid, moved in zip((a, b), moves, strict=True))
        points = [np.zeros((0, 2))] * 2
        if pair["gt"]:
            T = np.array([pair["gt"][k] for k in ("tx", "ty", "theta")])
            at = shared_places(a, b, T, rng)
            points = [moves[0](se2.apply(T, at)), moves[1](at)]
            best = se2.fit_rigid(*points)
            pair["gt"] = dict(zip(("tx", "ty", "theta"), map(float, best), strict=True))
            pair["eval_point_b"] = [float(v) for v in points[1].mean(axis=0)]
            off = np.hypot(*(se2.apply(best, points[1]) - points[0]).T)
            pair["residual_rms_m"] = float(np.sqrt(np.mean(off**2)))
        pair["building"] = pair["building_a"]
        np.savez_compressed(
            args.out / pair["file"], a=one.cells, b=two.cells, origin_a=one.origin_m, origin_b=two.origin_m,
            res=one.resolution_m, keypoints_a_m=points[0], keypoints_b_m=points[1],
        )  # fmt: skip
    (args.out / "index.json").write_text(json.dumps(index, indent=1))
    print(f"{len(index['pairs'])} pairs in {args.out}")


if __name__ == "__main__":
    main()
