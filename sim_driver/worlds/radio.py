"""The simulated radio: from two true poses and the walls between them to what a link carries.

Received power = sent power - path loss - walls - shadowing (multi-wall model, COST 231 final report 1999, section
4.7.2); share of packets delivered = logistic curve of received power over the receiver's sensitivity.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from mrslam.sim_driver.worlds import World
from mrslam.spatial.errors import require_bounds
from mrslam.spatial.traversal import traverse

WAVES = 96
"""Waves whose sum is the shadowing field."""


BOUNDS = {
    "power_dbm": (-200.0, 200.0), "loss_1m_db": (0.0, 200.0), "path_loss_exponent": (0.1, 10.0),
    "wall_loss_db": (0.0, 1e3), "shadowing_db": (0.0, 100.0), "shadowing_distance_m": (0.01, 1e4),
    "sensitivity_dbm": (-200.0, 200.0), "steepness_per_db": (0.001, 1e3), "bandwidth_bit_s": (1.0, 1e12),
    "latency_s": (0.0, 1e3), "range_m": (0.01, 1e6),
}  # fmt: skip
"""Least and largest value of every setting."""


@dataclass(frozen=True, kw_only=True)
class RadioConfig:
    """A radio and how the building treats it; the defaults are a 2.4 GHz WLAN with a small antenna."""

    power_dbm: float = 15.0
    """Sent power, dBm (EN 300 328 allows 20). Less: robots must come nearer to meet."""
    loss_1m_db: float = 40.0
    """Loss over the first metre, dB: free space at 2.44 GHz gives 40.2 (Friis)."""
    path_loss_exponent: float = 2.0
    """Growth of the loss with distance, > 0: 2 in the multi-wall model, where walls are counted apart."""
    wall_loss_db: float = 6.0
    """Loss a wall crossed, dB, >= 0: 3.4 for light, 6.9 for heavy walls (COST 231, table 4.7.3)."""
    shadowing_db: float = 3.0
    """Spread of the shadowing by furniture and reflections, one sigma, dB, >= 0 (Rappaport 2002, 4.11)."""
    shadowing_distance_m: float = 3.0
    """Way after which shadowing is correlated by 1/e, metres, > 0 (Gudmundson 1991)."""
    sensitivity_dbm: float = -78.0
    """Received power at which half of the packets arrive, dBm (802.11n MCS 3 receivers: about -79 to -74)."""
    steepness_per_db: float = 0.6
    """How fast delivery falls around the sensitivity, 1/dB, > 0: from 95 % to 5 % within 10 dB."""
    bandwidth_bit_s: float = 20e6
    """What a perfect link carries, bits a second, > 0."""
    latency_s: float = 0.003
    """Delay of a perfect link, seconds, >= 0; repetitions lengthen it."""
    range_m: float = 1000.0
    """Nothing is heard beyond, metres, > 0: for missions that want a plain radius."""

    def __post_init__(self) -> None:
        require_bounds("radio", self, BOUNDS)


@dataclass(frozen=True)
class Link:
    """What a link is like at one instant; the same in both directions."""

    distance_m: float
    walls: int
    rssi_dbm: float
    delivery: float
    """Share of packets that arrive, one way, 0..1."""
    bandwidth_bit_s: float
    """What is left for payload after repetitions."""
    latency_s: float
    """Mean delay with repetitions; inf on a dead link."""

    @property
    def quality(self) -> float:
        """LQ x NLQ, as the beacons of both sides would measure it."""
        return self.delivery**2


class Radio:
    """All links in one world; its shadowing is a fixed random field, the same for a seed."""

    def __init__(self, world: World, config: RadioConfig | None = None, seed: int = 0) -> None:
        """Draw the shadowing field."""
        self._world, self._config = world, config or RadioConfig()
        rng = np.random.default_rng(seed)
        # A sum of plane waves over both ends (4-d). With wave vectors of a multivariate t with one degree of freedom in
        # 2-d the covariance is exp(-d / distance): Gudmundson's.
        direction = rng.standard_normal((WAVES, 2, 2))
        self._waves = direction / np.abs(rng.standard_normal((WAVES, 2, 1))) / self._config.shadowing_distance_m
        self._phases = rng.uniform(0.0, 2.0 * np.pi, WAVES)

    def link(self, T_world_a: ArrayLike, T_world_b: ArrayLike) -> Link:
        """Return the link between two poses (or points) of the world."""
        config = self._config
        a, b = np.asarray(T_world_a, dtype=np.float64)[:2], np.asarray(T_world_b, dtype=np.float64)[:2]
        distance = float(np.hypot(*(b - a)))
        walls = self.walls(a, b)
        loss_db = config.loss_1m_db + 10.0 * config.path_loss_exponent * math.log10(max(distance, 0.3))
        rssi = config.power_dbm - loss_db - config.wall_loss_db * walls - self.shadowing_db(a, b)
        over = config.steepness_per_db * (rssi - config.sensitivity_dbm)
        delivery = 1.0 / (1.0 + math.exp(-min(max(over, -60.0), 60.0)))
        if delivery < 1e-3 or distance > config.range_m:
            return Link(distance, walls, rssi, 0.0, 0.0, math.inf)
        return Link(distance, walls, rssi, delivery, config.bandwidth_bit_s * delivery, config.latency_s / delivery)

    def quality(self, T_world_a: ArrayLike, T_world_b: ArrayLike) -> float:
        """Return LQ x NLQ in 0..1 of the link between two poses."""
        return self.link(T_world_a, T_world_b).quality

    def walls(self, a_m: NDArray[np.float64], b_m: NDArray[np.float64]) -> int:
        """Return how many walls the straight line between two points crosses."""
        grid = self._world.grid
        # From one end always, so that both directions count alike.
        (x0, y0), (x1, y1) = sorted(tuple((p - np.asarray(grid.origin_m)) / grid.resolution_m) for p in (a_m, b_m))
        return int(count_walls(self._world.is_wall, float(x0), float(y0), float(x1), float(y1)))

    def shadowing_db(self, a_m: NDArray[np.float64], b_m: NDArray[np.float64]) -> float:
        """Return the shadowing of the link between two points, the same both ways; fades out below a metre."""
        forth = np.cos(self._waves[:, 0] @ a_m + self._waves[:, 1] @ b_m + self._phases).sum()
        back = np.cos(self._waves[:, 0] @ b_m + self._waves[:, 1] @ a_m + self._phases).sum()
        near = min(float(np.hypot(*(b_m - a_m))), 1.0)
        return self._config.shadowing_db * near * float(forth + back) / math.sqrt(WAVES)


@njit(cache=True, nogil=True)
def count_walls(
    is_wall: NDArray[np.bool_], x0: float, y0: float, x1: float, y1: float
) -> int:  # pragma: no cover - compiled
    """Return how many runs of wall cells the line between two points (in cells) passes; a run is one wall."""
    height, width = is_wall.shape
    length = int(abs(x1 - x0)) + int(abs(y1 - y0)) + 4
    rows, cols = np.empty(length, dtype=np.int32), np.empty(length, dtype=np.int32)
    count = traverse(x0, y0, x1, y1, rows, cols)
    walls, inside = 0, False
    for i in range(count):
        r, c = rows[i], cols[i]
        wall = 0 <= r < height and 0 <= c < width and is_wall[r, c]
        walls += wall and not inside
        inside = wall
    return walls
