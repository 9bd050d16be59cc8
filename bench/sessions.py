"""Days in a simulated office whose furniture moves and where people walk: one JSON line a day.

    python bench/sessions.py [--days 10] [--seed 1] [--people 5] [--length 260] [--keep DIR]

Every day a robot drives about from another start, and its map continues the saved one (``one_map``); every night a
third of the furniture is put elsewhere. Judged in the world's frame, which the first day's start fixes:

bytes, keyframes : of the saved map. driven_m2 : of squares of 1.5 m in which it has a keyframe. walls_lost : share of
the walls that the first day's map shows of which
the saved map shows nothing within 0.15 m. removed : share of the cells drawn of pieces that stood on some day and
were gone on the three days after it, or longer, and whose place was seen on one of those, that are no wall now.
ghosts_m2 : occupied cells farther than 0.2 m from
anything that stands there now. thickness : occupied cells, over those of the first day's map.
diff : of yesterday's drive and today's alone; precision : share of the changed cells within 0.15 m of a piece that was
moved; recall : share of the outline of moved pieces, where both maps know the floor around, with a changed cell within
0.15 m. cpu_s : of aligning, bending and thinning.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from drives import simulated, way_along  # beside this file
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, distance_transform_edt
from surveys import free_inside, way_through

from mrslam import rbpf
from mrslam.merge.grids.warp import warp
from mrslam.merge.sessions.changes import on_one_lattice
from mrslam.merge.sessions.diff import diff
from mrslam.merge.sessions.one_map import one_map
from mrslam.sim_driver.worlds.office import office
from mrslam.spatial import InputError, OccupancyGrid
from mrslam.spatial.files.saved_map import SavedMap, of_one_session, write_saved_map

CELL_M = 0.05
PIECES, MOVED = 18, 6
NEAR_M, GHOST_M = 0.15, 0.2
WALK_M_S = 1.0
SQUARE_M = 1.5

Mask = NDArray[np.bool_]


@dataclass
class Day:
    """What stood where, and what the robot made of it."""

    pieces: list[tuple[int, int, int, int]]
    """Boxes of furniture: rows and columns r0, r1, c0, c1."""
    start: NDArray[np.float64]
    session: SavedMap


def stands(shape: tuple[int, int], pieces: list[tuple[int, int, int, int]]) -> Mask:
    """Return the cells of furniture."""
    out = np.zeros(shape, dtype=np.bool_)
    for r0, r1, c0, c1 in pieces:
        out[r0:r1, c0:c1] = True
    return out


def place(wall: Mask, pieces: list[tuple[int, int, int, int]], count: int, rng: np.random.Generator) -> None:
    """Put so many more pieces where a robot can still pass between them and all else."""
    for _ in range(10000):
        if len(pieces) >= count:
            return
        high, wide = (int(v) for v in rng.integers(8, 21, 2))
        r, c = int(rng.integers(5, wall.shape[0] - high - 5)), int(rng.integers(5, wall.shape[1] - wide - 5))
        room = 16  # cells, 0.8 m
        around = (slice(max(r - room, 0), r + high + room), slice(max(c - room, 0), c + wide + room))
        if not (wall | stands(wall.shape, pieces))[around].any():
            pieces.append((r, r + high, c, c + wide))


def walking(wall: Mask, count: int, people: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return where people are at each of the robot's readings, ``(count, people, 2)`` metres."""
    inside, room = free_inside(wall)
    out = []
    for _ in range(people):
        way = way_through(inside, room, count * WALK_M_S / 5.0 + 10.0, rng)[:, :2]
        gone = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))])
        at = np.minimum(np.arange(count) * WALK_M_S / 5.0, gone[-1])
        out.append(np.stack([np.interp(at, gone, way[:, k]) for k in (0, 1)], axis=1))
    return np.stack(out, axis=1) if out else np.empty((count, 0, 2))


def drive(plan: Mask, pieces: list[Any], day: int, options: argparse.Namespace) -> Day:
    """Let a robot drive about for a day and map."""
    rng = np.random.default_rng([options.seed, day])
    wall = plan | stands(plan.shape, pieces)
    inside, room = free_inside(wall)
    way = way_along([(x, y) for x, y, _ in way_through(inside, room, options.length, rng)], rng)
    cells = np.floor(way[:, :2] / CELL_M).astype(int)
    way = way[room[cells[:, 1], cells[:, 0]] > 0.1]
    world = OccupancyGrid(np.where(wall, 100, 0).astype(np.int8), CELL_M)
    readings = simulated(
        world, way, 100 * options.seed + day, 12.0, people=walking(wall, len(way), options.people, rng)
    ).readings
    mapper = rbpf.Mapper(rbpf.MapperConfig(particles=10), seed=options.seed)
    for reading in readings:
        mapper.update(reading.scan, reading.T_odom_base)
    local = mapper.snapshot()
    count = len(local.key_scans)
    keyframes = type(local.keyframes)(local.keyframes.stamps_ns[:count], local.keyframes.T_map_base[:count])
    return Day(list(pieces), way[0], of_one_session(f"r1@{day}", local.map.to_grid(), keyframes, local.key_scans))


def in_world(grid: OccupancyGrid, start: NDArray[np.float64], shape: tuple[int, int]) -> NDArray[np.int8]:
    """Return a map's cells in the world's lattice."""
    frame = OccupancyGrid(np.zeros(shape, dtype=np.int8), CELL_M)
    world, moved = on_one_lattice(frame, warp(grid, start, CELL_M))
    r, c = -world.cell0[0], -world.cell0[1]
    return moved.cells[r : r + shape[0], c : c + shape[1]]


def driven_m2(saved: SavedMap) -> float:
    """Return the floor of squares of ``SQUARE_M`` that hold a keyframe with a scan, square metres."""
    places = saved.keyframes.T_map_base[: len(saved.scans), :2]
    return len(np.unique(np.floor(places / SQUARE_M), axis=0)) * SQUARE_M**2


def near(mask: Mask, metres: float) -> Mask:
    """Return the cells within a distance of a mask."""
    return np.asarray(distance_transform_edt(~mask) * CELL_M <= metres) if mask.any() else mask


def outline(piece: Mask) -> Mask:
    """Return a mask's own cells at its edge: what a laser can see of it."""
    return piece & binary_dilation(~piece)


class Judge:
    """Compares maps with the world of each day."""

    def __init__(self, plan: Mask, first: Day) -> None:
        self.plan, self.first, self.days = plan, first, [first]
        shown = in_world(first.session.grid, first.start, plan.shape)
        self.walls = near(shown >= 65, NEAR_M) & outline(plan)
        self.thickness = int(first.session.grid.is_occupied.sum())

    def row(self, saved: SavedMap, today: Day) -> dict[str, Any]:
        """Return what became of walls, of furniture and of people in the saved map."""
        self.days.append(today)
        shown = in_world(saved.grid, self.first.start, self.plan.shape)
        occupied = shown >= 65
        now = self.plan | stands(self.plan.shape, today.pieces)
        ghosts = occupied & ~near(now, GHOST_M)
        lost = self.walls & ~near(occupied, NEAR_M)
        removed = self._removed(now)
        row = {
            "walls_lost": round(float(lost.sum() / self.walls.sum()), 5),
            "ghosts_m2": round(float(ghosts.sum()) * CELL_M**2, 3),
            "thickness": round(float(saved.grid.is_occupied.sum()) / self.thickness, 3),
            "removed_cells": int(removed.sum()),
        }
        gone = removed & ~occupied
        row["removed"] = round(float(gone.sum() / removed.sum()), 4) if removed.any() else None
        return row

    def _removed(self, now: Mask) -> Mask:
        """Return the cells that were drawn of pieces that have been gone for three days, and that were seen since."""
        out = np.zeros(self.plan.shape, dtype=np.bool_)
        clear = ~near(now, NEAR_M)
        for k, day in enumerate(self.days[:-3]):
            later = self.days[k + 1 :]
            for piece in day.pieces:
                if any(piece in other.pieces for other in later):
                    continue
                cells = near(stands(self.plan.shape, [piece]), 0.05) & clear
                drawn = in_world(day.session.grid, day.start, self.plan.shape) >= 65
                seen = [in_world(other.session.grid, other.start, self.plan.shape) >= 0 for other in later[:3]]
                out |= cells & drawn & np.any(seen, axis=0)
        return out

    def changes(self, before: Day, after: Day) -> dict[str, Any]:
        """Return precision and recall of the changed cells between two days' own maps."""
        try:
            found = diff(before.session, after.session)
        except InputError as error:
            return {"failed": str(error)}
        shape = self.plan.shape
        masks = []
        for mask in found.cells:
            cells = np.where(mask, 100, 0).astype(np.int8)
            drawn = in_world(OccupancyGrid(cells, CELL_M, found.before.origin_m), before.start, shape)
            masks.append(drawn >= 65)
        one, two = (in_world(day.session.grid, day.start, shape) for day in (before, after))
        was, is_now = (stands(shape, day.pieces) for day in (before, after))
        row: dict[str, Any] = {"bent_m": round(found.bent_m, 3)}
        for name, mask, true, known in (
            ("appeared", masks[0], is_now & ~was, (one >= 0) & (two >= 0)),
            ("vanished", masks[1], was & ~is_now, (one >= 0) & (two >= 0)),
        ):
            edge = outline(true) & known & ~near(self.plan, NEAR_M)
            hit, caught = mask & near(true, NEAR_M), edge & near(mask, NEAR_M)
            row[name] = {
                "cells": int(mask.sum()),
                "precision": round(float(hit.sum() / mask.sum()), 3) if mask.any() else None,
                "outline": int(edge.sum()),
                "recall": round(float(caught.sum() / edge.sum()), 3) if edge.any() else None,
            }
        return row


def main() -> None:
    """Drive every day, and judge."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--days", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--people", type=int, default=5)
    parser.add_argument("--length", type=float, default=260.0)
    parser.add_argument("--keep", type=Path, default=Path("out/sessions"))
    options = parser.parse_args()
    options.keep.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(options.seed)
    plan = np.pad(office(options.seed, 26.0).is_occupied, 4, constant_values=True)
    pieces: list[tuple[int, int, int, int]] = []
    place(plan, pieces, PIECES, rng)
    today = drive(plan, pieces, 1, options)
    judge, saved = Judge(plan, today), one_map({"first": today.session}).saved
    for day in range(1, options.days + 1):
        row: dict[str, Any] = {"day": day}
        if day > 1:
            yesterday = today
            for k in sorted(rng.choice(len(pieces), min(MOVED, len(pieces)), replace=False))[::-1]:
                pieces.pop(int(k))
            place(plan, pieces, PIECES, rng)
            today = drive(plan, pieces, day, options)
            before_s = time.process_time()
            made = one_map({"saved": saved, f"day {day}": today.session})
            assert made.result is not None
            row["cpu_s"] = round(time.process_time() - before_s, 2)
            row["left_out"] = list(made.result.team_map.unplaced.values())
            saved = made.saved
            row |= judge.row(saved, today)
            row["diff"] = judge.changes(yesterday, today)
        write_saved_map(options.keep / f"day-{day}.mrslam", saved)
        write_saved_map(options.keep / f"only-{day}.mrslam", today.session)
        size = (options.keep / f"day-{day}.mrslam").stat().st_size
        row |= {"bytes": size, "keyframes": len(saved.scans), "driven_m2": driven_m2(saved), "pieces": len(pieces)}
        print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
