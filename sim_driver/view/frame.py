"""What a viewer is shown of a robot at one instant: references to values nobody changes, gathered in microseconds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import LocalMap, Scan
from mrslam.spatial.se2 import Transform


@dataclass(frozen=True, eq=False)
class Frame:
    """One robot at one instant, everything in its own map's frame."""

    t_ns: int
    T_map_base: Transform
    scan: Scan | None
    """As it came from the laser; None of a base station, which has none and is nowhere."""
    masked: Scan | None
    """What the mapper got: beams that hit teammates are NaN."""
    particles: NDArray[np.float64]
    """``(N, 3)`` where each particle has the robot."""
    maps: Mapping[str, LocalMap] = field(default_factory=dict)
    """Maps by robot, each in its own frame."""
    T_own_map: Mapping[str, Transform] = field(default_factory=dict)
    """Where those maps lie, for robots whose place is known; where maps are bent, right near this robot."""
    teammates: Mapping[str, Transform] = field(default_factory=dict)
