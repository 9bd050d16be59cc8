"""The key of a picture of maps: what its colours mean, and how long a metre is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.draw import INK, PAPER

KEY_PX, LEAST_PX = 26, 560
"""Height of the key, and the least width that it needs, pixels."""
BARS_M = (50.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.5)
"""Lengths of the bar, metres: the longest that is no longer than ``BAR_MOST_PX``."""
BAR_MOST_PX = 150


def key_strip(width: int, entries: Sequence[tuple[str, tuple[int, int, int]]], px_per_m: float) -> NDArray[np.uint8]:
    """Return a strip ``(KEY_PX, max(width, LEAST_PX), 3) uint8`` RGB: words for colours, and a bar of some metres."""
    import cv2

    strip = np.full((KEY_PX, max(width, LEAST_PX), 3), PAPER, dtype=np.uint8)
    bar_m = next((bar_m for bar_m in BARS_M if bar_m * px_per_m <= BAR_MOST_PX), BARS_M[-1])
    strip[12:15, 8 : 8 + round(bar_m * px_per_m)] = INK
    x = 8 + round(bar_m * px_per_m) + 6
    for text, colour in ((f"{bar_m:g} m", None), *entries):
        if colour is not None:
            strip[8:18, x : x + 10] = colour
            x += 14
        cv2.putText(strip, text, (x, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.42, INK, 1, cv2.LINE_AA)
        x += cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.42, 1)[0][0] + 18
    return strip
