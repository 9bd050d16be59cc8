"""Make pairs of partial maps with known transforms, from floor plans and recorded logs, to tune and test alignment on.

    python bench/make_pairs.py --data DATA --out DIR [--pairs 60] [--seed 0]

Every pair is two maps of one building from different scans, each in a frame of its own (positives by share of overlap,
negatives without), or maps of two buildings. ``DIR/index.json`` and ``DIR/pairs/*.npz`` are as in ``DATA/pairs``.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numba import njit
from surveys import RES, Survey, office_walls, read_plan, survey_log, survey_plan

from mrslam.spatial import se2
from mrslam.spatial.traversal import traverse

Warp = Callable[[np.ndarray], np.ndarray]
BINS = {0.9: (0.82, 0.95), 0.7: (0.65, 0.75), 0.5: (0.42, 0.5), 0.3: (0.22, 0.31), 0.15: (0.1, 0.16)}
"""Share of the smaller map that the other one knows, from and to, per bin; as in the recorded pairs."""
PLANS = {
    "stage/SRI-AIC-kwing.png": 0.08, "stage/autolab.png": 0.04, "stage/hospital_section.png": 0.05,
    "stage/sal2.png": 0.06,
    "stage/simple_rooms.png": 0.05, "stage/uoa_robotics_lab.png": 0.03,
    "stage/SFU_1200x615.png": 0.06,
    "ipa/office_e.png": 0.05, "ipa/office_g.png": 0.035, "ipa/NLB.png": 0.05, "ipa/lab_a.png": 0.05,
    "ipa/lab_c.png": 0.05, "ipa/office_a.png": 0.05,
}  # fmt: skip
"""Floor plans and the metres per pixel they are read at."""
REPEATING = ("SRI-AIC-kwing", "office_c", "office_e")
"""Buildings that repeat themselves: pairs of theirs are tagged, for nobody can know which of their places is right."""
PATIENCE = 150
"""Tries after which the next building is taken for a pair."""
LOGS = (
    "slam/aces",
    "slam/mit-csail",
    "slam/intel",
    "slam_sparse/fhw",
    "slam_sparse/freiburg-101",
    "slam_sparse/acapulco",
)


@njit(nogil=True)
def draw(origin, ends, hits, seen, hit, rows, cols):  # type: ignore[no-untyped-def]
    """Count passes and hits of one scan; coordinates in cells."""
    for i in range(ends.shape[0]):
        n = traverse(origin[0], origin[1], ends[i, 0], ends[i, 1], rows, cols)
        for k in range(n - 1):
            seen[rows[k], cols[k]] += 1
        if hits[i]:
            hit[rows[n - 1], cols[n - 1]] += 1
        elif n > 0:
            seen[rows[n - 1], cols[n - 1]] += 1


def bent(poses: np.ndarray, bend_m: float, rng: np.random.Generator) -> Warp:
    """Return a smooth shift of places ``(N, 2) -> (N, 3)`` (x, y m, heading rad) of about ``bend_m``."""
    if bend_m <= 0:
        return lambda at: np.zeros((len(at), 3))
    middle = poses[:, :2].mean(axis=0)
    span = max(float(np.ptp(poses[:, :2], axis=0).max()), 1.0)
    waves = []
    for k in range(3):
        direction, phase = rng.uniform(0, 2 * math.pi, 2)
        along = np.array([math.cos(direction), math.sin(direction)]) / span * rng.uniform(2, 6)
        waves.append((bend_m * (1.0 if k < 2 else min(4.0 / span, 0.15)), along, phase))
    return lambda at: np.stack([m * np.sin((at - middle) @ along + phase) for m, along, phase in waves], axis=-1)


def render(survey: Survey, chosen: np.ndarray, T_map_world: np.ndarray, warp: Warp):  # type: ignore[no-untyped-def]
    """Return (cells, origin) of the chosen scans' map, with poses bent by ``warp``."""
    poses = survey.poses[chosen] + warp(survey.poses[chosen, :2])
    poses = se2.compose(T_map_world, poses)
    points = [se2.apply(p, survey.ends[i]) for p, i in zip(poses, chosen, strict=True)]
    stacked = np.concatenate([*points, poses[:, :2]])
    low = np.floor(stacked.min(axis=0) / RES).astype(int) - 2
    shape = tuple((np.ceil(stacked.max(axis=0) / RES).astype(int) + 3 - low)[::-1])
    seen, hit = np.zeros(shape, np.int32), np.zeros(shape, np.int32)
    rows, cols = np.empty(20000, np.int32), np.empty(20000, np.int32)
    for pose, ends, i in zip(poses, points, chosen, strict=True):
        draw(pose[:2] / RES - low, ends / RES - low, survey.hits[i], seen, hit, rows, cols)
    cells = np.full(shape, -1, np.int8)
    cells[seen > 0] = 0
    cells[(hit > 0) & (hit > 0.2 * (hit + seen))] = 100
    return cells, low * RES


def known_mask(cells, origin, T_map_world, lattice):  # type: ignore[no-untyped-def]
    """Return which points of a world lattice the map knows."""
    at = se2.apply(T_map_world, lattice)
    c, r = np.floor((at[:, 0] - origin[0]) / RES).astype(int), np.floor((at[:, 1] - origin[1]) / RES).astype(int)
    inside = (r >= 0) & (c >= 0) & (r < cells.shape[0]) & (c < cells.shape[1])
    known = np.zeros(len(at), dtype=bool)
    known[inside] = cells[r[inside], c[inside]] >= 0
    return known


def choose(survey: Survey, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Pick two sets of different scans, each around a place of its own."""
    n = len(survey.poses)
    shuffled = rng.permutation(n) % 2 == 0
    sets = []
    for half in (shuffled, ~shuffled):
        own = np.flatnonzero(half)
        place = survey.poses[rng.integers(n), :2]
        away = np.hypot(*(survey.poses[own, :2] - place).T)
        if rng.random() < 0.7:  # a stretch of the drive
            start, length = rng.integers(n), int(n * rng.uniform(0.15, 0.6))
            sets.append(own[(own - start) % n < length])
        else:
            sets.append(np.sort(own[np.argsort(away)[: int(len(own) * rng.uniform(0.1, 0.5))]]))
    return sets[0], sets[1]


def blocks(pose: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return which half-metre blocks of the world a scan sees, as numbers."""
    seen = se2.apply(pose, np.concatenate([ends * share for share in (0.2, 0.4, 0.6, 0.8, 1.0)]))
    at = np.floor(seen / 0.5).astype(np.int64) + 5000
    return np.unique(at[:, 0] * 10_000 + at[:, 1])


def guessed_overlap(seen: list[np.ndarray], sa: np.ndarray, sb: np.ndarray) -> float:
    """Return about which share of the smaller map the other one knows, without drawing them."""
    one, two = (np.unique(np.concatenate([seen[k] for k in chosen])) for chosen in (sa, sb))
    return len(np.intersect1d(one, two)) / min(len(one), len(two))


def frame(rng: np.random.Generator) -> np.ndarray:
    return se2.transform(rng.uniform(-20, 20), rng.uniform(-20, 20), rng.uniform(-math.pi, math.pi))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--pairs", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="+", help="of logs and plans, use only those whose name contains one of these")
    parser.add_argument("--houses", type=int, default=0, help="which three of the houses, 0..19")
    parser.add_argument("--offices", type=int, nargs="*", default=[], help="seeds of office floors drawn at random")
    args = parser.parse_args()
    rng = np.random.default_rng(args.seed)
    (args.out / "pairs").mkdir(parents=True, exist_ok=True)
    houses = sorted((args.data / "worlds" / "houses").glob("*.jpg"))[args.houses :: 20]
    plans = {args.data / "worlds" / plan: scale for plan, scale in PLANS.items()} | dict.fromkeys(houses, 20.0 / 500)

    def chosen(name: str) -> bool:
        return not args.only or any(part in name for part in args.only)

    surveys = [survey_log(args.data / log) for log in LOGS if chosen(log)]
    surveys += [survey_plan(p.stem, read_plan(p, scale), rng) for p, scale in plans.items() if chosen(p.name)]
    surveys += [survey_plan(f"office-{seed}", office_walls(seed), rng) for seed in args.offices]
    places = {
        survey.name: [blocks(pose, ends) for pose, ends in zip(survey.poses, survey.ends, strict=True)]
        for survey in surveys
    }
    index: list[dict[str, object]] = []
    wanted = [*BINS, 0.0]
    tries = 0
    while len(index) < args.pairs and tries < 400 * args.pairs:
        tries += 1
        bin_ = wanted[len(index) % len(wanted)]
        one = two = surveys[(len(index) // len(wanted) + tries // PATIENCE) % len(surveys)]
        if bin_ == 0.0 and len(index) % (2 * len(wanted)) >= len(wanted):
            two = surveys[rng.integers(len(surveys))]
            if two is one:
                continue
        sa, sb = choose(one, rng)
        if two is not one:
            sb = choose(two, rng)[1]
        if min(len(sa), len(sb)) < 8:
            continue
        if two is one and abs(guessed_overlap(places[one.name], sa, sb) - min(bin_, 0.85)) > 0.15:
            continue
        bend = float(rng.choice([0.0, rng.uniform(0.02, 0.12)]))
        Ta, Tb = frame(rng), frame(rng)
        warps = bent(one.poses[sa], bend, rng), bent(two.poses[sb], bend, rng)
        a, oa = render(one, sa, Ta, warps[0])
        b, ob = render(two, sb, Tb, warps[1])
        area_a, area_b = ((m >= 0).sum() * RES**2 for m in (a, b))
        if min(area_a, area_b) < 60.0:
            continue
        gt, middle, overlap = None, None, 0.0
        if two is one:
            low, high = one.poses[:, :2].min(axis=0) - 31, one.poses[:, :2].max(axis=0) + 31
            xs, ys = np.meshgrid(np.arange(low[0], high[0], 0.2), np.arange(low[1], high[1], 0.2))
            lattice = np.stack([xs.ravel(), ys.ravel()], axis=-1)
            both = known_mask(a, oa, Ta, lattice) & known_mask(b, ob, Tb, lattice)
            overlap = float(both.sum() * 0.04 / min(area_a, area_b))
            if bin_ == 0.0:
                if overlap > 0.0005:
                    continue
            else:
                if not BINS[bin_][0] <= overlap < BINS[bin_][1]:
                    continue
                # Bent maps have no one transform: the truth is what fits best where both know the world.
                at = lattice[both]
                in_a, in_b = (se2.apply(T, at + warp(at)[:, :2]) for T, warp in zip((Ta, Tb), warps, strict=True))
                T = se2.fit_rigid(in_a, in_b)
                gt = {"tx": float(T[0]), "ty": float(T[1]), "theta": float(T[2])}
                middle = [float(v) for v in se2.apply(Tb, lattice[both].mean(axis=0))]
        name = f"g{args.seed}_{len(index):03d}"
        np.savez_compressed(args.out / "pairs" / f"{name}.npz", a=a, b=b, origin_a=oa, origin_b=ob, res=RES)
        repeats = one.name in REPEATING or two.name in REPEATING
        tags = (
            (["drift"] if bend > 0 else [])
            + (["aliased"] if repeats else [])
            + ([] if gt else ["same_building" if two is one else "different_building"])
        )
        index.append(
            {"id": name, "file": f"pairs/{name}.npz", "negative": gt is None, "bin": bin_, "overlap": overlap,
             "kind": one.kind, "building_a": one.name, "building_b": two.name, "split": "dev",
             "tags": tags, "gt": gt, "eval_point_b": middle}
        )  # fmt: skip
    (args.out / "index.json").write_text(json.dumps({"version": 1, "seed": args.seed, "pairs": index}, indent=1))
    print(f"{len(index)} pairs in {args.out} after {tries} tries")


if __name__ == "__main__":
    main()
