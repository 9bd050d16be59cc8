"""Shortest paths and frontiers on small grids."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

DIAGONAL = math.sqrt(2.0)


@njit(cache=True, nogil=True)
def _push(
    keys: NDArray[np.float32], cells: NDArray[np.int32], size: int, key: float, cell: int
) -> None:  # pragma: no cover - compiled
    i = size
    while i > 0:
        parent = (i - 1) >> 1
        if keys[parent] <= key:
            break
        keys[i], cells[i] = keys[parent], cells[parent]
        i = parent
    keys[i], cells[i] = key, cell


@njit(cache=True, nogil=True)
def _pop(keys: NDArray[np.float32], cells: NDArray[np.int32], size: int) -> None:  # pragma: no cover - compiled
    """Take the top off a heap of ``size``; the rest stays a heap of ``size - 1``."""
    key, cell = keys[size - 1], cells[size - 1]
    i, last = 0, size - 1
    while True:
        child = 2 * i + 1
        if child >= last:
            break
        if child + 1 < last and keys[child + 1] < keys[child]:
            child += 1
        if keys[child] >= key:
            break
        keys[i], cells[i] = keys[child], cells[child]
        i = child
    keys[i], cells[i] = key, cell


@njit(cache=True, nogil=True)
def _least_rest(r: int, c: int, goal_row: int, goal_col: int) -> float:  # pragma: no cover - compiled
    """Return the least cost from a cell to the goal; 0 without one."""
    if goal_row < 0:
        return 0.0
    a, b = abs(goal_row - r), abs(goal_col - c)
    return max(a, b) + (DIAGONAL - 1.0) * min(a, b)


@njit(cache=True, nogil=True)
def travel(
    weight: NDArray[np.float32], rows: NDArray[np.int32], cols: NDArray[np.int32], goal_row: int, goal_col: int
) -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.int32]]:  # pragma: no cover - compiled
    """Return cost from the nearest source, the cell before, and which source, for every cell.

    ``weight`` : ``(H, W)``, cost of a step of one cell, >= 1; inf = blocked. ``rows``, ``cols`` : the sources.
    With a goal (row >= 0) this is A* (Hart, Nilsson, Raphael 1968) and ends there; without one it is Dijkstra's.
    Costs are inf, the others -1, where nothing was reached. Eight neighbours; no cutting of blocked corners.
    """
    return _spread(weight, rows, cols, goal_row, goal_col, np.full(weight.shape, np.float32(np.inf), dtype=np.float32))


@njit(cache=True, nogil=True)
def nearer(
    weight: NDArray[np.float32], rows: NDArray[np.int32], cols: NDArray[np.int32], cost: NDArray[np.float32]
) -> NDArray[np.bool_]:  # pragma: no cover - compiled
    """Return ``(H, W)``, the cells that these sources reach at less than ``cost (H, W)``, which another one has.

    Only they are looked at: a way through a cell that is nearer to the other one leads nowhere where that is not so.
    """
    return _spread(weight, rows, cols, -1, -1, cost.copy())[2] >= 0


@njit(cache=True, nogil=True)
def _spread(
    weight: NDArray[np.float32],
    rows: NDArray[np.int32],
    cols: NDArray[np.int32],
    goal_row: int,
    goal_col: int,
    cost: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.int32]]:  # pragma: no cover - compiled
    """Do what :func:`travel` does, to cells that cost less than ``cost (H, W)`` has; that is changed, and returned."""
    height, width = weight.shape
    blocked = np.float32(np.inf)
    before = np.full((height, width), -1, dtype=np.int32)
    source = np.full((height, width), -1, dtype=np.int32)
    done = np.zeros((height, width), dtype=np.bool_)
    capacity = 8 * height * width + rows.size + 1  # every cell is pushed by each neighbour at most
    keys, cells, size = np.empty(capacity, dtype=np.float32), np.empty(capacity, dtype=np.int32), 0
    for i in range(rows.size):
        r, c = rows[i], cols[i]
        if weight[r, c] < blocked and cost[r, c] > 0.0:
            cost[r, c], source[r, c] = 0.0, i
            _push(keys, cells, size, 0.0, r * width + c)
            size += 1
    while size > 0:
        cell = cells[0]
        _pop(keys, cells, size)
        size -= 1
        r, c = cell // width, cell % width
        if done[r, c]:
            continue
        done[r, c] = True
        if r == goal_row and c == goal_col:
            break
        own, so_far, whose = weight[r, c], cost[r, c], source[r, c]
        for nr in range(max(r - 1, 0), min(r + 2, height)):
            for nc in range(max(c - 1, 0), min(c + 2, width)):
                there = weight[nr, nc]
                if done[nr, nc] or not there < blocked:
                    continue
                length = 1.0
                if nr != r and nc != c:
                    if not (weight[r, nc] < blocked and weight[nr, c] < blocked):
                        continue
                    length = DIAGONAL
                new = np.float32(so_far + length * 0.5 * (own + there))
                if new < cost[nr, nc]:
                    cost[nr, nc], before[nr, nc], source[nr, nc] = new, cell, whose
                    _push(keys, cells, size, float(new) + _least_rest(nr, nc, goal_row, goal_col), nr * width + nc)
                    size += 1
    return cost, before, source


@njit(cache=True, nogil=True)
def trace(before: NDArray[np.int32], row: int, col: int) -> NDArray[np.int32]:  # pragma: no cover - compiled
    """Return the path ``(N, 2)`` of (row, col) that ends at this cell, by the ``before`` of :func:`travel`."""
    height, width = before.shape
    count, cell = 1, before[row, col]
    while cell >= 0 and count < height * width:
        count += 1
        cell = before[cell // width, cell % width]
    path = np.empty((count, 2), dtype=np.int32)
    cell = row * width + col
    for i in range(count - 1, -1, -1):
        path[i, 0], path[i, 1] = cell // width, cell % width
        cell = before[cell // width, cell % width]
    return path


@njit(cache=True, nogil=True)
def hang_together(weight: NDArray[np.float32], row: int, col: int, least: int) -> bool:  # pragma: no cover - compiled
    """Return whether at least so many open cells hang together at one; steps past a blocked corner are none.

    ``weight`` : as of :func:`travel`; the cell is open.
    """
    height, width = weight.shape
    seen = np.zeros((height, width), dtype=np.bool_)
    group = np.empty(least + 4, dtype=np.int64)
    seen[row, col] = True
    group[0], size, i = row * width + col, 1, 0
    while i < size < least:
        r, c = group[i] // width, group[i] % width
        i += 1
        for nr, nc in ((r - 1, c), (r + 1, c), (r, c - 1), (r, c + 1)):
            if 0 <= nr < height and 0 <= nc < width and not seen[nr, nc] and math.isfinite(weight[nr, nc]):
                seen[nr, nc] = True
                group[size] = nr * width + nc
                size += 1
    return size >= least


@njit(cache=True, nogil=True)
def _flood(
    candidate: NDArray[np.bool_], seen: NDArray[np.bool_], first: int, group: NDArray[np.int32]
) -> int:  # pragma: no cover - compiled
    """Write the cells connected with the first one to ``group``, mark them as seen, and return how many there are."""
    height, width = candidate.shape
    seen[first // width, first % width] = True
    group[0], size, i = first, 1, 0
    while i < size:
        r, c = group[i] // width, group[i] % width
        i += 1
        for nr in range(max(r - 1, 0), min(r + 2, height)):
            for nc in range(max(c - 1, 0), min(c + 2, width)):
                if candidate[nr, nc] and not seen[nr, nc]:
                    seen[nr, nc] = True
                    group[size] = nr * width + nc
                    size += 1
    return size


@njit(cache=True, nogil=True)
def _viewpoint(
    cost: NDArray[np.float32], group: NDArray[np.int32], size: int, window: int
) -> tuple[int, int]:  # pragma: no cover - compiled
    """Return the reached cell near a group of cells that is nearest to the group's middle; (-1, -1) for none."""
    height, width = cost.shape
    mean_r, mean_c = 0.0, 0.0
    for i in range(size):
        mean_r += group[i] // width
        mean_c += group[i] % width
    mean_r /= size
    mean_c /= size
    best, best_r, best_c = np.inf, -1, -1
    for i in range(size):
        r, c = group[i] // width, group[i] % width
        away = (r - mean_r) ** 2 + (c - mean_c) ** 2
        for nr in range(max(r - window, 0), min(r + window + 1, height)):
            for nc in range(max(c - window, 0), min(c + window + 1, width)):
                score = away + (nr - r) ** 2 + (nc - c) ** 2
                if score < best and math.isfinite(cost[nr, nc]):
                    best, best_r, best_c = score, nr, nc
    return best_r, best_c


@njit(cache=True, nogil=True)
def frontiers(
    candidate: NDArray[np.bool_], cost: NDArray[np.float32], window: int
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:  # pragma: no cover - compiled
    """Return connected groups of candidate cells: sizes ``(F,)`` in cells, and ``(F, 2)`` where to go to see each.

    ``cost`` : of :func:`travel`. The place to go is, among the reached cells at most ``window`` cells from one of the
    group's, the one nearest to the group's middle; (-1, -1) where there is none.
    """
    height, width = candidate.shape
    seen = np.zeros((height, width), dtype=np.bool_)
    group = np.empty(height * width, dtype=np.int32)
    sizes = np.empty(height * width, dtype=np.int32)
    goals = np.empty((height * width, 2), dtype=np.int32)
    count = 0
    for r in range(height):
        for c in range(width):
            if candidate[r, c] and not seen[r, c]:
                sizes[count] = _flood(candidate, seen, r * width + c, group)
                goals[count, 0], goals[count, 1] = _viewpoint(cost, group, sizes[count], window)
                count += 1
    return sizes[:count].copy(), goals[:count].copy()
