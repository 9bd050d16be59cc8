"""One robot's mapper: motion model, scan matcher, particles with tiled copy-on-write maps."""

import spatial  # noqa: F401  (points numba's cache at the right folder before any kernel is defined)
from rbpf.config import MapperConfig
from rbpf.mapper import Mapper, Stats, UpdateInfo

__all__ = ["Mapper", "MapperConfig", "Stats", "UpdateInfo"]
