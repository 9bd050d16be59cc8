"""Worlds to simulate in: built-in, drawn at random by a seed, or read from map files and bitmaps."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from mrslam.sim_driver.worlds.builtin import BUILT_IN
from mrslam.sim_driver.worlds.campus import campus
from mrslam.sim_driver.worlds.hotel import hotel
from mrslam.sim_driver.worlds.office import office
from mrslam.sim_driver.worlds.world import World
from mrslam.spatial import InputError, OccupancyGrid, read_map
from mrslam.spatial.files.atomic import is_file
from mrslam.spatial.files.images import read_image
from mrslam.spatial.grid import RESOLUTIONS_M

DARK_BELOW = 128
"""Grey value below which a bitmap's pixel is wall."""
DRAWN: dict[str, Callable[[int], OccupancyGrid]] = {"office": office, "hotel": hotel, "campus": campus}
"""Kind of world drawn at random -> plan by seed."""


def load_world(name_or_path: str | Path, scale_m: float | None = None) -> World:
    """Return a world by name ("office", "campus:7"), from a map server's YAML, or a bitmap (dark = wall).

    ``scale_m`` : metres a pixel of a bitmap, default 0.05. Raises ``InputError`` on unknown names and unreadable files.
    """
    name = str(name_or_path)
    least_m, largest_m = RESOLUTIONS_M
    if scale_m is not None and not least_m <= scale_m <= largest_m:
        raise InputError(f"world scale must be in {least_m:g}..{largest_m:g} m per pixel, got {scale_m!r}")
    if name in BUILT_IN:
        return World(name, BUILT_IN[name]())
    kind, colon, seed = name.partition(":")
    if colon and kind in DRAWN:
        if not (seed.isdecimal() and seed.isascii() and len(seed) <= 18):
            raise InputError(f"world {name[:60]!r}: the seed after {kind}: must be a whole number >= 0 and < 1e18")
        return World(name, DRAWN[kind](int(seed)))
    path = Path(name)
    if not is_file(path):
        known = ", ".join([*BUILT_IN, *(f"{kind}:SEED" for kind in DRAWN)])
        raise InputError(f"world {name!r}: no such file, and no built-in world; those are {known}")
    if path.suffix.lower() in (".yaml", ".yml"):
        return World(path.stem, read_map(path))
    grey, opaque = read_image(path)
    is_wall = grey < DARK_BELOW if opaque is None else (grey < DARK_BELOW) & opaque
    cells = is_wall[::-1].astype("int8") * 100
    return World(path.stem, OccupancyGrid(cells, scale_m or 0.05))


__all__ = ["BUILT_IN", "DRAWN", "World", "campus", "hotel", "load_world", "office"]
