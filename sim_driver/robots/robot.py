"""One simulated robot: a differential drive with a laser and lying wheels."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.robots.config import ChassisConfig, OdometryConfig
from mrslam.sim_driver.robots.lasers import LaserModel
from mrslam.sim_driver.robots.odometry import Odometry
from mrslam.sim_driver.robots.raycast import cast, cast_discs, leap_field
from mrslam.sim_driver.worlds.world import World
from mrslam.spatial import Scan, se2
from mrslam.spatial.se2 import Transform

NOBODY: tuple[NDArray[np.float64], NDArray[np.float64]] = (np.empty((0, 2)), np.empty(0))
"""No discs: centres ``(0, 2)`` and radii ``(0,)``."""
LONGEST_STEP_M = 0.02


class SimulatedRobot:
    """A disc that drives in a world; all its randomness comes from one generator."""

    def __init__(
        self,
        world: World,
        T_world_base: Transform,
        laser: LaserModel,
        rng: np.random.Generator,
        config: ChassisConfig | None = None,
        odometry: OdometryConfig | None = None,
    ) -> None:
        """Place the robot; its odometry frame starts at the identity."""
        self.world, self.laser, self.config = world, laser, config or ChassisConfig()
        self.T_world_base: Transform = np.array(T_world_base, dtype=np.float64)
        self.collisions = 0
        """How many steps ended at an obstacle."""
        self.speed_m_s = self.turn_rad_s = 0.0
        motion_rng, self._beam_rng = rng.spawn(2)
        self._odometry = Odometry(odometry or OdometryConfig(), motion_rng)
        self._leap = leap_field(world.clearance_cells)
        self._T_base_laser = np.array(laser.T_base_laser)

    @property
    def T_odom_base(self) -> Transform:
        """What the wheels say: ``(3,)``, from the start pose."""
        return self._odometry.T_odom_base

    def step(
        self,
        command: tuple[float, float],
        dt_s: float,
        others: tuple[NDArray[np.float64], NDArray[np.float64]] = NOBODY,
    ) -> bool:
        """Drive for ``dt_s`` at (speed m/s, turn rad/s) within the drive's limits; return whether it hit something.

        ``others`` : centres ``(N, 2)`` in the world and radii ``(N,)`` of what else is in the way. A blocked robot can
        still turn, and drive where its gap to the obstacle grows.
        """
        speed = _towards(
            self.speed_m_s, command[0], self.config.max_acceleration_m_s2 * dt_s, self.config.max_speed_m_s
        )
        turn = _towards(
            self.turn_rad_s, command[1], self.config.max_turn_acceleration_rad_s2 * dt_s, self.config.max_turn_rad_s
        )
        steps = max(1, math.ceil(abs(speed) * dt_s / LONGEST_STEP_M))
        before = self.T_world_base
        x, y, heading = (float(v) for v in before)
        angle, blocked = turn * dt_s / steps, False
        gap = self._gap(x, y, others)
        for _ in range(steps):
            if not blocked:
                # The chord of the arc that this bit of the way is.
                half = angle / 2.0
                way = speed * dt_s / steps * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
                ahead_x, ahead_y = x + way * math.cos(heading + half), y + way * math.sin(heading + half)
                new_gap = self._gap(ahead_x, ahead_y, others)
                blocked = speed != 0.0 and new_gap < 0.0 and new_gap < gap + 1e-9
                if not blocked:
                    x, y, gap = ahead_x, ahead_y, new_gap
            heading += angle
        self.collisions += blocked
        self.speed_m_s, self.turn_rad_s = 0.0 if blocked else speed, turn
        self.T_world_base = se2.transform(x, y, heading)
        self._odometry.advance(se2.between(before, self.T_world_base))
        return blocked

    def scan(self, stamp_ns: int, others: tuple[NDArray[np.float64], NDArray[np.float64]] = NOBODY) -> Scan:
        """Return one sweep from where the robot is; ``others`` as in :meth:`step`."""
        laser, grid = self.laser, self.world.grid
        x, y, heading = se2.compose(self.T_world_base, self._T_base_laser)
        scale = 1.0 / grid.resolution_m
        ranges = np.empty(laser.beams, dtype=np.float32)
        col, row = (x - grid.origin_m[0]) * scale, (y - grid.origin_m[1]) * scale
        cast(
            self._leap,
            col,
            row,
            heading,
            laser.angle_min_rad,
            laser.angle_increment_rad,
            laser.range_max_m * scale,
            ranges,
        )
        ranges *= np.float32(grid.resolution_m)
        cast_discs(x, y, heading, laser.angle_min_rad, laser.angle_increment_rad, *others, ranges)
        return Scan(
            stamp_ns=stamp_ns,
            ranges_m=laser.measure(ranges, self._beam_rng),
            angle_min_rad=laser.angle_min_rad,
            angle_increment_rad=laser.angle_increment_rad,
            range_max_m=laser.range_max_m,
            range_min_m=laser.range_min_m,
            T_base_laser=self._T_base_laser,
        )

    def _gap(self, x: float, y: float, others: tuple[NDArray[np.float64], NDArray[np.float64]]) -> float:
        """Return the free space around the body, metres; negative inside an obstacle."""
        grid, clearance = self.world.grid, self.world.clearance_cells
        col = min(max((x - grid.origin_m[0]) / grid.resolution_m - 0.5, 0.0), clearance.shape[1] - 1.001)
        row = min(max((y - grid.origin_m[1]) / grid.resolution_m - 0.5, 0.0), clearance.shape[0] - 1.001)
        c, r = int(col), int(row)
        fc, fr = col - c, row - r
        low = (1 - fc) * float(clearance[r, c]) + fc * float(clearance[r, c + 1])
        high = (1 - fc) * float(clearance[r + 1, c]) + fc * float(clearance[r + 1, c + 1])
        gap = ((1 - fr) * low + fr * high - 0.5) * grid.resolution_m
        centres, radii = others
        if len(centres):
            gap = min(gap, float((np.hypot(centres[:, 0] - x, centres[:, 1] - y) - radii).min()))
        return gap - self.config.radius_m


def _towards(now: float, wanted: float, most: float, limit: float) -> float:
    wanted = min(max(float(wanted), -limit), limit) if math.isfinite(wanted) else 0.0
    return min(max(wanted, now - most), now + most)
