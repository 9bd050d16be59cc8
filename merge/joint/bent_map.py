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
    """``(R + 1, C + 1, 2)`` displacement (x, y) of the blocks' corners, cells."""
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
        rows, cols = (
            (start + np.arange(size // NODE_CELLS + 1)) * NODE_CELLS
            for start, size in zip(block0, cells.shape, strict=True)
        )
        nodes_m = np.stack(np.meshgrid(cols, rows), axis=-1) * cropped.resolution_m + offset_m
        steps = np.rint(displacement(nodes_m.reshape(-1, 2)) / (cropped.resolution_m * STEP_CELLS))
        field = np.ascontiguousarray((STEP_CELLS * steps).reshape(nodes_m.shape), dtype=np.float32)
        bent = np.full(cells.shape, UNKNOWN, dtype=np.int8)
        todo = self._todo(cropped, block0, cells, field, bent)
        self.blocks_drawn += int(todo.sum())
        bend_blocks(cells, field, todo, bent)
        self._last = _Drawing(cropped, block0, cells, field, bent)
        origin_m = offset_m + np.array([cols[0], rows[0]]) * cropped.resolution_m
        return OccupancyGrid(bent, cropped.resolution_m, (float(origin_m[0]), float(origin_m[1]))).cropped()

    def _todo(
        self, grid: OccupancyGrid, block0: tuple[int, int], cells: NDArray[np.int8], field: NDArray[np.float32],
        bent: NDArray[np.int8],
    ) -> NDArray[np.bool_]:  # fmt: skip
        """Return the blocks ``(R, C)`` to write; copy those into ``bent`` that are as they were."""
        is_known = any_by_block(cells != UNKNOWN, NODE_CELLS)
        is_changed, most_cells = np.ones_like(is_known), float(np.abs(field).max())
        if (last := self._last) is not None and _continues(grid, block0, is_known.shape, last):
            rows, cols = (
                slice(was - now, was - now + size // NODE_CELLS)
                for was, now, size in zip(last.block0, block0, last.cells.shape, strict=True)
            )
            inner = (
                slice(NODE_CELLS * rows.start, NODE_CELLS * rows.stop),
                slice(NODE_CELLS * cols.start, NODE_CELLS * cols.stop),
            )
            moved = (field[rows.start : rows.stop + 1, cols.start : cols.stop + 1] != last.field).any(axis=2)
            is_moved = moved[:-1, :-1] | moved[1:, :-1] | moved[:-1, 1:] | moved[1:, 1:]
            is_changed[rows, cols] = any_by_block(cells[inner] != last.cells, NODE_CELLS) | is_moved
            bent[inner] = last.bent
            most_cells = max(most_cells, float(np.abs(last.field).max()))
        size = 2 * math.ceil((most_cells + REACH_CELLS) / NODE_CELLS) + 1
        is_stale = maximum_filter(is_changed, size)
        bent[np.repeat(np.repeat(is_stale, NODE_CELLS, axis=0), NODE_CELLS, axis=1)] = UNKNOWN
        return np.asarray(is_stale & maximum_filter(is_known, size))


def _in_blocks(grid: OccupancyGrid) -> tuple[tuple[int, int], NDArray[np.int8]]:
    """Return the lattice block of the first cell, and the cells in whole blocks with one unknown block all round."""
    row0, col0 = (start // NODE_CELLS - 1 for start in grid.cell0)
    top, left = grid.cell0[0] - row0 * NODE_CELLS, grid.cell0[1] - col0 * NODE_CELLS
    height, width = (
        (-(-(before + size) // NODE_CELLS) + 1) * NODE_CELLS
        for before, size in zip((top, left), grid.shape, strict=True)
    )
    return (row0, col0), on_canvas(grid, (height, width), row0 * NODE_CELLS, col0 * NODE_CELLS)


def _continues(grid: OccupancyGrid, block0: tuple[int, int], blocks: tuple[int, ...], last: _Drawing) -> bool:
    """Return whether a map has the lattice of the last one, and covers all of its blocks; else all is drawn again."""
    return same_lattice(grid, last.grid) and all(
        now <= was and was + size // NODE_CELLS <= now + count
        for now, count, was, size in zip(block0, blocks, last.block0, last.cells.shape, strict=True)
    )
