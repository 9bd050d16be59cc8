"""A map drawn bent: only blocks are written again whose cells, or whose displacement, have changed since."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from mrslam.merge.grids.tiled_grid import BLOCK_CELLS, NOTHING, PER_TILE, TiledGrid, TileTable, any_by_block
from mrslam.merge.joint.bend_kernels import REACH, bend_tiles
from mrslam.spatial import UNKNOWN
from mrslam.spatial.tiles import TileIndex

STEP_CELLS = 0.25
"""Displacements are whole multiples of this: a solution that differs by less leaves the map as it was."""

RIM_TILES = 2
"""Tiles around a map into which it may be bent, 6.4 m of 5 cm cells: what comes to lie beyond is left out."""

Displacement = Callable[[NDArray[np.float64]], NDArray[np.float64]]


class _Drawing(NamedTuple):
    """What was drawn last."""

    published: TiledGrid
    tile0: TileIndex
    """The first of the box."""
    field: NDArray[np.float32]
    """``(R + 1, C + 1, 2)`` displacement (x, y) of the blocks' corners, cells; 0 where nothing known comes near."""
    bent: TiledGrid

    def lies_in(self, box: TileTable) -> bool:
        """Return whether all of its box lies in another one."""
        return all(
            now <= was and PER_TILE * was + corners - 1 <= PER_TILE * now + blocks
            for now, was, blocks, corners in zip(box.tile0, self.tile0, _blocks(box), self.field.shape, strict=False)
        )


class BentMap:
    """One robot's map as it was drawn last. What is drawn does not depend on what was drawn before."""

    def __init__(self) -> None:
        self._last: _Drawing | None = None
        self.blocks_drawn = 0
        """Blocks written so far."""

    def draw(self, published: TiledGrid, displacement: Displacement) -> TiledGrid:
        """Return the map bent in its own frame; tiles of which nothing has changed are the same objects as before.

        ``displacement`` maps points ``(N, 2)`` of the map's frame to their displacements ``(N, 2)``, both in metres. It
        is asked at the corners of blocks, and interpolated between them.
        """
        if not published.tiles:
            return published
        box = TileTable.of(published.tiles, RIM_TILES)

        def at_corners(corners: NDArray[np.int64]) -> NDArray[np.float64]:
            cells = (corners + PER_TILE * np.array(box.tile0))[:, ::-1] * BLOCK_CELLS
            moved_m = displacement(cells * published.resolution_m + np.asarray(published.offset_m))
            return STEP_CELLS * np.rint(moved_m / (published.resolution_m * STEP_CELLS))

        field, is_near = _field_near(_known_blocks(box), at_corners)
        last = self._last
        if last is not None and not (published.has_lattice_of(last.published) and last.lies_in(box)):
            last = None
        before = {} if last is None else last.bent.tiles
        is_stale = np.ones(_blocks(box), dtype=np.bool_) if last is None else _stale(published, box, field, last)
        self.blocks_drawn += int((is_stale & is_near).sum())
        bent = TiledGrid(_drawn(box, field, is_stale, is_near, before), published.resolution_m, published.offset_m)
        self._last = _Drawing(published, box.tile0, field, bent)
        return bent


def _blocks(box: TileTable) -> tuple[int, int]:
    """Return rows and columns of blocks in a box."""
    return PER_TILE * box.slots.shape[0], PER_TILE * box.slots.shape[1]


def _known_blocks(box: TileTable) -> NDArray[np.bool_]:
    """Return which blocks ``(R, C)`` of a box have a known cell."""
    is_known = np.zeros(_blocks(box), dtype=np.bool_)
    _by_tile(is_known)[box.slots >= 0] = any_by_block(box.pool != UNKNOWN)[box.slots[box.slots >= 0]]
    return is_known


def _field_near(
    is_known: NDArray[np.bool_], at_corners: Callable[[NDArray[np.int64]], NDArray[np.float64]]
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return the displacement ``(R + 1, C + 1, 2)`` of blocks' corners in cells, and which blocks are near a known one.

    Only to those can something be moved, and of their corners alone is the displacement asked: most of a long
    corridor's box is far from anything. ``at_corners`` maps corners ``(N, 2)`` (row, column) to theirs ``(N, 2)``.
    """
    field = np.zeros((is_known.shape[0] + 1, is_known.shape[1] + 1, 2), dtype=np.float32)
    asked = _corners(is_known)
    field[asked] = at_corners(np.argwhere(asked))
    is_near = maximum_filter(is_known, _reached(field))
    asked = _corners(is_near) & ~asked
    field[asked] = at_corners(np.argwhere(asked))
    return field, is_near


def _stale(published: TiledGrid, box: TileTable, field: NDArray[np.float32], last: _Drawing) -> NDArray[np.bool_]:
    """Return which blocks ``(R, C)`` may not be as they were drawn last."""
    is_changed = np.ones(_blocks(box), dtype=np.bool_)
    row, col = (PER_TILE * (was - now) for was, now in zip(last.tile0, box.tile0, strict=True))
    rows, cols = last.field.shape[0] - 1, last.field.shape[1] - 1
    moved = (field[row : row + rows + 1, col : col + cols + 1] != last.field).any(axis=2)
    is_changed[row : row + rows, col : col + cols] = _of_corners(moved)
    changed = published.changed_blocks(last.published) - PER_TILE * np.array(box.tile0)
    is_changed[tuple(changed.T)] = True
    return np.asarray(maximum_filter(is_changed, max(_reached(field), _reached(last.field))))


def _drawn(
    box: TileTable,
    field: NDArray[np.float32],
    is_stale: NDArray[np.bool_],
    is_near: NDArray[np.bool_],
    before: Mapping[TileIndex, NDArray[np.int8]],
) -> dict[TileIndex, NDArray[np.int8]]:
    """Return the bent tiles: those of ``before`` with their stale blocks drawn."""
    was_drawn = np.zeros(box.slots.shape, dtype=np.bool_)
    for i, j in before:
        was_drawn[i - box.tile0[0], j - box.tile0[1]] = True
    is_stale_tile, is_near_tile = (_by_tile(blocks).any(axis=(2, 3)) for blocks in (is_stale, is_near))
    # As a kernel takes it: other layouts and types would be compiled anew, while a robot waits.
    todo = np.ascontiguousarray(np.argwhere(is_stale_tile & (is_near_tile | was_drawn)))
    indices: list[TileIndex] = [(i, j) for i, j in (todo + np.array(box.tile0)).tolist()]
    out = np.array([before.get(index, NOTHING) for index in indices], dtype=np.int8).reshape(-1, *NOTHING.shape)
    by_block = out.reshape(-1, PER_TILE, BLOCK_CELLS, PER_TILE, BLOCK_CELLS).swapaxes(2, 3)
    by_block[_by_tile(is_stale)[tuple(todo.T)]] = UNKNOWN
    bend_tiles(box.pool, box.slots, field, todo, is_stale & is_near, out)
    tiles = {**before}
    for index, tile in zip(indices, out, strict=True):
        if not (tile != UNKNOWN).any():
            tiles.pop(index, None)
        elif not np.array_equal(tile, before.get(index, NOTHING)):
            tiles[index] = tile.copy()
    return tiles


def _reached(field: NDArray[np.float32]) -> int:
    """Return how many blocks in a row can be reached from the middle one by what is moved by a field."""
    return 2 * math.ceil((float(np.abs(field).max()) + REACH) / BLOCK_CELLS) + 1


def _corners(blocks: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the corners ``(R + 1, C + 1)`` of the marked ones of blocks ``(R, C)``."""
    return _of_corners(np.pad(blocks, 1))


def _of_corners(corners: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the blocks ``(R, C)`` with a marked one among their four corners ``(R + 1, C + 1)``."""
    return np.asarray(corners[:-1, :-1] | corners[1:, :-1] | corners[:-1, 1:] | corners[1:, 1:])


def _by_tile(blocks: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return blocks ``(2 I, 2 J)`` as a view ``(I, J, 2, 2)``."""
    rows, cols = blocks.shape[0] // PER_TILE, blocks.shape[1] // PER_TILE
    return blocks.reshape(rows, PER_TILE, cols, PER_TILE).swapaxes(1, 2)
