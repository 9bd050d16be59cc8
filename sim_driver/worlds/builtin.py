"""Worlds that come with the package."""

from __future__ import annotations

from collections.abc import Callable

from mrslam.sim_driver.worlds.canvas import Canvas
from mrslam.sim_driver.worlds.office import office
from mrslam.spatial import OccupancyGrid

OFFICE_SEED = 11
"""The floor called "office"."""


def arena1() -> OccupancyGrid:
    """A pen of about 4 x 4.6 m with a few low walls and boxes, after the first arena of Martins 2013 (section 4.1)."""
    plan = Canvas(4.1, 4.6, resolution_m=0.02, thickness_m=0.04)
    plan.box(1.9, 3.95, 4.1, 4.6).box(0.9, 3.5, 1.04, 3.74).box(2.66, 2.34, 2.78, 2.86)
    plan.wall(0.0, 2.48, 0.74, 2.48).wall(0.74, 2.48, 0.74, 2.64)
    plan.wall(0.96, 1.66, 1.14, 1.66).wall(1.14, 1.66, 1.14, 1.1)
    plan.wall(2.06, 1.2, 3.26, 1.2).wall(2.06, 1.2, 2.06, 0.8).wall(3.26, 1.2, 3.26, 0.8)
    return plan.grid()


def arena2() -> OccupancyGrid:
    """A pen of 13 x 9 m with rooms open to each other, like the second arena of Martins 2013."""
    plan = Canvas(13.2, 9.2, resolution_m=0.025)
    plan.wall(3.2, 0.0, 3.2, 2.4).wall(3.2, 3.8, 3.2, 6.0).wall(0.0, 6.0, 1.8, 6.0).wall(3.2, 6.0, 5.4, 6.0)
    plan.wall(5.4, 6.0, 5.4, 7.4).wall(6.4, 0.0, 6.4, 3.4).wall(6.4, 3.4, 8.2, 3.4).wall(9.6, 3.4, 10.8, 3.4)
    plan.wall(8.2, 9.2, 8.2, 5.6).wall(8.2, 5.6, 9.4, 5.6).wall(11.0, 5.6, 13.2, 5.6).wall(10.8, 0.0, 10.8, 1.6)
    plan.box(1.2, 1.0, 2.0, 1.5).box(4.4, 1.5, 5.0, 2.7).box(12.3, 7.2, 13.1, 9.1).box(8.4, 1.2, 9.0, 1.8)
    plan.disc(1.6, 7.6, 0.25).disc(5.2, 4.5, 0.2).disc(10.2, 7.6, 0.3).disc(12.0, 3.0, 0.2)
    return plan.grid()


def office_floor() -> OccupancyGrid:
    """An office floor of about 26 x 17 m: two corridors, rooms, furniture."""
    return office(OFFICE_SEED)


def corridor() -> OccupancyGrid:
    """A corridor of 40 x 2.4 m with few and unevenly spaced recesses."""
    plan = Canvas(40.2, 6.2)
    plan.box(0.0, 0.0, 40.2, 1.9).box(0.0, 4.3, 40.2, 6.2)
    for x, up, width, depth in (
        (2.0, True, 1.2, 0.6), (7.5, False, 1.0, 1.4), (9.3, True, 2.2, 1.6), (18.0, False, 1.6, 0.5),
        (24.6, True, 0.9, 0.9), (26.2, False, 2.8, 1.7), (35.0, True, 1.4, 1.2), (37.8, False, 1.0, 0.4),
    ):  # fmt: skip
        y0, y1 = (4.3, 4.3 + depth) if up else (1.9 - depth, 1.9)
        plan.box(x, y0, x + width, y1, value=0)
    return plan.grid()


def block() -> OccupancyGrid:
    """A block of 36 x 26 m with a 2.5 m corridor around a closed core: one large loop of about 110 m."""
    plan = Canvas(36.2, 26.2)
    plan.box(2.6, 2.6, 33.6, 23.6)
    for x0, y0, x1, y1 in (
        (5.0, 2.5, 9.0, 5.5), (17.0, 2.5, 18.5, 3.6), (26.0, 2.5, 31.0, 6.5), (31.5, 11.0, 33.7, 14.5),
        (24.0, 21.2, 28.0, 23.7), (12.0, 19.6, 14.0, 23.7), (2.5, 15.0, 5.5, 18.0), (2.5, 9.0, 3.5, 10.0),
    ):  # fmt: skip
        plan.box(x0, y0, x1, y1, value=0)
    plan.box(0.1, 6.0, 0.5, 7.2).box(20.0, 0.1, 21.0, 0.5).box(35.7, 18.0, 36.1, 20.0).box(8.0, 25.6, 9.5, 26.1)
    return plan.grid()


def symmetric_house() -> OccupancyGrid:
    """A house of 12 x 9 m that looks the same turned by half a turn: maps of its halves fit in two ways."""
    plan = Canvas(12.2, 9.2)
    plan.wall(0.0, 4.0, 4.0, 4.0).wall(4.0, 0.0, 4.0, 4.0).wall(6.1, 0.0, 6.1, 2.0)
    plan.door(2.0, 4.0, 1.0, vertical=False).door(4.0, 2.8, 1.0, vertical=True)
    plan.box(1.0, 0.1, 2.4, 0.7).box(0.1, 5.2, 0.6, 6.4)
    plan.cells |= plan.cells[::-1, ::-1]
    return plan.grid()


BUILT_IN: dict[str, Callable[[], OccupancyGrid]] = {
    "arena1": arena1,
    "arena2": arena2,
    "office": office_floor,
    "corridor": corridor,
    "block": block,
    "symmetric-house": symmetric_house,
}
"""Name -> plan."""
