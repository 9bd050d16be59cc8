"""The team map as a picture: every robot's part in its own colour."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mrslam.merge.draw_kernels import add_layer, paint
from mrslam.merge.grids.layers import Layer
from mrslam.merge.grids.tiled_grid import TiledGrid, Tiles
from mrslam.merge.joint.bent_map import BentMap
from mrslam.merge.team import TeamMap
from mrslam.spatial import FREE_MAX, OCCUPIED_MIN, TILE_CELLS, OccupancyGrid, TiledMap, se2
from mrslam.spatial.tiles import TileIndex, assembled

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
PAD_PX = 24
"""Margin around the picture, pixels."""


def colours(ids: Sequence[str]) -> dict[str, tuple[int, int, int]]:
    """Return each robot's RGB colour."""
    return {robot_id: PALETTE[i % len(PALETTE)] for i, robot_id in enumerate(sorted(ids))}


def draw_team(
    team_map: TeamMap,
    layers: Mapping[str, OccupancyGrid | TiledMap],
    trajectories: Mapping[str, ArrayLike] | None = None,
    legend: bool = True,
    size_px: int = 1400,
    ties_m: Sequence[ArrayLike] = (),
) -> NDArray[np.uint8]:
    """Return the picture ``(H, W, 3) uint8`` RGB, first row on top.

    ``ties_m`` are places that two robots saw, ``(2, 2)`` each: where each of them was, in the team frame.
    ``layers`` are the robots' own maps in their own frames, laid where the team map does not bring them as it shows
    them; ``trajectories`` ``(K, 2 or 3)`` poses in their own frames, metres. Free space is tinted by the robots that
    saw it, walls are drawn in their colours. The longer side of the map gets about ``size_px``.
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
    team_map: TeamMap, layers: Mapping[str, OccupancyGrid | TiledMap], hue: Mapping[str, tuple[int, int, int]]
) -> NDArray[np.uint8]:
    """Return the team map at one pixel a cell, first row on top; painted tile by tile, where something is known."""
    grid = team_map.grid
    warped = team_map.layers or laid(team_map, layers)
    shades = {robot_id: np.array(rgb, dtype=np.float32) for robot_id, rgb in hue.items()}
    ink = np.array(INK, dtype=np.float32)
    height, width = grid.shape
    picture = np.empty((height, width, 3), dtype=np.uint8)
    picture.reshape(height, 3 * width)[...] = np.tile(np.array(PAPER, dtype=np.uint8), width)  # 5 times as fast by rows
    from_below, paper = picture[::-1], np.full((TILE_CELLS, TILE_CELLS, 3), PAPER, dtype=np.uint8)
    free, wall = np.empty((2, TILE_CELLS, TILE_CELLS, 4), dtype=np.float32)
    for index, tile in TiledGrid.of(grid).tiles.items():
        free[...], wall[...] = 0.0, 0.0
        for robot_id, colour in shades.items():
            if index in warped.get(robot_id, {}):
                add_layer(warped[robot_id][index], colour, FREE_MAX, OCCUPIED_MIN, free, wall)
        square = paper.copy()
        paint(tile, FREE_MAX, OCCUPIED_MIN, free, wall, ink, MIXES, square)
        row, col = TILE_CELLS * np.array(index) - grid.cell0
        part = from_below[max(row, 0) : row + TILE_CELLS, max(col, 0) : col + TILE_CELLS]
        part[...] = square[max(-row, 0) :, max(-col, 0) :][: part.shape[0], : part.shape[1]]
    return picture


def laid(team_map: TeamMap, layers: Mapping[str, OccupancyGrid | TiledMap]) -> dict[str, Tiles]:
    """Return the placed robots' maps as tiles of the team map's lattice, bent where the team map bends them."""
    out: dict[str, Tiles] = {}
    for robot_id, T_team_map in team_map.T_team_map.items():
        if robot_id in layers:
            bend, layer = team_map.bends.get(robot_id), TiledGrid.of(layers[robot_id])
            if bend is not None:
                layer, T_team_map = BentMap().draw(layer, bend.displacement), bend.T_team_map
            drawn = Layer()
            drawn.update(layer, T_team_map, team_map.grid.resolution_m)
            out[robot_id] = drawn.tiles
    return out


def overlaid(team_map: TeamMap, layers: Mapping[str, OccupancyGrid | TiledMap]) -> TeamMap:
    """Return what the team map would be without any bending: the maps laid over each other, every wall shown."""
    rigid = replace(team_map, bends={}, T_team_map=team_map.T_rigid)
    highest: dict[TileIndex, NDArray[np.int8]] = {}
    rigid_layers = laid(rigid, layers)
    for tiles in rigid_layers.values():
        for index, tile in tiles.items():
            highest[index] = np.maximum(highest[index], tile) if index in highest else tile
    return replace(rigid, grid=assembled(highest, team_map.grid.resolution_m), layers=rigid_layers)


def _draw_tie(picture: NDArray[np.uint8], pixels: NDArray[np.float64]) -> None:
    """Draw where two robots saw the same place, a dot each, joined."""
    import cv2

    start, end = (tuple(int(v) for v in point) for point in np.rint(pixels * 16).astype(np.int32))
    cv2.line(picture, start, end, INK, 1, cv2.LINE_AA, 4)
    for at in (start, end):
        cv2.circle(picture, at, 3 * 16, INK, -1, cv2.LINE_AA, 4)


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
