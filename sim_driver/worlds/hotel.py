"""Buildings that repeat themselves, drawn at random: equal rooms along equal corridors. One seed, one building.

What a robot sees in one wing it sees in every other, so that no comparison of maps can tell them apart but by the few
things that stand in one place only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from mrslam.sim_driver.worlds.canvas import Canvas
from mrslam.spatial import OccupancyGrid

RESOLUTION_M = 0.05
WALL_M = 0.1
DOOR_M = 0.9
BESIDE_DOOR_M = 0.3
"""Wall that stays free beside a door, metres."""
ROOM_WIDTH_M = (2.6, 3.4)
ROOM_DEPTH_M = (2.8, 3.6)
CORRIDOR_M = (1.7, 2.1)
ROOMS = (2, 5)
"""Rooms on each side of a corridor: at least, and less than."""
STARS = {"straight": 2, "three": 3, "cross": 4}
"""Wings around one hall, turned by 180, 120 and 90 degrees each."""
COMBS = (2, 3)
"""Corridors side by side that begin at one cross corridor: the same map shifted, not turned."""
BED_M, DESK_M = (2.0, 1.0), (0.55, 0.7)
"""A room's furniture, which stands together in the corner away from its door."""
SINGLE_M = (0.8, 0.3)
"""A thing that stands in one place only: along a wall, and across."""
SINGLE_MOST = 3
"""Things that stand in one place only are at most so many; some buildings have none."""
HALL_LEAST_M = 2.2
"""Least radius of the hall in which wings meet, metres."""


@dataclass(frozen=True)
class _Wing:
    """What all wings of a building share, metres."""

    rooms: int
    width_m: float
    depth_m: float
    corridor_m: float
    door_m: float
    """Where the door is along a room."""
    bed: tuple[float, float]
    desk: tuple[float, float]
    """Lower left corners of a room's furniture, the corridor below it."""

    @property
    def length_m(self) -> float:
        return self.rooms * self.width_m + WALL_M

    @property
    def across_m(self) -> float:
        return 2.0 * self.depth_m + self.corridor_m


def hotel(seed: int) -> OccupancyGrid:
    """Return a building of equal wings: around a hall at 180, 120 or 90 degrees, or side by side."""
    rng = np.random.default_rng(seed)
    kind = str(rng.choice([*STARS, "comb"]))
    wing = _draw_wing(rng)
    count = STARS[kind] if kind in STARS else int(rng.choice(COMBS))
    cells = [_wing_cells(wing) for _ in range(count)]
    for _ in range(int(rng.integers(0, SINGLE_MOST + 1))):
        _single(cells[int(rng.integers(count))], wing, rng)
    plan = _comb(cells, wing) if kind == "comb" else _star(cells, wing)
    labels, _ = ndimage.label(plan == 0)
    plan[labels != np.argmax(np.bincount(labels[plan == 0]))] = 100  # slivers between wings are built up
    return OccupancyGrid(_cropped(plan), RESOLUTION_M)


def _draw_wing(rng: np.random.Generator) -> _Wing:
    width, depth = (_even(rng.uniform(*limits)) for limits in (ROOM_WIDTH_M, ROOM_DEPTH_M))
    door = _even(rng.uniform(0.5 * DOOR_M + 0.2, width - 0.5 * DOOR_M - 0.2))
    # Away from the door: against the left wall, or the right one.
    bed_x, desk_x = (WALL_M / 2 if door > width / 2 else width - w - WALL_M / 2 for w in (BED_M[0], DESK_M[0]))
    bed, desk = (bed_x, depth - 1.05), (desk_x, depth - 1.05 - DESK_M[1])
    return _Wing(int(rng.integers(*ROOMS)), width, depth, _even(rng.uniform(*CORRIDOR_M)), door, bed, desk)


def _even(length_m: float) -> float:
    """Return the length in whole pairs of cells, so that equal rooms have equal cells."""
    return 2.0 * RESOLUTION_M * round(length_m / (2.0 * RESOLUTION_M))


def _wing_cells(wing: _Wing) -> NDArray[np.int8]:
    """Return ``(H, W)``: a corridor along x with rooms on both sides, open at its left end."""
    plan = Canvas(wing.length_m, wing.across_m, RESOLUTION_M, WALL_M)
    low, high = wing.depth_m, wing.depth_m + wing.corridor_m
    plan.wall(0.0, low, wing.length_m, low).wall(0.0, high, wing.length_m, high)
    for i in range(wing.rooms):
        x = WALL_M / 2 + i * wing.width_m
        for y0, y1, door_y in ((0.0, low, low), (high, wing.across_m, high)):
            if i:
                plan.wall(x, y0, x, y1)
            plan.door(x + wing.door_m, door_y, DOOR_M, vertical=False)
            for (dx, dy), (w, h) in ((wing.bed, BED_M), (wing.desk, DESK_M)):
                bottom = door_y + dy if y1 > high else door_y - dy - h
                plan.box(x + dx, bottom, x + dx + w, bottom + h)
    return plan.box(0.0, low + WALL_M / 2, 2 * WALL_M, high - WALL_M / 2, value=0).cells


def _single(cells: NDArray[np.int8], wing: _Wing, rng: np.random.Generator) -> None:
    """Put one thing into a wing that no other has: a box in the corridor, or a cupboard in the corner beside a bed."""
    is_upper = rng.random() < 0.5
    if rng.random() < 0.5:  # along the wall between two doors
        begin = WALL_M / 2 + int(rng.integers(wing.rooms - 1)) * wing.width_m + wing.door_m + DOOR_M / 2 + BESIDE_DOOR_M
        x = begin + rng.uniform(0.0, wing.width_m - DOOR_M - 2.0 * BESIDE_DOOR_M - SINGLE_M[0])
        y = wing.depth_m + (wing.corridor_m - WALL_M / 2 - SINGLE_M[1] if is_upper else WALL_M / 2)
        w, h = SINGLE_M
    else:
        h, w = SINGLE_M
        x = WALL_M / 2 + int(rng.integers(wing.rooms)) * wing.width_m
        x += wing.width_m - WALL_M / 2 - w if wing.bed[0] < WALL_M else WALL_M / 2
        y = wing.across_m - WALL_M - h if is_upper else WALL_M
    (r0, r1), (c0, c1) = ((round(v / RESOLUTION_M), round((v + s) / RESOLUTION_M)) for v, s in ((y, h), (x, w)))
    cells[r0:r1, c0:c1] = 100


def _star(wings: list[NDArray[np.int8]], wing: _Wing) -> NDArray[np.int8]:
    """Return ``(H, W)``: wings at equal angles around a round hall."""
    turn = 2.0 * math.pi / len(wings)
    beside = wing.across_m / 2.0 / math.tan(turn / 2.0) if len(wings) > 2 else 0.0  # where neighbours' corners meet
    begin_m = max(beside, HALL_LEAST_M)
    reach = math.ceil((begin_m + wing.length_m + wing.across_m / 2.0 + 0.5) / RESOLUTION_M)
    middle = np.arange(-reach, reach) + 0.5
    x, y = np.meshgrid(middle * RESOLUTION_M, middle * RESOLUTION_M)
    out = np.where(np.hypot(x, y) <= begin_m, 0, 100).astype(np.int8)
    for k, cells in enumerate(wings):
        c, s = (round(v, 12) for v in (math.cos(k * turn), math.sin(k * turn)))
        along, across = c * x + s * y - begin_m, c * y - s * x + wing.across_m / 2.0
        col, row = (np.floor(v / RESOLUTION_M + 1e-6).astype(np.int64) for v in (along, across))
        is_there = (col >= 0) & (col < cells.shape[1]) & (row >= 0) & (row < cells.shape[0])
        out[is_there] = cells[row[is_there], col[is_there]]
        mouth = (
            (np.abs(across - wing.across_m / 2.0) < (wing.corridor_m - WALL_M) / 2.0)
            & (along > -begin_m)
            & (along < 0.1)
        )
        out[mouth] = 0
    return out


def _comb(wings: list[NDArray[np.int8]], wing: _Wing) -> NDArray[np.int8]:
    """Return ``(H, W)``: wings side by side, each open to one cross corridor at their left."""
    cross = round((wing.corridor_m + WALL_M) / RESOLUTION_M)
    edge = round(WALL_M / RESOLUTION_M)
    height = sum(cells.shape[0] for cells in wings)
    hall = np.zeros((height, cross), dtype=np.int8)
    hall[:edge] = hall[-edge:] = hall[:, :edge] = 100
    return np.hstack([hall, np.vstack(wings)])


def _cropped(cells: NDArray[np.int8]) -> NDArray[np.int8]:
    """Return the part with floor in it, and a wall around."""
    walled = np.pad(cells, 2, constant_values=100)
    rows, cols = np.flatnonzero((walled == 0).any(axis=1)), np.flatnonzero((walled == 0).any(axis=0))
    return np.ascontiguousarray(walled[rows[0] - 2 : rows[-1] + 3, cols[0] - 2 : cols[-1] + 3])
