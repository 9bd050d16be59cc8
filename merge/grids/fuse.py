"""Fusing maps that are in one frame and lattice: unknown never overwrites known, known with known adds up."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.config import FUSIONS
from mrslam.merge.grids.fuse_kernels import NOTHING, combine
from mrslam.spatial import UNKNOWN, InputError, OccupancyGrid

SCALE = 256.0
"""Log-odds are kept in whole numbers of 1/256, which is finer than a percent anywhere within the clamp."""
CLAMP = 3
"""Percent: one map counts as at least this and at most 100 less this, so that no evidence is beyond later evidence."""


def _log_odds_of_percent() -> NDArray[np.int32]:
    p = np.clip(np.arange(101), CLAMP, 100 - CLAMP) / 100.0
    return np.rint(SCALE * np.log(p / (1.0 - p))).astype(np.int32)


_LOG_ODDS = _log_odds_of_percent()
_LIMIT = int(_LOG_ODDS[-1])


def _percent_of_log_odds() -> NDArray[np.int32]:
    percent = np.rint(100.0 / (1.0 + np.exp(-np.arange(-_LIMIT, _LIMIT + 1) / SCALE))).astype(np.int32)
    percent[0], percent[-1] = 0, 100
    return percent


_PERCENT = _percent_of_log_odds()
_MEAN_ONE = 1 << 16
"""One observation in the upper half of a mean's evidence; the sum of percents is in the lower half."""


def to_evidence(cells: NDArray[np.int8], method: str) -> NDArray[np.int32]:
    """Return ``(H, W) int32`` evidence of cells -1..100 under a fusion method."""
    percent = np.maximum(cells, 0).astype(np.int32)
    if method == "log-odds":
        value = _LOG_ODDS[percent]
    elif method == "mean":
        value = percent + _MEAN_ONE
    else:
        value = percent
    return np.where(cells == UNKNOWN, np.int32(NOTHING), value).astype(np.int32)


def to_cells(evidence: NDArray[np.int32], method: str) -> NDArray[np.int8]:
    """Return cells -1..100 from evidence; sums of log-odds are clamped, their ends are written as 0 and 100."""
    seen = evidence != NOTHING
    known = np.where(seen, evidence, 0)
    if method == "log-odds":
        percent = _PERCENT[np.clip(known, -_LIMIT, _LIMIT) + _LIMIT]
    elif method == "mean":
        total, count = known % _MEAN_ONE, np.maximum(known // _MEAN_ONE, 1)
        percent = (2 * total + count) // (2 * count)
    else:
        percent = known
    return np.where(seen, percent, UNKNOWN).astype(np.int8)


def fuse_evidence(one: NDArray[np.int32], two: NDArray[np.int32], method: str) -> NDArray[np.int32]:
    """Return the evidence of both; exactly associative and commutative."""
    out = np.empty_like(one)
    combine(one, two, method == "max", out)
    return out


def fuse(layers: Sequence[OccupancyGrid], method: str = "log-odds") -> OccupancyGrid:
    """Return one grid over all layers' extent: any order of the layers gives the same bytes.

    "log-odds" adds evidence, clamped; "max" keeps the highest occupancy, "mean" averages. All layers need one
    resolution and origins on its lattice (as :func:`mrslam.merge.grids.warp` makes them), else ``InputError``.
    """
    if method not in FUSIONS:
        raise InputError(f"fusion method must be one of {', '.join(FUSIONS)}, got {method!r}")
    if not layers:
        raise InputError("nothing to fuse: no layers given")
    resolution_m = layers[0].resolution_m
    for layer in layers:
        if abs(layer.resolution_m - resolution_m) > 1e-9:
            raise InputError(
                f"layers have cells of {resolution_m} m and {layer.resolution_m} m: warp them to one resolution"
            )
        if not layer.on_lattice:
            raise InputError(
                f"a layer's origin {layer.origin_m} is not on the lattice of {resolution_m} m: warp it first"
            )
    layers = [layer for layer in layers if layer.cells.size]
    if not layers:
        return OccupancyGrid(np.empty((0, 0), dtype=np.int8), resolution_m)
    row0, col0 = (min(layer.cell0[axis] for layer in layers) for axis in (0, 1))
    row1, col1 = (max(layer.cell0[axis] + layer.shape[axis] for layer in layers) for axis in (0, 1))
    evidence = np.full((row1 - row0, col1 - col0), NOTHING, dtype=np.int32)
    for layer in layers:
        r, c = layer.cell0[0] - row0, layer.cell0[1] - col0
        part = evidence[r : r + layer.shape[0], c : c + layer.shape[1]]
        part[...] = fuse_evidence(np.ascontiguousarray(part), to_evidence(layer.cells, method), method)
    return OccupancyGrid.at_cell(to_cells(evidence, method), resolution_m, row0, col0)
