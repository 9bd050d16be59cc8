"""Where teammates are now, and which beams hit them, so that they do not become walls in the map."""

from mrslam.mutual_detection.config import MutualDetectionConfig
from mrslam.mutual_detection.ghosts import clear_ghosts
from mrslam.mutual_detection.mask import mask_teammates, masked_beams
from mrslam.mutual_detection.tracker import TeammateTracker, place_covariance
from mrslam.mutual_detection.warm_up import warm_up

__all__ = [
    "MutualDetectionConfig",
    "TeammateTracker",
    "clear_ghosts",
    "mask_teammates",
    "masked_beams",
    "place_covariance",
    "warm_up",
]
