"""The recorded runs of mrgs' authors as two robots each: one JSON line a run, and the arena's map beside the true one.

    python bench/recorded.py --out DIR [--seeds 3]

isr : the robot stood still between its two runs, so where the first trajectory ends the second begins; the error of the
transform is told against that. arena : the team map is laid on the true map by its outline, for what stood in the arena
that day is not what the true map shows; ``outer`` is the share of the true outer wall with one of the team map within
0.1 m, and ``DIR/arena.png`` shows the two side by side.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from experiments import MISSIONS, laid_over  # beside this file; must come before the next lines
from scipy.spatial import cKDTree

from mrslam.merge import warp
from mrslam.sim_driver.missions.mission import load_mission
from mrslam.sim_driver.run.run import run_mission
from mrslam.sim_driver.worlds import load_world
from mrslam.spatial import read_map, se2
from mrslam.spatial.files import map_files
from mrslam.spatial.files.images import write_image
from mrslam.spatial.files.tum import read_tum

ARENA = "worlds/mrl_arena/mrl_arena.yaml"
GREY, GAP, NEAR_M = 205, 20, 0.1


def play(name: str, seed: int, out: Path) -> tuple[Path, dict[str, Any]]:
    """Run a mission in virtual time; return its folder and its only pair."""
    mission = load_mission(MISSIONS / f"{name}.toml", ["mission.shell=virtual", f"mission.seed={seed}"])
    folder = out / f"{name}-{seed}"
    metrics = run_mission(mission, folder, lambda *_: None, lambda text: print(text, file=sys.stderr))
    (pair,) = metrics["pairs"]
    return folder, pair


def isr(seed: int, out: Path) -> dict[str, Any]:
    """Return how far the two corridor runs are from where the robot stood."""
    folder, pair = play("isr-two", seed, out)
    row = {"run": "isr-two", "seed": seed, "status": pair["status"], "accepted_at_s": pair["accepted_at_s"]}
    if pair["status"] != "accepted":
        return {**row, "reason": pair["reason"]}
    end, start = read_tum(folder / "r1/trajectory.tum")[1][-1], read_tum(folder / "r2/trajectory.tum")[1][0]
    away_m, turned = se2.difference(np.array(pair["T_a_b"]), se2.compose(end, se2.inverse(start)))
    return {**row, "error_m": round(away_m, 4), "error_deg": round(float(np.degrees(turned)), 3)}


def arena(seed: int, out: Path, true_map: Path) -> dict[str, Any]:
    """Return how the arena's team map fits the true one; draw both."""
    folder, pair = play("arena-two", seed, out)
    row = {"run": "arena-two", "seed": seed, "status": pair["status"], "accepted_at_s": pair["accepted_at_s"]}
    world, team = load_world(str(true_map)), read_map(folder / "r1/team_map.yaml")
    middles = [grid.centres(grid.is_free).mean(axis=0) for grid in (world.grid, team)]
    outer = world.grid.centres(world.is_wall)
    low, high = outer.min(axis=0) + NEAR_M, outer.max(axis=0) - NEAR_M
    outer = outer[((outer < low) | (outer > high)).any(axis=1)]
    best, T_world_team = -1.0, se2.IDENTITY
    for quarters in range(4):
        turn = np.array([0.0, 0.0, quarters * np.pi / 2.0])
        turn[:2] = middles[0] - se2.apply(turn, middles[1])
        T = laid_over(world, team, turn)
        walls = cKDTree(se2.apply(T, team.centres(team.is_occupied)))
        share = float(np.mean(walls.query(outer)[0] <= NEAR_M))
        if share > best:
            best, T_world_team = share, T
    sides = [map_files.pixels(grid) for grid in (world.grid, warp(team, T_world_team, world.resolution_m))]
    height = max(side.shape[0] for side in sides) + 2 * GAP
    framed = [
        np.pad(side, [((height - side.shape[0]) // 2, (height - side.shape[0] + 1) // 2), (GAP, GAP)],
               constant_values=GREY)
        for side in sides
    ]  # fmt: skip
    write_image(out / "arena.png", np.concatenate(framed, axis=1))
    return {**row, "outer": round(best, 4)}


def main() -> None:
    """Run and tell."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", type=int, default=3)
    options = parser.parse_args()
    true_map = load_mission(MISSIONS / "arena-two.toml", []).find(ARENA)
    for seed in range(1, options.seeds + 1):
        print(json.dumps(isr(seed, options.out)), flush=True)
        print(json.dumps(arena(seed, options.out, true_map)), flush=True)


if __name__ == "__main__":
    main()
