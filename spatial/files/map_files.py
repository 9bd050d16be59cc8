"""Maps on disk: PGM or PNG with YAML, as the ROS map tools write and read them; and ``.npz`` pairs of arrays."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from mrslam.spatial import se2
from mrslam.spatial.errors import InputError, first_line
from mrslam.spatial.files.archives import read_arrays
from mrslam.spatial.files.atomic import is_file, is_folder, write_text
from mrslam.spatial.files.images import read_image, write_image
from mrslam.spatial.files.pixels import Pixels
from mrslam.spatial.files.saved_map import SUFFIX, read_saved_map
from mrslam.spatial.files.trinary import not_empty, pixels, yaml_text
from mrslam.spatial.grid import FARTHEST_M, OCCUPIED_MIN, OccupancyGrid
from mrslam.spatial.se2 import Transform

log = logging.getLogger(__name__)

DEFAULT_RESOLUTION_M = 0.05
STRAIGHT_RAD = 1e-6
"""An image turned by less is not turned: over 1 km that is a millimetre."""


def write_map(path: Path, grid: OccupancyGrid) -> None:
    """Write ``path`` (``.yaml``) and the PGM it names, in the trinary mode that every map tool loads.

    Cells between free and occupied become unknown there. An empty map is written as one unknown cell.
    """
    grid = not_empty(grid)
    image = path.with_suffix(".pgm")
    write_image(image, pixels(grid))
    write_text(path.with_suffix(".yaml"), yaml_text(grid, image.name))


def read_map(path: Path | str, key: str = "a", resolution_m: float | None = None) -> OccupancyGrid:
    """Read a map from ``.yaml`` (with its image), from an image, a saved map (``.mrslam``), or an ``.npz``.

    An image is read by the YAML of its stem beside it that names it. With ``resolution_m``, or where there is no such
    YAML, it is a bare image: of that resolution, else of 0.05 m with a warning. An ``.npz`` holds ``res`` and, for
    ``key`` "a" or "b", the array and ``origin_<key>``. Raises ``InputError`` with what is wrong in which file.
    """
    grid, T_map_grid = read_turned_map(path, key, resolution_m)
    if T_map_grid[2] != 0.0:
        raise InputError(
            f"{path}: its image is turned by {T_map_grid[2]:g} rad in its frame; only mrslam align and merge take that"
        )
    return grid


def read_turned_map(
    path: Path | str, key: str = "a", resolution_m: float | None = None
) -> tuple[OccupancyGrid, Transform]:
    """Read a map as :func:`read_map`, and ``T_map_grid``: the identity but where a YAML turns its image.

    A YAML's origin is the pose of the image's lower left corner in the map's frame; a turned image is returned with
    its corner at (0, 0).
    """
    path = Path(path)
    if is_folder(path):
        raise InputError(f"{path}: is a folder, not a map file (.yaml, an image, .mrslam or .npz)")
    if not is_file(path):
        raise InputError(f"{path}: no such map file")
    if path.suffix == SUFFIX:
        return read_saved_map(path).grid, se2.IDENTITY
    if path.suffix == ".npz":
        return _read_npz(path, key), se2.IDENTITY
    if path.suffix.lower() in (".yaml", ".yml"):
        return _read_yaml(path)
    described = _yaml_of(path)
    if resolution_m is not None:
        if described is not None:
            log.warning("%s: %s, which names this image, is passed over for a resolution", path, described.name)
    elif described is not None:
        return _read_yaml(described)
    else:
        resolution_m = DEFAULT_RESOLUTION_M
        log.warning("%s: no %s.yaml beside it names this image; taking %g m a cell", path, path.stem, resolution_m)
    cells = Pixels(occupied_thresh=OCCUPIED_MIN / 100).cells(*read_image(path))
    return OccupancyGrid(cells, resolution_m), se2.IDENTITY


def _yaml_of(image: Path) -> Path | None:
    """Return the YAML file beside the image, of the same stem, that names this very image or its twin."""
    for path in (image.with_suffix(suffix) for suffix in (".yaml", ".yml")):
        if not is_file(path):
            continue
        try:
            meta = _load_yaml(path)
        except InputError:  # whatever it is, it names no image
            continue
        if isinstance(meta, dict) and "image" in meta:
            named = path.parent / str(meta["image"])
            if is_file(named) and (named.samefile(image) or _are_twins(named, image)):
                return path
    return None


def _are_twins(named: Path, image: Path) -> bool:
    """Whether an image is the same map as the one that the YAML names, in another format (map.png beside map.pgm)."""
    if named.parent.resolve() != image.parent.resolve() or named.stem != image.stem:
        return False
    return read_image(named)[0].shape == read_image(image)[0].shape


def _load_yaml(path: Path) -> Any:
    try:
        return yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, AttributeError, LookupError, yaml.YAMLError, RecursionError) as error:  # of odd tags
        raise InputError(f"{path}: not a readable YAML file ({first_line(error)})") from error


def _read_yaml(path: Path) -> tuple[OccupancyGrid, Transform]:
    meta = _load_yaml(path)
    if not isinstance(meta, dict) or not {"image", "resolution", "origin"} <= meta.keys():
        raise InputError(f"{path}: a map file needs the keys image, resolution and origin")
    image_path = path.parent / str(meta["image"])
    if not is_file(image_path):
        raise InputError(f"{path}: its image {meta['image']!r} does not exist or is not a file")
    try:
        resolution = float(meta["resolution"])
        x, y, yaw = (float(v) for v in meta["origin"])
        occupied, free = float(meta.get("occupied_thresh", 0.65)), float(meta.get("free_thresh", 0.196))
        negate, mode = bool(int(meta.get("negate", 0))), str(meta.get("mode", "trinary"))
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{path}: resolution, origin [x, y, yaw] and thresholds must be numbers ({error})") from error
    try:
        meaning = Pixels(mode, negate, occupied, free)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    cells = meaning.cells(*read_image(image_path))
    if abs(yaw) <= STRAIGHT_RAD:
        return _grid(path, cells, resolution, (x, y)), se2.IDENTITY
    if not np.isfinite([x, y, yaw]).all() or max(abs(x), abs(y)) > FARTHEST_M:
        raise InputError(f"{path}: origin must be finite and within {FARTHEST_M:g} m, got {meta['origin']}")
    return _grid(path, cells, resolution, (0.0, 0.0)), se2.transform(x, y, yaw)


def _grid(path: Path, cells: NDArray[np.int8], resolution_m: float, origin_m: tuple[float, float]) -> OccupancyGrid:
    """Return the grid, or say in which file it is that it cannot be."""
    try:
        return OccupancyGrid(cells, resolution_m, origin_m)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _read_npz(path: Path, key: str) -> OccupancyGrid:
    arrays = read_arrays(path, key, f"origin_{key}", "res")
    try:
        cells, resolution = arrays[key], float(arrays["res"])
        origin = np.asarray(arrays[f"origin_{key}"], dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: origin_{key} and res must be numbers ({first_line(error)})") from error
    if origin.shape != (2,):
        raise InputError(f"{path}: origin_{key} must have 2 numbers, got shape {origin.shape}")
    if cells.dtype != np.int8:
        raise InputError(f"{path}: {key} must be int8 (-1 unknown, 0..100), got {cells.dtype}")
    return _grid(path, cells, resolution, (float(origin[0]), float(origin[1])))
