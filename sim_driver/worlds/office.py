"""Office floors drawn at random: corridors with rooms on both sides, doors and furniture. One seed, one floor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from mrslam.sim_driver.worlds.canvas import Canvas
from mrslam.spatial import OccupancyGrid

DOOR_M = (0.95, 1.3)
ROOM_WIDTH_M = (2.6, 5.2)
ROOM_DEPTH_M = (3.2, 5.0)
CORRIDOR_M = (1.7, 2.4)


@dataclass
class _Room:
    x0: float
    y0: float
    x1: float
    y1: float


def office(seed: int, width_m: float | None = None) -> OccupancyGrid:
    """Return a floor of two corridors (or one, for some seeds), joined at both ends, every room with a door."""
    rng = np.random.default_rng(seed)
    width = width_m or float(rng.uniform(20.0, 32.0))
    corridors = 2 if rng.random() < 0.75 else 1
    depths = rng.uniform(*ROOM_DEPTH_M, size=2 * corridors)
    hallways = rng.uniform(*CORRIDOR_M, size=corridors)
    height = float(depths.sum() + hallways.sum())
    plan = Canvas(width, height)
    rooms: list[_Room] = []
    doors: list[tuple[float, float]] = []
    crossings = [float(rng.uniform(0.0, 0.15) * width), float(rng.uniform(0.75, 0.85) * width)]
    cross_width = float(rng.uniform(*CORRIDOR_M))
    y = 0.0
    for i in range(corridors):
        low, high = float(depths[2 * i]), float(depths[2 * i + 1])
        hall_low, hall_high = y + low, y + low + float(hallways[i])
        plan.wall(0.0, hall_low, width, hall_low).wall(0.0, hall_high, width, hall_high)
        for y0, y1, door_y in ((y, hall_low, hall_low), (hall_high, hall_high + high, hall_high)):
            rooms += _row(plan, rng, y0, y1, door_y, width, doors)
        y = hall_high + high
        if i + 1 < corridors:
            plan.wall(0.0, y, width, y)
    if corridors == 2:
        inner_low, inner_high = float(depths[0] + hallways[0]), float(depths[:3].sum() + hallways[0])
        for x in crossings:
            rooms = _crossing(plan, rooms, x, x + cross_width, inner_low, inner_high)
    for room in rooms:
        _furnish(plan, rng, room, doors)
    labels, count = ndimage.label(plan.cells == 0)
    floor = 1 + int(np.argmax(np.bincount(labels.ravel(), minlength=count + 1)[1:]))
    plan.cells[labels != floor] = 100  # slivers without a door are built up
    return plan.grid()


def _row(
    plan: Canvas,
    rng: np.random.Generator,
    y0: float,
    y1: float,
    door_y: float,
    width: float,
    doors: list[tuple[float, float]],
) -> list[_Room]:
    """Divide a strip into rooms and give each a door to its corridor; some have one to their neighbour too."""
    rooms, x = [], 0.0
    while x < width - 0.01:
        step = float(rng.uniform(*ROOM_WIDTH_M))
        end = width if width - (x + step) < ROOM_WIDTH_M[0] else x + step
        if end < width:
            plan.wall(end, y0, end, y1)
            if rng.random() < 0.2:
                middle = (y0 + y1) / 2
                plan.door(end, middle, 0.95, vertical=True)
                doors.append((end, middle))
        opening = float(rng.uniform(*DOOR_M))
        door_x = float(rng.uniform(x + opening / 2 + 0.25, end - opening / 2 - 0.25))
        plan.door(door_x, door_y, opening, vertical=False)
        doors.append((door_x, door_y))
        rooms.append(_Room(x, y0, end, y1))
        x = end
    return rooms


def _crossing(plan: Canvas, rooms: list[_Room], x0: float, x1: float, y0: float, y1: float) -> list[_Room]:
    """Cut a passage between the two corridors, with walls of its own, and return the rooms that it leaves whole."""
    x0 = max(x0, 0.1)
    plan.box(x0, y0 - 0.1, x1, y1 + 0.1, value=0)
    if x0 > 1.0:
        plan.wall(x0, y0, x0, y1)
    plan.wall(x1, y0, x1, y1)
    for room in rooms:
        if room.y0 < y1 - 0.1 and room.y1 > y0 + 0.1 and room.x0 < x1 and room.x1 > x0:
            # What is left of a room that was cut opens to the passage.
            if x0 - room.x0 > 1.2:
                plan.door(x0, (room.y0 + room.y1) / 2, 1.0, vertical=True)
            if room.x1 - x1 > 1.2:
                plan.door(x1, (room.y0 + room.y1) / 2, 1.0, vertical=True)
    return [r for r in rooms if r.y0 >= y1 - 0.1 or r.y1 <= y0 + 0.1 or r.x0 >= x1 or r.x1 <= x0]


def _furnish(plan: Canvas, rng: np.random.Generator, room: _Room, doors: list[tuple[float, float]]) -> None:
    """Put a few desks, cupboards or pillars into a room, away from its doors and from each other."""
    placed: list[tuple[float, float, float]] = [(x, y, 0.7) for x, y in doors]
    for _ in range(int(rng.integers(3, 8))):
        w, h = (float(v) for v in rng.choice([(1.4, 0.7), (0.7, 1.4), (0.5, 1.0), (0.4, 0.4)]))
        at_wall = rng.random(2) < np.array([0.35, 0.35])
        x = float(rng.uniform(room.x0 + 0.05, max(room.x1 - 0.05 - w, room.x0 + 0.06)))
        y = float(rng.uniform(room.y0 + 0.05, max(room.y1 - 0.05 - h, room.y0 + 0.06)))
        if at_wall[0]:
            x = room.x0 + 0.05
        elif at_wall[1]:
            y = room.y0 + 0.05 if rng.random() < 0.5 else room.y1 - 0.05 - h
        gaps_to_wall = (x - room.x0, room.x1 - x - w, y - room.y0, room.y1 - y - h)
        reach = float(np.hypot(w, h)) / 2
        clear = all(np.hypot(x + w / 2 - px, y + h / 2 - py) > reach + pr + 0.35 for px, py, pr in placed)
        # A gap is either closed or wide enough for a robot to pass.
        if clear and all(gap < 0.1 or gap > 0.8 for gap in gaps_to_wall):
            plan.box(x, y, x + w, y + h)
            placed.append((x + w / 2, y + h / 2, reach))
