"""The team map as a picture: every robot's part in its own colour."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mrslam.merge.draw_kernels import add_layer, paint
from mrslam.merge.grids.layers import Layer
from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.merge.joint.bent_map import BentMap
from mrslam.merge.team import TeamMap
from mrslam.spatial import FREE_MAX, OCCUPIED_MIN, UNKNOWN, OccupancyGrid, se2
from mrslam.spatial.tiles import assembled

PALETTE = (
    (31, 119, 180),
    (230, 97, 1),
    (44, 150, 70),
    (200, 40, 80),
    (120, 84, 190),
    (0, 158, 170),
    (205, 140, 0),
    (110, 110, 110),
    (227, 119, 194),
    (100, 140, 30),
)
"""RGB of the robots, in the order of their ids; from the eleventh on they repeat."""
PAPER = (243, 243, 240)
"""RGB of unknown space and of the margin."""
INK = (40, 40, 44)
"""RGB of text, and of walls that no layer shows."""
FREE_TINT = 0.22
"""Share of a robot's colour in its free space, 0..1."""
WALL_SHADE = 0.75
"""Brightness of a wall relative to its robot's colour, 0..1."""
MIXES = np.array([(255 * (1 - FREE_TINT), FREE_TINT), (0.35 * 255, 0.65), (0.0, WALL_SHADE)], dtype=np.float32)
"""Brightness added to the robots' colour, and share of it: in free space, where it is unsure, in walls."""
BAND_ROWS = 256
"""Rows painted at once: bounds the memory of colours as float32."""
PAD_PX = 24
"""Margin around the picture, pixels."""


def colours(ids: Sequence[str]) -> dict[str, tuple[int, int, int]]:
    """Return each robot's RGB colour."""
    return {robot_id: PALETTE[i % len(PALETTE)] for i, robot_id in enumerate(sorted(ids))}


def draw_team(
    team_map: TeamMap,
    layers: Mapping[str, OccupancyGrid],
    trajectories: Mapping[str, ArrayLike] | None = None,
    legend: bool = True,
    size_px: int = 1400,
    ties_m: Sequence[ArrayLike] = (),
) -> NDArray[np.uint8]:
    """Return the picture ``(H, W, 3) uint8`` RGB, first row on top.

    ``ties_m`` are places that two robots saw, ``(2, 2)`` each: where each of them was, in the team frame.
    ``layers`` are the robots' own maps in their own frames; ``trajectories`` ``(K, 2 or 3)`` poses in their own frames,
    metres. Free space is tinted by the robots that saw it, walls are drawn in their colours. The longer side of the map
    gets about ``size_px``.
    """
    import cv2

    grid = team_map.grid
    if grid.cells.size == 0:
        return _with_legend(np.full((120, 360, 3), PAPER, dtype=np.uint8), team_map, {}, 0.0)
    hue = colours(list(layers))
    picture = _painted(team_map, layers, hue)
    height, width = grid.shape
    scale = size_px / max(height, width)
    shape = (max(1, round(width * scale)), max(1, round(height * scale)))
    smooth = cv2.INTER_AREA if scale < 1 else cv2.INTER_NEAREST
    picture = np.asarray(cv2.resize(picture, shape, interpolation=smooth), dtype=np.uint8)
    for robot_id in sorted(trajectories or {}):
        T_team_map = team_map.T_team_map.get(robot_id)
        points = np.asarray((trajectories or {})[robot_id], dtype=np.float64)
        if T_team_map is None or len(points) == 0:
            continue
        cells = (se2.apply(T_team_map, points[:, :2]) - np.asarray(grid.origin_m)) / grid.resolution_m
        pixels = np.stack([cells[:, 0] * scale, (height - cells[:, 1]) * scale], axis=-1)
        _draw_path(picture, pixels, hue.get(robot_id, INK))
    for ends in ties_m:
        cells = (np.asarray(ends, dtype=np.float64) - np.asarray(grid.origin_m)) / grid.resolution_m
        _draw_tie(picture, np.stack([cells[:, 0] * scale, (height - cells[:, 1]) * scale], axis=-1))
    picture = _bordered(picture, PAD_PX, PAD_PX, PAD_PX, PAD_PX)
    return _with_legend(picture, team_map, hue, scale / grid.resolution_m) if legend else picture


def _painted(
    team_map: TeamMap, layers: Mapping[str, OccupancyGrid], hue: Mapping[str, tuple[int, int, int]]
) -> NDArray[np.uint8]:
    """Return the team map at one pixel a cell, first row on top; band by band, for colours take much room."""
    grid = team_map.grid
    warped = laid(team_map, layers)
    height, width = grid.shape
    picture = np.empty((height, width, 3), dtype=np.uint8)
    memory = np.empty((2, min(BAND_ROWS, height), width, 4), dtype=np.float32)
    for row in range(0, height, BAND_ROWS):
        rows = min(BAND_ROWS, height - row)
        band = _painted_band(grid, row, memory[:, :rows], warped, hue)
        picture[height - row - rows : height - row] = band[::-1]
    return picture


def laid(team_map: TeamMap, layers: Mapping[str, OccupancyGrid]) -> dict[str, OccupancyGrid]:
    """Return the placed robots' maps in the team frame and lattice, bent where the team map bends them."""
    out: dict[str, OccupancyGrid] = {}
    for robot_id, T_team_map in team_map.T_team_map.items():
        if robot_id in layers:
            bend, layer = team_map.bends.get(robot_id), TiledGrid.of(layers[robot_id])
            if bend is not None:
                layer, T_team_map = BentMap().draw(layer, bend.displacement), bend.T_team_map
            drawn = Layer()
            drawn.update(layer, T_team_map, team_map.grid.resolution_m)
            out[robot_id] = assembled(drawn.tiles, team_map.grid.resolution_m)
    return out


def overlaid(team_map: TeamMap, layers: Mapping[str, OccupancyGrid]) -> TeamMap:
    """Return what the team map would be without any bending: the maps laid over each other, every wall shown."""
    rigid = replace(team_map, bends={}, T_team_map=team_map.T_rigid)
    grids = [grid for grid in laid(rigid, layers).values() if grid.cells.size]
    corners = np.array([[grid.cell0, np.add(grid.cell0, grid.shape)] for grid in grids]).reshape(-1, 2, 2)
    low, high = corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)
    cells = np.full(high - low, UNKNOWN, dtype=np.int8)
    for grid, (start, end) in zip(grids, corners - low, strict=True):
        part = cells[start[0] : end[0], start[1] : end[1]]
        np.maximum(part, grid.cells, out=part)
    return replace(rigid, grid=OccupancyGrid.at_cell(cells, team_map.grid.resolution_m, *map(int, low)))


def _draw_tie(picture: NDArray[np.uint8], pixels: NDArray[np.float64]) -> None:
    """Draw where two robots saw the same place, a dot each, joined."""
    import cv2

    start, end = (tuple(int(v) for v in point) for point in np.rint(pixels * 16).astype(np.int32))
    cv2.line(picture, start, end, INK, 1, cv2.LINE_AA, 4)
    for at in (start, end):
        cv2.circle(picture, at, 3 * 16, INK, -1, cv2.LINE_AA, 4)


def _painted_band(
    grid: OccupancyGrid,
    row: int,
    memory: NDArray[np.float32],
    warped: Mapping[str, OccupancyGrid],
    hue: Mapping[str, tuple[int, int, int]],
) -> NDArray[np.uint8]:
    """Return some rows of the picture, lowest first; ``memory (2, rows, W, 4)`` is overwritten."""
    memory[...] = 0.0
    free, wall = memory
    for robot_id, layer in warped.items():
        row0, col0 = layer.cell0[0] - grid.cell0[0] - row, layer.cell0[1] - grid.cell0[1]
        colour = np.array(hue[robot_id], dtype=np.float32)
        add_layer(layer.cells, row0, col0, colour, FREE_MAX, OCCUPIED_MIN, free, wall)
    picture = np.empty((*free.shape[:2], 3), dtype=np.uint8)
    picture[...] = PAPER
    ink = np.array(INK, dtype=np.float32)
    paint(grid.cells[row : row + free.shape[0]], FREE_MAX, OCCUPIED_MIN, free, wall, ink, MIXES, picture)
    return picture


def _draw_path(picture: NDArray[np.uint8], pixels: NDArray[np.float64], colour: tuple[int, int, int]) -> None:
    """Draw a trajectory with a ring where it starts and a dot where it ends."""
    import cv2

    fixed = np.rint(pixels * 16).astype(np.int32)
    dark = tuple(int(0.75 * c) for c in colour)
    cv2.polylines(picture, [fixed.reshape(-1, 1, 2)], False, (255, 255, 255), 4, cv2.LINE_AA, 4)
    cv2.polylines(picture, [fixed.reshape(-1, 1, 2)], False, dark, 2, cv2.LINE_AA, 4)
    start, end = (tuple(int(v) for v in fixed[i]) for i in (0, -1))
    cv2.circle(picture, start, 6 * 16, (255, 255, 255), -1, cv2.LINE_AA, 4)
    cv2.circle(picture, start, 6 * 16, dark, 2, cv2.LINE_AA, 4)
    cv2.circle(picture, end, 6 * 16, dark, -1, cv2.LINE_AA, 4)


def _with_legend(
    picture: NDArray[np.uint8], team_map: TeamMap, hue: Mapping[str, tuple[int, int, int]], px_per_m: float
) -> NDArray[np.uint8]:
    """Return the picture with a strip below: the robots' names and colours, who is not placed, and a scale bar."""
    import cv2

    placed = [(robot_id, hue[robot_id]) for robot_id in team_map.T_team_map if robot_id in hue]
    missing = sorted(team_map.unplaced)
    font, line_px, x, y = cv2.FONT_HERSHEY_DUPLEX, 30, PAD_PX, 30
    width = max(picture.shape[1], 360)
    spots: list[tuple[int, int, str, tuple[int, int, int] | None]] = []
    for text, colour in [*placed, *((f"{name} (not placed)", None) for name in missing)]:
        wide = cv2.getTextSize(text, font, 0.55, 1)[0][0] + 52
        if x + wide > width - PAD_PX and x > PAD_PX:
            x, y = PAD_PX, y + line_px
        spots.append((x, y, text, colour))
        x += wide
    strip = np.full((y + line_px + (24 if px_per_m else 0), width, 3), PAPER, dtype=np.uint8)
    for x, y, text, colour in spots:
        if colour is None:
            cv2.rectangle(strip, (x, y - 12), (x + 16, y + 4), (170, 170, 170), 1, cv2.LINE_AA)
        else:
            cv2.rectangle(strip, (x, y - 12), (x + 16, y + 4), colour, -1, cv2.LINE_AA)
        ink = INK if colour is not None else (140, 140, 140)
        cv2.putText(strip, text, (x + 24, y + 2), font, 0.55, ink, 1, cv2.LINE_AA)
    if px_per_m:
        length_m = _round_length(0.2 * width / px_per_m)
        x1, y1 = PAD_PX + round(length_m * px_per_m), strip.shape[0] - 16
        cv2.line(strip, (PAD_PX, y1), (x1, y1), INK, 2, cv2.LINE_AA)
        for end in (PAD_PX, x1):
            cv2.line(strip, (end, y1 - 5), (end, y1 + 5), INK, 2, cv2.LINE_AA)
        cv2.putText(strip, f"{length_m:g} m", (x1 + 12, y1 + 6), font, 0.55, INK, 1, cv2.LINE_AA)
    if picture.shape[1] < width:
        left = (width - picture.shape[1]) // 2
        right = width - picture.shape[1] - left
        picture = _bordered(picture, 0, 0, left, right)
    return np.ascontiguousarray(np.vstack([picture, strip]))


def _bordered(picture: NDArray[np.uint8], top: int, bottom: int, left: int, right: int) -> NDArray[np.uint8]:
    import cv2

    framed = cv2.copyMakeBorder(picture, top, bottom, left, right, cv2.BORDER_CONSTANT, value=PAPER)
    return np.asarray(framed, dtype=np.uint8)


def _round_length(metres: float) -> float:
    """Return the largest of 1, 2, 5 x 10^n metres that is not longer."""
    power = 10.0 ** np.floor(np.log10(max(metres, 1e-3)))
    return float(max(step * power for step in (1, 2, 5) if step * power <= metres * (1 + 1e-9)))
