"""Maps as grey images that every map tool loads: white free, black occupied, grey unknown, and the YAML beside them."""

from __future__ import annotations

import json
import re

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial.files.pixels import FREE, GREY, OCCUPIED
from mrslam.spatial.grid import UNKNOWN, OccupancyGrid

PLAIN = re.compile(r"\w[\w.+@~ -]*")
"""Names of images that a YAML file can hold unquoted."""


def not_empty(grid: OccupancyGrid) -> OccupancyGrid:
    """Return the grid, or one unknown cell in place of none: images have a pixel at least."""
    if grid.cells.size:
        return grid
    return OccupancyGrid(np.full((1, 1), UNKNOWN, dtype=np.int8), grid.resolution_m, grid.origin_m)


def pixels(grid: OccupancyGrid) -> NDArray[np.uint8]:
    """Return the grid as a grey image, first row on top: white free, black occupied, grey unknown."""
    image = np.full(grid.shape, GREY, dtype=np.uint8)
    image[grid.is_free] = FREE
    image[grid.is_occupied] = OCCUPIED
    return np.ascontiguousarray(image[::-1])


def yaml_text(grid: OccupancyGrid, image: str) -> str:
    """Return the text of the YAML file beside the image of this name."""
    x, y = grid.origin_m
    if not PLAIN.fullmatch(image):
        image = json.dumps(image, ensure_ascii=False)
    return (
        f"image: {image}\nmode: trinary\nresolution: {grid.resolution_m:.6g}\n"
        f"origin: [{x:.6f}, {y:.6f}, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
