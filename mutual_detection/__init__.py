"""Where teammates are now, which beams hit them (else they become walls), and what seeing them says of two maps."""

from mrslam.mutual_detection.bodies import find_bodies
from mrslam.mutual_detection.config import MutualDetectionConfig
from mrslam.mutual_detection.encounters import Moment, Sightings, sightings
from mrslam.mutual_detection.ghosts import clear_ghosts
from mrslam.mutual_detection.mask import mask_teammates, masked_beams
from mrslam.mutual_detection.mutual import MutualFix, mutual_fix
from mrslam.mutual_detection.tracker import TeammateTracker, place_covariance
from mrslam.mutual_detection.warm_up import warm_up

__all__ = [
    "Moment",
    "MutualDetectionConfig",
    "MutualFix",
    "Sightings",
    "TeammateTracker",
    "clear_ghosts",
    "find_bodies",
    "mask_teammates",
    "masked_beams",
    "mutual_fix",
    "place_covariance",
    "sightings",
    "warm_up",
]
