"""Make pairs of partial maps with known transforms, from floor plans and recorded logs, to tune and test alignment on.

    python bench/make_pairs.py --data DATA --out DIR [--pairs 60] [--seed 0]

Every pair is two maps of one building from different scans, each in a frame of its own (positives by share of overlap,
negatives without), or maps of two buildings. ``DIR/index.json`` and ``DIR/pairs/*.npz`` are as in ``DATA/pairs``.
"""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numba import njit
from scipy import ndimage

from sim_driver.feeds.carmen import CarmenFeed
from spatial import se2
from spatial.traversal import traverse

RES = 0.05
BINS = ((0.9, 0.8), (0.7, 0.6), (0.5, 0.4), (0.3, 0.2), (0.15, 0.1))
PLANS = {
    "stage/SRI-AIC-kwing.png": 0.08, "stage/autolab.png": 0.04, "stage/hospital_section.png": 0.05,
    "stage/sal2.png": 0.06,
    "stage/simple_rooms.png": 0.05, "stage/uoa_robotics_lab.png": 0.03,
    "stage/SFU_1200x615.png": 0.06,
    "ipa/office_e.png": 0.05, "ipa/office_g.png": 0.035, "ipa/NLB.png": 0.05, "ipa/lab_a.png": 0.05,
    "ipa/lab_c.png": 0.05, "ipa/office_a.png": 0.05,
}  # fmt: skip
"""Floor plans and the metres per pixel they are read at."""
LOGS = (
    "slam/aces",
    "slam/mit-csail",
    "slam/intel",
    "slam_sparse/fhw",
    "slam_sparse/freiburg-101",
    "slam_sparse/acapulco",
)


@dataclass
class Survey:
    """Scans of one building in its world frame: poses ``(N, 3)``, end points ``(B, 2)`` m and hit flags per scan."""

    name: str
    kind: str
    poses: np.ndarray
    ends: list[np.ndarray]
    hits: list[np.ndarray]


@njit(nogil=True)
def cast(wall, x, y, angle, range_cells):  # type: ignore[no-untyped-def]
    """Return the free range in cells."""
    dx, dy = math.cos(angle) * 0.25, math.sin(angle) * 0.25
    for k in range(int(range_cells * 4)):
        r, c = int(y + dy * k), int(x + dx * k)
        if r < 0 or c < 0 or r >= wall.shape[0] or c >= wall.shape[1]:
            return -1.0
        if wall[r, c]:
            return 0.25 * k
    return -1.0


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


def survey_plan(path: Path, scale: float, rng: np.random.Generator) -> Survey:
    """Drive about a floor plan at random: a scan about every half metre of free space."""
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    size = (round(image.shape[1] * scale / RES), round(image.shape[0] * scale / RES))
    dark = cv2.resize((image < 90).astype(np.uint8) * 255, size, interpolation=cv2.INTER_AREA)[::-1] > 60
    wall = np.pad(np.ascontiguousarray(dark), 2, constant_values=False)
    room = ndimage.distance_transform_edt(~wall) * RES
    inside = (room > 0.35) & (room < 12.0)
    labels, count = ndimage.label(inside)
    border = set(np.unique(np.concatenate([labels[3], labels[-4], labels[:, 3], labels[:, -4]])))
    sizes = [0 if k in border else int((labels == k).sum()) for k in range(count + 1)]
    sizes[0] = 0
    best = int(np.argmax(sizes))
    if sizes[best] * RES**2 < 30.0:
        sizes = [int((labels == k).sum()) for k in range(count + 1)]
        sizes[0] = 0
        best = int(np.argmax(sizes))
    cells = np.argwhere(labels == best)
    count = min(600, int(len(cells) * RES**2 / 0.7))
    picks = cells[rng.choice(len(cells), count, replace=False)]
    reach = float(rng.choice([5.6, 10.0, 20.0, 30.0]))
    field = float(rng.choice([math.pi, 1.5 * math.pi, 2 * math.pi]))
    poses, ends, hits = [], [], []
    beams = np.linspace(-0.5 * field, 0.5 * field, int(field / math.radians(1.0)))
    for r, c in picks:
        heading = rng.uniform(-math.pi, math.pi)
        ranges = np.array([cast(wall, c + 0.5, r + 0.5, heading + t, reach / RES) for t in beams]) * RES
        hit = ranges > 0
        length = np.where(hit, ranges + 0.5 * RES + rng.normal(0, 0.012, len(beams)), reach)
        keep = hit | (rng.random(len(beams)) < 0.5)
        poses.append([(c + 0.5) * RES, (r + 0.5) * RES, heading])
        ends.append(np.stack([length * np.cos(beams), length * np.sin(beams)], axis=-1)[keep])
        hits.append(hit[keep])
    return Survey(path.stem, "sim", np.array(poses), ends, hits)


def survey_log(stem: Path) -> Survey:
    """Take a log's scans at its reference poses, at most about one every 0.4 m."""
    reference = np.loadtxt(f"{stem}.reference.tum")
    readings = CarmenFeed(Path(f"{stem}.clf.gz")).readings
    stamps = np.array([r.scan.stamp_ns for r in readings]) * 1e-9
    poses, ends, hits = [], [], []
    last = np.full(2, np.inf)
    for row in reference:
        k = int(np.argmin(np.abs(stamps - row[0])))
        pose = np.array([row[1], row[2], 2 * math.atan2(row[6], row[7])])
        if abs(stamps[k] - row[0]) > 0.02 or np.hypot(*(pose[:2] - last)) < 0.3:
            continue
        last = pose[:2]
        scan = readings[k].scan
        ranges = np.asarray(scan.ranges_m, dtype=np.float64)
        hit = np.isfinite(ranges) & (ranges < 40.0)
        angles = scan.angles_rad[hit]
        poses.append(pose)
        ends.append(np.stack([ranges[hit] * np.cos(angles), ranges[hit] * np.sin(angles)], axis=-1))
        hits.append(np.ones(int(hit.sum()), dtype=bool))
    return Survey(stem.name, "real", np.array(poses), ends, hits)


def render(survey: Survey, chosen: np.ndarray, T_map_world: np.ndarray, bend_m: float, rng: np.random.Generator):  # type: ignore[no-untyped-def]
    """Return (cells, origin) of the chosen scans' map, with poses bent smoothly by about ``bend_m``."""
    poses = survey.poses[chosen].copy()
    middle = poses[:, :2].mean(axis=0)
    if bend_m > 0:
        span = max(float(np.ptp(poses[:, :2], axis=0).max()), 1.0)
        for k in range(3):
            direction, phase = rng.uniform(0, 2 * math.pi, 2)
            wave = (
                (poses[:, :2] - middle)
                @ np.array([math.cos(direction), math.sin(direction)])
                / span
                * rng.uniform(2, 6)
            )
            amount = bend_m * (1.0 if k < 2 else 2.0 / span * 2)
            poses[:, k] += amount * np.sin(wave + phase)
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
        if survey.kind == "real" and rng.random() < 0.7:  # a stretch of the drive
            start, length = rng.integers(n), int(n * rng.uniform(0.15, 0.6))
            sets.append(own[(own - start) % n < length])
        else:
            sets.append(np.sort(own[np.argsort(away)[: int(len(own) * rng.uniform(0.1, 0.5))]]))
    return sets[0], sets[1]


def frame(rng: np.random.Generator) -> np.ndarray:
    return se2.transform(rng.uniform(-20, 20), rng.uniform(-20, 20), rng.uniform(-math.pi, math.pi))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--pairs", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="+", help="use only buildings whose file name contains one of these")
    args = parser.parse_args()
    rng = np.random.default_rng(args.seed)
    (args.out / "pairs").mkdir(parents=True, exist_ok=True)
    houses = sorted((args.data / "worlds" / "houses").glob("*.jpg"), key=lambda p: -p.stat().st_size)[:20:2]
    plans = {args.data / "worlds" / plan: scale for plan, scale in PLANS.items()} | dict.fromkeys(houses, 15.0 / 500)

    def chosen(name: str) -> bool:
        return not args.only or any(part in name for part in args.only)

    surveys = [survey_log(args.data / log) for log in LOGS if chosen(log)]
    surveys += [survey_plan(plan, scale, rng) for plan, scale in plans.items() if chosen(plan.name)]
    index: list[dict[str, object]] = []
    wanted = [b for b, _ in BINS] + [0.0]
    tries = 0
    while len(index) < args.pairs and tries < 60 * args.pairs:
        tries += 1
        bin_ = wanted[len(index) % len(wanted)]
        one = surveys[rng.integers(len(surveys))]
        two = one
        if bin_ == 0.0 and len(index) % (2 * len(wanted)) >= len(wanted):
            two = surveys[rng.integers(len(surveys))]
            if two is one:
                continue
        sa, sb = choose(one, rng)
        if two is not one:
            sb = choose(two, rng)[1]
        if min(len(sa), len(sb)) < 8:
            continue
        bend = float(rng.choice([0.0, rng.uniform(0.02, 0.12)]))
        Ta, Tb = frame(rng), frame(rng)
        a, oa = render(one, sa, Ta, bend, rng)
        b, ob = render(two, sb, Tb, bend, rng)
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
                low_edge = dict(BINS)[bin_]
                if not low_edge <= overlap < low_edge + (0.1 if bin_ > 0.15 else 0.08):
                    continue
                T = se2.compose(Ta, se2.inverse(Tb))
                gt = {"tx": float(T[0]), "ty": float(T[1]), "theta": float(T[2])}
                middle = [float(v) for v in se2.apply(Tb, lattice[both].mean(axis=0))]
        name = f"g{args.seed}_{len(index):03d}"
        np.savez_compressed(args.out / "pairs" / f"{name}.npz", a=a, b=b, origin_a=oa, origin_b=ob, res=RES)
        tags = (["drift"] if bend > 0 else []) + (
            [] if gt else ["same_building" if two is one else "different_building"]
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
