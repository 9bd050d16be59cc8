"""Draw a finished run as a moving picture: the robots' maps grow apart, and snap together when they merge.

    mrslam demo --robots 2 --out out/demo
    python bench/picture.py out/demo docs/images/demo.gif

What is shown is the run's own: what each robot had seen by when, its way, and the moment its map was placed. Only where
a map is drawn until then is made up, for nobody knows: side by side, each in its own frame. Needs Pillow, which
matplotlib brings.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mrslam.merge.draw import FREE_TINT, INK, PAPER, WALL_SHADE, colours
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.report.layout import Layout, lay_out
from mrslam.sim_driver.report.map_data import joined_s
from mrslam.sim_driver.report.seen import first_seen_s, mission_trajectory, spread
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

FRAME_MS = 90
SNAP_FRAMES = 14
HOLD_MS = 2500
"""How long the last frame stands."""
GREYS = 48
"""Colours of the file's palette."""


@dataclass(frozen=True, eq=False)
class Actor:
    """One robot's own map and way, in the plane where all maps end up."""

    name: str
    colour: tuple[int, int, int]
    cells: NDArray[np.int8]
    """``(H, W)`` 0 unknown, 1 free, 2 wall; row = +y."""
    seen_s: NDArray[np.float32]
    times_s: NDArray[np.float64]
    in_plane: NDArray[np.float64]
    """``(N, 3)`` metres: its way."""
    joined_s: float
    T_apart: Transform
    """Where its map is drawn until it is placed: in its own frame, in its own part of the picture."""


def make_actors(run: RunResults, layout: Layout) -> list[Actor]:
    """Return the robots whose maps came together, the first in the middle of the left."""
    joined = joined_s(run, layout)
    size_m = np.array(layout.cells.shape[::-1]) * layout.cell_m
    hue = colours([robot.id for robot in run.mission.robots])
    actors = []
    for i, name in enumerate(layout.placed):
        T_plane_map = layout.T_plane_map[name]
        grid = run.map(name)
        cells = np.zeros(layout.cells.shape, dtype=np.int8)
        for value, mask in ((1, grid.is_known & ~grid.is_occupied), (2, grid.is_occupied)):
            rows, cols = layout.pixels(se2.apply(T_plane_map, grid.centres(mask)))
            inside = (rows >= 0) & (rows < cells.shape[0]) & (cols >= 0) & (cols < cells.shape[1])
            np.maximum.at(cells, (rows[inside], cols[inside]), value)
        cells = np.maximum(cells, cv2.morphologyEx((cells == 1).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3))))
        times_ns, poses = mission_trajectory(run, name)
        middle = se2.apply(T_plane_map, np.mean(grid.centres(grid.is_known), axis=0))
        turn = se2.compose(np.array([*middle, -T_plane_map[2]]), np.array([*-middle, 0.0]))
        aside_m = (i + 0.5) * size_m[0] - 0.5 * len(layout.placed) * size_m[0]
        actors.append(
            Actor(
                name,
                hue[name],
                cells,
                spread(first_seen_s(run, layout, name), cells > 0),
                times_ns / 1e9,
                se2.compose(T_plane_map, poses),
                max(joined[name] or 0.0, min(t for t in joined.values() if t)),
                se2.compose(np.array([*(0.5 * size_m - middle + [aside_m, 0.0]), 0.0]), turn),
            )
        )
    return actors


def frame(actors: list[Actor], layout: Layout, now_s: float, snap: float) -> NDArray[np.uint8]:
    """Return one picture: ``snap`` is 0 while the maps lie apart, 1 when they lie as they fit."""
    height, width = layout.cells.shape
    margin = int(0.5 * (len(actors) - 1) * width)
    shape = (height, width + 2 * margin)
    free, wall = np.zeros((*shape, 3), dtype=np.float32), np.zeros((*shape, 3), dtype=np.float32)
    saw = np.zeros(shape, dtype=np.float32)
    walls = np.zeros(shape, dtype=np.float32)
    shown = {actor.name: _between(actor.T_apart, snap) for actor in actors}
    for actor in actors:
        now = np.where(actor.seen_s <= now_s, actor.cells, 0).astype(np.uint8)
        x, y, theta = shown[actor.name]
        c, s, cell = np.cos(theta), np.sin(theta), layout.cell_m
        onto = np.array([[c, -s, x / cell + margin], [s, c, y / cell]])
        moved = cv2.warpAffine(now, onto, shape[::-1], flags=cv2.INTER_NEAREST)
        free[moved > 0] += np.array(actor.colour, dtype=np.float32)
        saw[moved > 0] += 1.0
        wall[moved == 2] += np.array(actor.colour, dtype=np.float32)
        walls[moved == 2] += 1.0
    picture = np.full((*shape, 3), PAPER, dtype=np.float32)
    known = saw > 0
    picture[known] = (255 * (1 - FREE_TINT) + FREE_TINT * free / np.maximum(saw, 1)[..., None])[known]
    picture[walls > 0] = (WALL_SHADE * wall / np.maximum(walls, 1)[..., None])[walls > 0]
    image = np.ascontiguousarray(np.rint(picture)[::-1].astype(np.uint8))
    for actor in actors:
        _draw_way(image, actor, shown[actor.name], layout.cell_m, margin, now_s)
    words = f"{now_s:3.0f} s   {'one map' if snap >= 1.0 else f'{len(actors)} robots, no known starts'}"
    cv2.putText(image, words, (12, 24), cv2.FONT_HERSHEY_DUPLEX, 0.6, INK, 1, cv2.LINE_AA)
    return image


def _between(T_apart: Transform, snap: float) -> Transform:
    eased = snap * snap * (3.0 - 2.0 * snap)
    return (1.0 - eased) * T_apart


def _draw_way(
    image: NDArray[np.uint8], actor: Actor, T_shown: Transform, cell_m: float, margin: int, now_s: float
) -> None:
    until = int(np.searchsorted(actor.times_s, now_s, side="right"))
    points = se2.apply(T_shown, actor.in_plane[:until, :2]) / cell_m
    pixels = np.stack([points[:, 0] + margin, image.shape[0] - points[:, 1]], axis=-1)
    if not until:
        return
    dark = tuple(int(0.6 * c) for c in actor.colour)
    fixed = np.rint(pixels[:: max(1, until // 400)] * 8).astype(np.int32).reshape(-1, 1, 2)
    cv2.polylines(image, [fixed], False, dark, 1, cv2.LINE_AA, 3)
    here = tuple(int(v) for v in np.rint(pixels[-1]))
    cv2.circle(image, here, 6, (255, 255, 255), -1, cv2.LINE_AA)
    cv2.circle(image, here, 5, dark, -1, cv2.LINE_AA)


def main() -> None:
    """Write the picture and say how large it is."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--step-s", type=float, default=2.0, help="mission seconds a frame")
    parser.add_argument("--width", type=int, default=860)
    options = parser.parse_args()
    run = RunResults.read(options.run)
    layout = lay_out(run)
    actors = make_actors(run, layout)
    end_s, merged_s = float(run.metrics["mission_s"]), max(actor.joined_s for actor in actors)
    moments = [(t, 0.0) for t in np.arange(0.0, merged_s, options.step_s)]
    moments += [(merged_s, (k + 1) / SNAP_FRAMES) for k in range(SNAP_FRAMES)]
    moments += [(t, 1.0) for t in np.arange(merged_s, end_s, 2.0 * options.step_s)] + [(end_s, 1.0)]
    images = []
    for now_s, snap in moments:
        picture = frame(actors, layout, now_s, snap)
        scale = options.width / picture.shape[1]
        small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        images.append(Image.fromarray(small))
    palette = images[-1].quantize(GREYS, dither=Image.Dither.NONE)
    drawn = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    times = [FRAME_MS] * (len(drawn) - 1) + [HOLD_MS]
    options.out.parent.mkdir(parents=True, exist_ok=True)
    drawn[0].save(options.out, save_all=True, append_images=drawn[1:], duration=times, loop=0, optimize=True)
    print(f"{options.out}: {len(drawn)} frames of {images[0].size}, {options.out.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
