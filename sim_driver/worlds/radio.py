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
from mrslam.spatial.errors import require, require_bounds
from mrslam.spatial.traversal import traverse

WAVES = 96
"""Waves whose sum is the shadowing field."""


BOUNDS = {
    "power_dbm": (-200.0, 200.0), "loss_1m_db": (0.0, 200.0), "path_loss_exponent": (0.1, 10.0),
    "wall_loss_db": (0.0, 1e3), "shadowing_db": (0.0, 100.0), "shadowing_distance_m": (0.01, 1e4),
    "sensitivity_dbm": (-200.0, 200.0), "steepness_per_db": (0.001, 1e3), "bandwidth_bit_s": (0.0, 1e12),
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
    bandwidth_bit_s: float = 0.0
    """What a link carries each way, bits a second, >= 1: messages queue for it. 0: no limit. In virtual time only."""
    latency_s: float = 0.001
    """Time that a message is on its way, seconds, >= 0; repetitions lengthen it. In virtual time only."""
    range_m: float = 1000.0
    """Nothing is heard beyond, metres, > 0: for missions that want a plain radius."""

    def __post_init__(self) -> None:
        require_bounds("radio", self, BOUNDS)
        carries = self.bandwidth_bit_s == 0.0 or self.bandwidth_bit_s >= 1.0
        require(carries, "radio.bandwidth_bit_s", "0 (no limit), or 1 bit/s and more", self.bandwidth_bit_s)


@dataclass(frozen=True)
class Link:
    """What a link is like at one instant; the same in both directions."""

    distance_m: float
    walls: int
    rssi_dbm: float
    delivery: float
    """Share of packets that arrive, one way, 0..1."""

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
        a, b = np.asarray(T_world_a, dtype=np.float64)[:2], np.asarray(T_world_b, dtype=np.float64)[:2]
        return self._link(float(np.hypot(*(b - a))), self.walls(a, b), self.shadowing_db(a, b))

    def qualities(self, places_m: NDArray[np.float64], pairs: NDArray[np.int64]) -> list[float]:
        """Return what :meth:`quality` says of ``pairs (P, 2)``, indices into ``places_m (N, 2)``, all at once."""
        a, b = places_m[pairs[:, 0]], places_m[pairs[:, 1]]
        walls = count_all_walls(self._world.is_wall, *self._in_cells(a, b))
        distances, shadowing_db = np.hypot(*(b - a).T), self._shadowing_db(places_m, pairs)
        each = zip(distances.tolist(), walls.tolist(), shadowing_db.tolist(), strict=True)
        return [self._link(*one).quality for one in each]

    def _link(self, distance: float, walls: int, shadowing_db: float) -> Link:
        config = self._config
        loss_db = config.loss_1m_db + 10.0 * config.path_loss_exponent * math.log10(max(distance, 0.3))
        rssi = config.power_dbm - loss_db - config.wall_loss_db * walls - shadowing_db
        over = config.steepness_per_db * (rssi - config.sensitivity_dbm)
        delivery = 1.0 / (1.0 + math.exp(-min(max(over, -60.0), 60.0)))
        if delivery < 1e-3 or distance > config.range_m:
            return Link(distance, walls, rssi, 0.0)
        return Link(distance, walls, rssi, delivery)

    def quality(self, T_world_a: ArrayLike, T_world_b: ArrayLike) -> float:
        """Return LQ x NLQ in 0..1 of the link between two poses."""
        return self.link(T_world_a, T_world_b).quality

    def walls(self, a_m: NDArray[np.float64], b_m: NDArray[np.float64]) -> int:
        """Return how many walls the straight line between two points crosses."""
        return int(count_all_walls(self._world.is_wall, *self._in_cells(a_m[None], b_m[None]))[0])

    def _in_cells(
        self, a_m: NDArray[np.float64], b_m: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return both ends of lines ``(P, 2)`` in cells, in one order, so that both directions count alike."""
        grid = self._world.grid
        a, b = ((one - np.asarray(grid.origin_m)) / grid.resolution_m for one in (a_m, b_m))
        is_turned = (b[:, 0] < a[:, 0]) | ((b[:, 0] == a[:, 0]) & (b[:, 1] < a[:, 1]))
        return np.where(is_turned[:, None], b, a), np.where(is_turned[:, None], a, b)

    def shadowing_db(self, a_m: NDArray[np.float64], b_m: NDArray[np.float64]) -> float:
        """Return the shadowing of the link between two points, the same both ways; fades out below a metre."""
        return float(self._shadowing_db(np.stack([a_m, b_m]), np.array([[0, 1]]))[0])

    def _shadowing_db(self, places_m: NDArray[np.float64], pairs: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return ``(P,)``: the shadowing between pairs of places; what one place adds is worked out once for all."""
        first, second = (np.array([self._waves[:, end] @ place for place in places_m]) for end in (0, 1))
        i, j = pairs.T
        forth = np.cos(first[i] + second[j] + self._phases).sum(axis=1)
        back = np.cos(first[j] + second[i] + self._phases).sum(axis=1)
        near = np.minimum(np.hypot(*(places_m[j] - places_m[i]).T), 1.0)
        return np.asarray(self._config.shadowing_db * near * (forth + back) / math.sqrt(WAVES))


@njit(cache=True, nogil=True)
def count_all_walls(
    is_wall: NDArray[np.bool_], starts: NDArray[np.float64], ends: NDArray[np.float64]
) -> NDArray[np.int64]:  # pragma: no cover - compiled
    """Return what :func:`count_walls` counts on each of the lines ``(P, 2)``, (x, y) in cells."""
    counts = np.empty(starts.shape[0], dtype=np.int64)
    for k in range(starts.shape[0]):
        counts[k] = count_walls(is_wall, starts[k, 0], starts[k, 1], ends[k, 0], ends[k, 1])
    return counts


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
