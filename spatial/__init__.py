"""Value types and kernels that every room shares: poses, scans, grids, tiles, map files. The ground floor."""

from spatial.jit_cache import use_cache_dir

use_cache_dir()

from spatial.errors import InputError  # noqa: E402
from spatial.grid import FREE_MAX, OCCUPIED_MIN, UNKNOWN, OccupancyGrid  # noqa: E402
from spatial.map_files import read_map, write_map  # noqa: E402
from spatial.scan import Scan  # noqa: E402
from spatial.tiles import TILE_CELLS, Keyframes, LocalMap, Tile, TiledMap  # noqa: E402

__all__ = [
    "FREE_MAX",
    "OCCUPIED_MIN",
    "TILE_CELLS",
    "UNKNOWN",
    "InputError",
    "Keyframes",
    "LocalMap",
    "OccupancyGrid",
    "Scan",
    "Tile",
    "TiledMap",
    "read_map",
    "write_map",
]
