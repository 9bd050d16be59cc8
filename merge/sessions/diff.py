"""What appeared and what vanished between two maps of one building, piece by piece."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from mrslam.merge.batch.merge_maps import merge_maps
from mrslam.merge.config import MergeConfig
from mrslam.merge.grids.warp import warp
from mrslam.merge.sessions.changes import NEAR_M, Changes, changes, on_one_lattice
from mrslam.merge.sessions.one_map import placed_in_one_frame, trail_of
from mrslam.spatial import InputError, OccupancyGrid
from mrslam.spatial.files.saved_map import SavedMap

ONE_PIECE_M = 0.15
"""Changed cells with no more than this between them are one piece, metres: a laser sees furniture in strokes."""
LEAST_M2 = 0.02
"""Smaller pieces are left out, square metres: eight cells of 5 cm, a stroke of 0.4 m, the side of a chair."""

NAMES = ("before", "after")


@dataclass(frozen=True)
class Piece:
    """Something that appeared or vanished; places and sizes in the earlier map's frame, along its axes."""

    what: Literal["appeared", "vanished"]
    x_m: float
    y_m: float
    """Centre of its cells, metres."""
    width_m: float
    """Extent along x, metres."""
    height_m: float
    """Extent along y, metres."""
    area_m2: float
    """Of the cells that changed, square metres: of furniture the strokes that a laser saw of it."""

    def fields(self) -> dict[str, Any]:
        """Return it as plain JSON values, rounded to centimetres."""
        numbers = {name: round(value, 2) for name, value in vars(self).items() if name != "what"}
        return {"what": self.what, **numbers, "area_m2": round(self.area_m2, 4)}


@dataclass(frozen=True, eq=False)
class Diff:
    """Two maps of one building in the earlier one's frame and lattice, and what differs."""

    before: OccupancyGrid
    after: OccupancyGrid
    cells: Changes
    """Those of the pieces."""
    pieces: tuple[Piece, ...]
    """The largest first."""
    bent_m: float
    """Largest displacement of either map by bending, metres; 0 where they were laid as they are."""

    @property
    def both_m2(self) -> float:
        """Area that both maps have seen, square metres; elsewhere nothing can be said."""
        both = self.before.is_known & self.after.is_known
        return float(np.count_nonzero(both)) * self.before.resolution_m**2


def diff(
    before: SavedMap,
    after: SavedMap,
    *,
    same_frame: bool = False,
    near_m: float = NEAR_M,
    least_m2: float = LEAST_M2,
    method: str = "auto",
    config: MergeConfig | None = None,
) -> Diff:
    """Return what changed; the maps are aligned first, and bent to fit where both have keyframes.

    ``same_frame`` : they lie in one frame already, and are laid over each other as they are. Raises ``InputError``
    where they do not fit.
    """
    one, two, bent_m = (before.grid, after.grid, 0.0) if same_frame else _aligned(before, after, method, config)
    one = warp(one, np.zeros(3))
    one, two = on_one_lattice(one, warp(two, np.zeros(3), one.resolution_m))
    found = changes(one, two, near_m)
    appeared = _pieces(one, "appeared", found.appeared, least_m2)
    vanished = _pieces(one, "vanished", found.vanished, least_m2)
    pieces = sorted(appeared[0] + vanished[0], key=lambda piece: (-piece.area_m2, piece.x_m, piece.y_m))
    return Diff(one, two, Changes(appeared[1], vanished[1]), tuple(pieces), bent_m)


def _aligned(
    before: SavedMap, after: SavedMap, method: str, config: MergeConfig | None
) -> tuple[OccupancyGrid, OccupancyGrid, float]:
    """Return both maps' grids in the earlier one's frame, and by how much either was bent, metres."""
    given = dict(zip(NAMES, (before, after), strict=True))
    grids = {name: saved.grid for name, saved in given.items()}
    trails = {name: trail for name, saved in given.items() if len(trail := trail_of(saved))}
    result = merge_maps(grids, None, method, None, config, NAMES[0], None, trails)
    if NAMES[1] in result.team_map.unplaced:
        raise InputError(f"the maps do not fit: {result.team_map.unplaced[NAMES[1]]}")
    one, two = (placed_in_one_frame(saved, name, result).grid for name, saved in given.items())
    return one, two, max((bend.most_m for bend in result.team_map.bends.values()), default=0.0)


def _pieces(
    grid: OccupancyGrid, what: Literal["appeared", "vanished"], mask: NDArray[np.bool_], least_m2: float
) -> tuple[list[Piece], NDArray[np.bool_]]:
    """Return the pieces of changed cells that are large enough, and their cells."""
    if not mask.any():
        return [], mask
    edge = 1 + math.floor(ONE_PIECE_M / grid.resolution_m + 1e-9)  # squares of it touch with that between their cells
    joined = cv2.dilate(mask.astype(np.uint8), np.ones((edge, edge), np.uint8))
    _, label = cv2.connectedComponents(joined, connectivity=8)
    cell_m2, labels = grid.resolution_m**2, label[mask]
    sizes = np.bincount(labels)
    is_piece = (sizes > 0) & (sizes * cell_m2 >= least_m2 - 1e-9)
    centres_m = grid.centres(mask)[np.argsort(labels, kind="stable")]  # piece by piece, row by row
    pieces = []
    for k, end in zip(np.flatnonzero(is_piece), np.cumsum(sizes)[is_piece], strict=True):
        own_m = centres_m[end - sizes[k] : end]
        (x, y), (wide, high) = own_m.mean(axis=0), np.ptp(own_m, axis=0) + grid.resolution_m
        pieces.append(Piece(what, float(x), float(y), float(wide), float(high), float(sizes[k] * cell_m2)))
    return pieces, mask & is_piece[label]
