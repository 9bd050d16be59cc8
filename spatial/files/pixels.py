"""What the greys of a map's image mean: the rules of ROS' map_server and of Nav2's, which write and read them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial.errors import InputError, require
from mrslam.spatial.grid import UNKNOWN

FREE, GREY, OCCUPIED = 254, 205, 0
"""What map savers write, unless negated, for free, unknown and occupied cells."""
MODES = ("trinary", "scale", "raw")
SAVED = {FREE, GREY, OCCUPIED, 255}
"""An image of no other greys was written by a map saver, which means unknown by its grey."""


class Pixels:
    """How pixels become cells: ``mode``, ``negate`` and the thresholds of a map's YAML file."""

    def __init__(
        self, mode: str = "trinary", negate: bool = False, occupied_thresh: float = 0.65, free_thresh: float = 0.196
    ) -> None:
        """Take the values of the YAML file; thresholds in [0, 1]; raises ``InputError`` where they make no sense."""
        require(mode in MODES, "mode", f"one of {', '.join(MODES)}", mode)
        if not 0.0 <= free_thresh <= occupied_thresh <= 1.0:
            raise InputError(f"need 0 <= free_thresh <= occupied_thresh <= 1, got {free_thresh} and {occupied_thresh}")
        self.mode, self.negate = mode, negate
        self.occupied_thresh, self.free_thresh = occupied_thresh, free_thresh

    def cells(self, grey: NDArray[np.uint8], opaque: NDArray[np.bool_] | None) -> NDArray[np.int8]:
        """Return ``(H, W) int8`` cells of an image ``(H, W)``, its first row on top; theirs is at the bottom.

        Occupancy is darkness (lightness if negated) in [0, 1]. "trinary": free below, occupied above the thresholds,
        else unknown; "scale": in between in proportion; "raw": the grey is the occupancy in percent, above 100 unknown.
        What is transparent (not ``opaque``) is unknown. Nav2's saver writes unknown as a grey that its own default
        ``free_thresh`` makes free: where an image holds a saver's greys only, that one is unknown.
        """
        table = self._table()
        unknown = 255 - GREY if self.negate else GREY
        if self.mode == "trinary" and {255 - g if self.negate else g for g in np.unique(grey).tolist()} <= SAVED:
            table[unknown] = UNKNOWN
        cells = table[grey[::-1]]
        if opaque is not None:
            cells[~opaque[::-1]] = UNKNOWN
        return cells

    def _table(self) -> NDArray[np.int8]:
        """Return the cell for each of the 256 greys."""
        greys = np.arange(256)
        if self.mode == "raw":
            return np.where(greys <= 100, greys, UNKNOWN).astype(np.int8)
        lightness = greys.astype(np.float32) / 255.0
        occupancy = lightness if self.negate else 1.0 - lightness
        table = np.full(256, UNKNOWN, dtype=np.int8)
        if self.mode == "scale":
            span = max(self.occupied_thresh - self.free_thresh, 1e-9)
            table = np.clip(np.rint((occupancy - self.free_thresh) / span * 100.0), 0, 100).astype(np.int8)
        table[occupancy < self.free_thresh] = 0
        table[occupancy > self.occupied_thresh] = 100
        return table
