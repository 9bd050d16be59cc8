"""Merging many maps at once: parts of one building's log among maps of other buildings.

    python bench/merge.py --data $MRSLAM_DATA              # 36 maps: 24 cuts of intel, 12 maps of other buildings
    python bench/merge.py --data $MRSLAM_DATA --log aces --parts 8 --wrong 28

Every cut is mapped on its own by the particle filter, in a frame of its own; its true place is that of its
trajectory on the reference trajectory of the whole log. Prints a line for each map and ends with one JSON line.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path

import numpy as np

from mrslam import alignment, merge
from mrslam.rbpf import Mapper, MapperConfig
from mrslam.sim_driver.feeds import open_feed
from mrslam.sim_driver.missions.usage import peak_kb
from mrslam.spatial import OccupancyGrid, read_map, se2
from mrslam.spatial.files.images import write_image
from mrslam.spatial.files.tum import read_tum

Cuts = dict[str, tuple[OccupancyGrid, np.ndarray, np.ndarray]]
RIGHT_M, RIGHT_RAD = 0.5, math.radians(5.0)


def cut_log(data: Path, log: str, parts: int, particles: int) -> Cuts:
    """Return map, ``T_reference_map`` and trajectory of each part; neighbouring parts share half their scans."""
    readings = open_feed(data / "slam" / f"{log}.clf.gz").readings
    stamps_ns, T_reference_laser = read_tum(data / "slam" / f"{log}.reference.tum")
    order = np.argsort(stamps_ns, kind="stable")
    stamps_ns, T_reference_laser = stamps_ns[order], T_reference_laser[order]
    out = {}
    length = 2 * len(readings) / (parts + 1)
    for part in range(parts):
        mine = readings[round(part * length / 2) : round(part * length / 2 + length)]
        mapper = Mapper(MapperConfig(particles=particles, threads=1), seed=part)
        for reading in mine:
            mapper.update(reading.scan, reading.T_odom_base)
        way = mapper.trajectory()
        laser = se2.compose(way.T_map_base, mine[0].scan.T_base_laser)
        near = np.clip(np.searchsorted(stamps_ns, way.stamps_ns), 0, len(stamps_ns) - 1)
        same = np.abs(stamps_ns[near] - way.stamps_ns) < 20_000_000
        T_reference_map = se2.fit_rigid(T_reference_laser[near[same], :2], laser[same, :2])
        out[f"{log}{part:02}"] = (mapper.snapshot().map.to_grid(), T_reference_map, way.T_map_base)
    return out


def wrong_maps(data: Path, count: int, not_of: str = "intel") -> dict[str, OccupancyGrid]:
    """Return maps of other buildings, one from each where there are enough."""
    pairs = json.loads((data / "pairs" / "index.json").read_text())["pairs"]
    chosen: dict[str, OccupancyGrid] = {}
    seen: list[str] = []
    for again in range(3):
        for pair in pairs:
            name = f"x-{pair['building_a']}-{pair['id']}"
            new = name not in chosen and seen.count(pair["building_a"]) <= again and not_of not in name
            if new and len(chosen) < count:
                seen.append(pair["building_a"])
                chosen[name] = read_map(data / "pairs" / pair["file"], "a")
    return chosen


def renamed(grids: dict[str, OccupancyGrid], cuts: Cuts, seed: int) -> tuple[dict[str, OccupancyGrid], Cuts]:
    """Return the maps under names in random order."""
    order = np.random.default_rng(seed).permutation(len(grids))
    new = {name: f"m{place:02}-{name}" for name, place in zip(grids, order, strict=True)}
    return {new[x]: grid for x, grid in grids.items()}, {new[x]: cut for x, cut in cuts.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--log", default="intel")
    parser.add_argument("--parts", type=int, default=24)
    parser.add_argument("--wrong", type=int, default=12)
    parser.add_argument("--particles", type=int, default=15)
    parser.add_argument("--method", default="auto")
    parser.add_argument("--shuffle", type=int, help="seed of random names, so that they tell nothing of neighbours")
    parser.add_argument("--workers", type=int, default=None)
    parser.add_argument("--cache", type=Path, help="folder that keeps the cut maps for the next run")
    parser.add_argument("--out", type=Path, help="folder for the picture")
    args = parser.parse_args()

    cached = args.cache and args.cache / f"{args.log}-{args.parts}-{args.particles}.npz"
    if cached and cached.exists():
        held = np.load(cached, allow_pickle=True)["cuts"].item()
        cuts = {x: (OccupancyGrid(*grid), T, way) for x, (grid, T, way) in held.items()}
    else:
        cuts = cut_log(args.data, args.log, args.parts, args.particles)
        if cached:
            args.cache.mkdir(parents=True, exist_ok=True)
            plain = {x: ((g.cells, g.resolution_m, g.origin_m), T, way) for x, (g, T, way) in cuts.items()}
            np.savez_compressed(cached, cuts=np.array(plain, dtype=object))
    grids = {x: grid for x, (grid, _, _) in cuts.items()} | wrong_maps(args.data, args.wrong, args.log)
    if args.shuffle is not None:
        grids, cuts = renamed(grids, cuts, args.shuffle)
    merge.warm_up()
    alignment.warm_up()
    wall, cpu = time.perf_counter(), time.process_time()
    result = merge.merge_maps(grids, method=args.method, workers=args.workers)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    report(args, grids, cuts, result, wall, cpu)


def report(args, grids, cuts, result, wall, cpu) -> None:  # type: ignore[no-untyped-def]
    team = result.team_map
    placed = [x for x in team.T_team_map if x in cuts]
    # The frame is that of the first map; the truth is brought into it where it fits best.
    T_team_reference = best_frame([se2.compose(team.T_team_map[x], se2.inverse(cuts[x][1])) for x in placed])
    misplaced, errors = [], []
    for x in grids:
        if x not in team.T_team_map:
            print(f"{x:16} not placed: {team.unplaced[x][:150]}")
        elif x not in cuts:
            misplaced.append(x)
            print(f"{x:16} PLACED, of another building")
        else:
            centre = merge.graph.node_of(grids[x]).centre_m
            true = se2.compose(T_team_reference, cuts[x][1])
            metres = float(np.hypot(*(se2.apply(true, centre) - se2.apply(team.T_team_map[x], centre))))
            radians = se2.difference(true, team.T_team_map[x])[1]
            errors.append(metres)
            if metres > RIGHT_M or radians > RIGHT_RAD:
                misplaced.append(x)
            print(f"{x:16} {metres:6.3f} m {math.degrees(radians):6.2f} deg{'  MISPLACED' if x in misplaced else ''}")
    wrong_edges = 0
    for (a, b), edge in result.edges.items():
        if a not in cuts and b not in cuts and building(a) == building(b):
            continue  # they may well fit
        if a not in cuts or b not in cuts:
            print(f"edge {a} {b}: of different buildings, confidence {edge.confidence:.2f}")
            wrong_edges += 1
            continue
        true = se2.between(cuts[a][1], cuts[b][1])
        centre = merge.graph.node_of(grids[b]).centre_m
        metres = float(np.hypot(*(se2.apply(true, centre) - se2.apply(edge.T_a_b, centre))))
        if metres > 2 * RIGHT_M or se2.difference(true, edge.T_a_b)[1] > 2 * RIGHT_RAD:
            wrong_edges += 1
            print(f"edge {a} {b}: wrong by {metres:.2f} m, confidence {edge.confidence:.2f}, "
                  f"{team.dropped.get((a, b), 'USED')}")  # fmt: skip
    for pair, why in team.dropped.items():
        print("dropped", pair, why)
    if args.out:
        args.out.mkdir(parents=True, exist_ok=True)
        ways = {x: way for x, (_, _, way) in cuts.items()}
        write_image(args.out / f"merge-{args.log}.png", merge.draw_team(team, grids, ways))
    print(json.dumps({
        "maps": len(grids), "of_one_building": len(cuts), "placed": len(placed), "misplaced": len(misplaced),
        "wrong_edges": wrong_edges, "alignments_tried": result.tried, "edges": len(result.edges),
        "edges_used": len(team.edges),
        "median_error_m": round(float(np.median(errors)), 3) if errors else None,
        "max_error_m": round(max(errors), 3) if errors else None,
        "wall_s": round(wall, 1), "cpu_s": round(cpu, 1), **refusion(grids, result),
        "peak_rss_mb": peak_kb() // 1024,
    }))  # fmt: skip


def building(name: str) -> str:
    return name.split("x-")[-1].rsplit("-", 1)[0]


def best_frame(estimates: list[np.ndarray]) -> np.ndarray:
    """Return the estimate that most others agree with."""
    if not estimates:
        return se2.IDENTITY
    return min(estimates, key=lambda one: float(np.median([se2.difference(one, other)[0] for other in estimates])))


def refusion(grids: dict[str, OccupancyGrid], result: merge.MergeResult) -> dict[str, float]:
    """Return what one changed map costs, against everything anew."""
    mapper = merge.TeamMapper()
    for name, grid in grids.items():
        mapper.set_map(name, grid)
    cpu = time.process_time()
    team = mapper.team_map(result.edges)
    whole = time.process_time() - cpu
    tiles, fusions = mapper.tiles_warped, mapper.fusions
    if not team.T_team_map:
        return {}
    name = next(iter(team.T_team_map))
    cells = grids[name].cells.copy()
    row, col = np.argwhere(grids[name].is_free)[len(cells)]
    cells[row : row + 3, col : col + 3] = 100
    mapper.set_map(name, OccupancyGrid(cells, grids[name].resolution_m, grids[name].origin_m))
    cpu = time.process_time()
    mapper.team_map(result.edges)
    return {
        "place_and_fuse_cpu_s": round(whole, 2), "one_change_cpu_s": round(time.process_time() - cpu, 2),
        "tiles": tiles, "tiles_after_change": mapper.tiles_warped - tiles,
        "fusions": fusions, "fusions_after_change": mapper.fusions - fusions,
    }  # fmt: skip


if __name__ == "__main__":
    main()
