"""One robot's mapper: motion model, scan matcher, particles with tiled copy-on-write maps."""

import spatial  # noqa: F401  (points numba's cache at the right folder before any kernel is defined)
from rbpf.checkpoint import load_checkpoint, save_checkpoint
from rbpf.config import MapperConfig
from rbpf.crew import hand_over_quickly
from rbpf.mapper import Mapper
from rbpf.outcome import Stats, UpdateInfo
from rbpf.warm_up import warm_up

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
