"""One robot's mapper: front end, particle filter with copy-on-write maps, loop closing."""

from mrslam.rbpf.checkpoint import load_checkpoint, save_checkpoint
from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.front_end.front_end import has_stood
from mrslam.rbpf.localise.fixed_map import FixedMap
from mrslam.rbpf.localise.localiser import Localiser
from mrslam.rbpf.mapper import Mapper
from mrslam.rbpf.outcome import Stats, UpdateInfo
from mrslam.rbpf.warm_up import warm_up
from mrslam.spatial.runtime.crew import hand_over_quickly

__all__ = [
    "FixedMap",
    "Localiser",
    "Mapper",
    "MapperConfig",
    "Stats",
    "UpdateInfo",
    "hand_over_quickly",
    "has_stood",
    "load_checkpoint",
    "save_checkpoint",
    "warm_up",
]
