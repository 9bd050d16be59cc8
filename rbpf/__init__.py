"""One robot's mapper: motion model, scan matcher, particles with tiled copy-on-write maps."""

from mrslam.rbpf.checkpoint import load_checkpoint, save_checkpoint
from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.mapper import Mapper
from mrslam.rbpf.outcome import Stats, UpdateInfo
from mrslam.rbpf.warm_up import warm_up
from mrslam.spatial.runtime.crew import hand_over_quickly

__all__ = [
    "Mapper",
    "MapperConfig",
    "Stats",
    "UpdateInfo",
    "hand_over_quickly",
    "load_checkpoint",
    "save_checkpoint",
    "warm_up",
]
