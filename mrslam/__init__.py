"""mrslam: distributed multi-robot 2-D lidar SLAM.

The names below are the public face (docs/library.md lists them with their types); each is loaded when it is first used,
so that ``import mrslam`` is quick. Everything else is in the packages ``mrslam.spatial``, ``mrslam.rbpf``,
``mrslam.alignment``, ``mrslam.mutual_detection``, ``mrslam.merge``, ``mrslam.comms``, ``mrslam.agent`` and
``mrslam.sim_driver``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from mrslam.jit_cache import use_cache_dir

use_cache_dir()  # before any kernel is defined

if TYPE_CHECKING:
    from mrslam.agent import Agent as Agent
    from mrslam.agent import Settings as Settings
    from mrslam.alignment import Alignment as Alignment
    from mrslam.alignment import AlignmentConfig as AlignmentConfig
    from mrslam.alignment import Rejection as Rejection
    from mrslam.alignment import align as align
    from mrslam.merge import MergeConfig as MergeConfig
    from mrslam.merge import MergeResult as MergeResult
    from mrslam.merge import merge_maps as merge_maps
    from mrslam.rbpf import Mapper as Mapper
    from mrslam.rbpf import MapperConfig as MapperConfig
    from mrslam.sim_driver.feeds import open_feed as open_feed
    from mrslam.spatial import InputError as InputError
    from mrslam.spatial import OccupancyGrid as OccupancyGrid
    from mrslam.spatial import Scan as Scan
    from mrslam.spatial import read_map as read_map
    from mrslam.spatial import read_tum as read_tum
    from mrslam.spatial import write_map as write_map
    from mrslam.spatial import write_tum as write_tum

_HOMES = {
    "mrslam.agent": ("Agent", "Settings"),
    "mrslam.alignment": ("Alignment", "AlignmentConfig", "Rejection", "align"),
    "mrslam.merge": ("MergeConfig", "MergeResult", "merge_maps"),
    "mrslam.rbpf": ("Mapper", "MapperConfig"),
    "mrslam.sim_driver.feeds": ("open_feed",),
    "mrslam.spatial": ("InputError", "OccupancyGrid", "Scan", "read_map", "read_tum", "write_map", "write_tum"),
}
"""Package that each public name comes from."""

__all__ = sorted(name for names in _HOMES.values() for name in names)


def __getattr__(name: str) -> object:
    """Load a public name from the package that defines it."""
    for home, names in _HOMES.items():
        if name in names:
            value = getattr(import_module(home), name)
            globals()[name] = value
            return value
    raise AttributeError(f"module 'mrslam' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
