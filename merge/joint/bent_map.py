"""A map drawn bent: only blocks are written again whose cells, or whose displacement, have changed since."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from mrslam.merge.grids.layers import any_by_block, on_canvas, same_lattice
from mrslam.merge.joint.bend_kernels import bend_blocks
from mrslam.spatial import UNKNOWN, OccupancyGrid

NODE_CELLS = 32
"""Edge of the blocks, and distance of the nodes between which displacement is interpolated, cells: half a tile."""
STEP_CELLS = 0.25
"""Displacements are whole multiples of this: a solution that differs by less leaves the map as it was."""
REACH_CELLS = 2
"""A wall is joined to its neighbours, so that a block depends on cells this much further away than they are moved."""

Displacement = Callable[[NDArray[np.float64]], NDArray[np.float64]]


class _Drawing(NamedTuple):
    """What was drawn last; blocks are those of the map frame's lattice."""

    grid: OccupancyGrid
    block0: tuple[int, int]
    """Block (row, column) of the first one here."""
    cells: NDArray[np.int8]
    """``(32 R, 32 C)`` as published."""
    field: NDArray[np.float32]
    """``(R + 1, C + 1, 2)`` displacement (x, y) of the blocks' corners, cells; 0 where nothing known comes near."""
    bent: NDArray[np.int8]
    """``(32 R, 32 C)``."""


class BentMap:
    """One robot's map as it was drawn last. What is drawn does not depend on what was drawn before."""

    def __init__(self) -> None:
        self._last: _Drawing | None = None
        self.blocks_drawn = 0
        """Blocks written so far."""

    def draw(self, grid: OccupancyGrid, displacement: Displacement) -> OccupancyGrid:
        """Return the map bent in its own frame.

        ``displacement`` maps points ``(N, 2)`` of the map's frame to their displacements ``(N, 2)``, both in metres.
        """
        cropped = grid.cropped()
        if cropped.cells.size == 0:
            return cropped
        block0, cells = _in_blocks(cropped)
        offset_m = np.asarray(cropped.origin_m) - np.array(cropped.cell0[::-1]) * cropped.resolution_m

        def at_corners(rows: NDArray[np.int64], cols: NDArray[np.int64]) -> NDArray[np.float64]:
            corners = np.stack([cols + block0[1], rows + block0[0]], axis=-1) * NODE_CELLS
            moved_m = displacement(corners * cropped.resolution_m + offset_m)
            return STEP_CELLS * np.rint(moved_m / (cropped.resolution_m * STEP_CELLS))

        field, is_near = _field_near(any_by_block(cells != UNKNOWN, NODE_CELLS), at_corners)
        is_stale, bent = self._before(cropped, block0, cells, field)
        self.blocks_drawn += int((is_stale & is_near).sum())
        bend_blocks(cells, field, is_stale, is_near, bent)
        self._last = _Drawing(cropped, block0, cells, field, bent)
        origin_m = offset_m + np.array(block0[::-1]) * NODE_CELLS * cropped.resolution_m
        return OccupancyGrid(bent, cropped.resolution_m, (float(origin_m[0]), float(origin_m[1]))).cropped()

    def _before(
        self, grid: OccupancyGrid, block0: tuple[int, int], cells: NDArray[np.int8], field: NDArray[np.float32]
    ) -> tuple[NDArray[np.bool_], NDArray[np.int8]]:
        """Return the blocks ``(R, C)`` that are not as they were drawn last, and all as they were, ``(32 R, 32 C)``."""
        bent = np.full(cells.shape, UNKNOWN, dtype=np.int8)
        shape = field.shape[0] - 1, field.shape[1] - 1
        is_changed, most_cells = np.ones(shape, dtype=np.bool_), float(np.abs(field).max())
        if (last := self._last) is None or not _continues(grid, block0, shape, last):
            return is_changed, bent
        rows, cols = (
            slice(was - now, was - now + count - 1)
            for was, now, count in zip(last.block0, block0, last.field.shape, strict=False)
        )
        inner = _cells(rows), _cells(cols)
        moved = (field[rows.start : rows.stop + 1, cols.start : cols.stop + 1] != last.field).any(axis=2)
        is_changed[rows, cols] = any_by_block(cells[inner] != last.cells, NODE_CELLS) | _of_corners(moved)
        bent[inner] = last.bent
        most_cells = max(most_cells, float(np.abs(last.field).max()))
        return maximum_filter(is_changed, _reached(most_cells)), bent


def _field_near(
    is_known: NDArray[np.bool_], at_corners: Callable[[NDArray[np.int64], NDArray[np.int64]], NDArray[np.float64]]
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return the displacement ``(R + 1, C + 1, 2)`` of blocks' corners in cells, and which blocks are near a known one.

    Only to those can something be moved, and of their corners alone is the displacement asked: most of a long
    corridor's box is far from anything. ``at_corners`` maps rows and columns ``(N,)`` of corners to displacements ``(N, 2)``.
    """
    field = np.zeros((is_known.shape[0] + 1, is_known.shape[1] + 1, 2), dtype=np.float32)
    asked = _corners(is_known)
    field[asked] = at_corners(*np.nonzero(asked))
    is_near = maximum_filter(is_known, _reached(float(np.abs(field).max())))
    asked = _corners(is_near) & ~asked
    field[asked] = at_corners(*np.nonzero(asked))
    return field, is_near


def _reached(cells: float) -> int:
    """Return how many blocks in a row can be reached from the middle one by what is moved by so many cells."""
    return 2 * math.ceil((cells + REACH_CELLS) / NODE_CELLS) + 1


def _corners(blocks: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the corners ``(R + 1, C + 1)`` of the marked ones of blocks ``(R, C)``."""
    return _of_corners(np.pad(blocks, 1))


def _of_corners(corners: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the blocks ``(R, C)`` with a marked one among their four corners ``(R + 1, C + 1)``."""
    return np.asarray(corners[:-1, :-1] | corners[1:, :-1] | corners[:-1, 1:] | corners[1:, 1:])


def _cells(blocks: slice) -> slice:
    return slice(NODE_CELLS * blocks.start, NODE_CELLS * blocks.stop)


def _in_blocks(grid: OccupancyGrid) -> tuple[tuple[int, int], NDArray[np.int8]]:
    """Return the lattice block of the first cell, and the cells in whole blocks with one unknown block all round."""
    row0, col0 = (start // NODE_CELLS - 1 for start in grid.cell0)
    top, left = grid.cell0[0] - row0 * NODE_CELLS, grid.cell0[1] - col0 * NODE_CELLS
    height, width = (
        (-(-(before + size) // NODE_CELLS) + 1) * NODE_CELLS
        for before, size in zip((top, left), grid.shape, strict=True)
    )
    return (row0, col0), on_canvas(grid, height, width, row0 * NODE_CELLS, col0 * NODE_CELLS)


def _continues(grid: OccupancyGrid, block0: tuple[int, int], shape: tuple[int, int], last: _Drawing) -> bool:
    """Return whether a map has the lattice of the last one, and covers all of its blocks; else all is drawn again."""
    return same_lattice(grid, last.grid) and all(
        now <= was and was + corners - 1 <= now + count
        for now, count, was, corners in zip(block0, shape, last.block0, last.field.shape, strict=False)
    )
