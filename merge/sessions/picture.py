"""What changed between two maps as a picture: what vanished red, what appeared green, on the walls of both."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.draw import INK, PAPER
from mrslam.merge.picture_key import KEY_PX, key_strip
from mrslam.merge.sessions.diff import Diff

FLOOR, ONE_ONLY, FAINT = (255, 255, 255), (228, 228, 224), (176, 176, 172)
"""RGB of floor that both have seen, of what one of them has, and of walls that one only shows."""
APPEARED, VANISHED = (0, 140, 60), (214, 39, 40)
KEY = (("appeared", APPEARED), ("vanished", VANISHED), ("wall in both", INK), ("in one only", FAINT))
MARGIN_CELLS = 12
"""Margin around the picture, cells."""
LEAST_PX = 900
"""The longer side of a small map's picture is enlarged, by whole factors, to at least this, pixels."""


def draw_diff(found: Diff) -> NDArray[np.uint8]:
    """Return the picture ``(H, W, 3) uint8`` RGB, first row on top."""
    before, after = found.before, found.after
    height, width = before.shape
    page = np.full((height + 2 * MARGIN_CELLS, width + 2 * MARGIN_CELLS, 3), PAPER, dtype=np.uint8)
    picture = page[MARGIN_CELLS : MARGIN_CELLS + height, MARGIN_CELLS : MARGIN_CELLS + width]
    picture[before.is_known | after.is_known] = ONE_ONLY
    picture[before.is_known & after.is_known] = FLOOR
    picture[before.is_occupied | after.is_occupied] = FAINT
    picture[before.is_occupied & after.is_occupied] = INK
    picture[found.cells.vanished], picture[found.cells.appeared] = VANISHED, APPEARED
    scale = max(-(-LEAST_PX // max(page.shape[:2])), 1)
    picture = page[::-1].repeat(scale, axis=0).repeat(scale, axis=1)
    height, width = picture.shape[:2]
    key = key_strip(width, KEY, scale / before.resolution_m)
    out = np.full((height + KEY_PX, key.shape[1], 3), PAPER, dtype=np.uint8)
    out[:height, :width], out[height:] = picture, key
    return out
