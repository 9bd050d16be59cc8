"""Where teammates are now, and which beams hit them, so that they do not become walls in the map."""

import spatial  # noqa: F401 - points numba's cache at the right folder before any kernel is defined
from mutual_detection.config import MutualDetectionConfig
from mutual_detection.ghosts import clear_ghosts
from mutual_detection.mask import mask_teammates, masked_beams
from mutual_detection.tracker import TeammateTracker
from mutual_detection.warm_up import warm_up

__all__ = ["MutualDetectionConfig", "TeammateTracker", "clear_ghosts", "mask_teammates", "masked_beams", "warm_up"]
