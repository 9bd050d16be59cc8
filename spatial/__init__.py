"""What every other package builds on: poses, scans, grids, tiles, pose graphs, scan matching, map files."""

from mrslam.spatial.errors import InputError
from mrslam.spatial.files.map_files import read_map, write_map
from mrslam.spatial.files.tum import read_tum, write_tum
from mrslam.spatial.grid import FREE_MAX, OCCUPIED_MIN, UNKNOWN, OccupancyGrid
from mrslam.spatial.key_scans import KeyScans
from mrslam.spatial.scan import Scan
from mrslam.spatial.tiles import TILE_CELLS, Keyframes, LocalMap, Tile, TiledMap

__all__ = [
    "FREE_MAX",
    "OCCUPIED_MIN",
    "TILE_CELLS",
    "UNKNOWN",
    "InputError",
    "KeyScans",
    "Keyframes",
    "LocalMap",
    "OccupancyGrid",
    "Scan",
    "Tile",
    "TiledMap",
    "read_map",
    "read_tum",
    "write_map",
    "write_tum",
]
