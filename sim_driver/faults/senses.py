"""A body whose laser and wheels fail as told; what is beneath stays as it was."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrslam.agent import Agent, Body, Sensed
from mrslam.sim_driver.faults.config import FaultConfig
from mrslam.spatial import se2


class FaultySenses:
    """Passes on what a body senses, with what goes wrong on the way."""

    def __init__(self, body: Body, faults: Sequence[FaultConfig], rng: np.random.Generator) -> None:
        """Take the body, this robot's faults, and where garbage comes from."""
        self._body, self._rng = body, rng
        self._faults = tuple(faults)
        self._held: Sensed | None = None
        self._count = 0

    def sense(self, now_ns: int) -> Sensed | None:
        """Return the next scan, spoilt where a fault says so."""
        while (sensed := self._body.sense(now_ns)) is not None:
            self._count += 1
            if any(fault.kind == "laser_off" and fault.active(sensed.t_ns) for fault in self._faults):
                continue
            slow = [fault for fault in self._faults if fault.kind == "slow" and fault.active(sensed.t_ns)]
            if all(self._count % round(fault.amount) == 0 for fault in slow):
                return self._spoilt(sensed)
        return None

    def _spoilt(self, sensed: Sensed) -> Sensed:
        kinds = {fault.kind for fault in self._faults if fault.active(sensed.t_ns)}
        scan, T_odom_base = sensed.scan, sensed.T_odom_base
        if "laser_stuck" in kinds and self._held is not None:
            scan = replace(self._held.scan, stamp_ns=scan.stamp_ns)
        elif "laser_garbage" in kinds:
            scan = replace(scan, ranges_m=self._garbage(scan.ranges_m.size))
        else:
            self._held = sensed
        if T_odom_base is not None:
            for fault in self._faults:
                if fault.kind == "odometry_jump" and sensed.t_ns >= fault.at_s * 1e9:
                    T_odom_base = se2.compose(np.array([fault.amount, -fault.amount, 0.5 * fault.amount]), T_odom_base)
        return Sensed(sensed.t_ns, scan, T_odom_base)

    def _garbage(self, beams: int) -> np.ndarray:
        ranges = self._rng.uniform(-1.0, 40.0, beams).astype(np.float32)
        odd = np.array([np.nan, np.inf, -np.inf, 0.0, 1e30], dtype=np.float32)
        where = self._rng.random(beams) < 0.3
        ranges[where] = self._rng.choice(odd, int(where.sum()))
        return ranges

    def act(self, agent: Agent, now_ns: int) -> None:
        """Drive on."""
        self._body.act(agent, now_ns)

    @property
    def next_ns(self) -> int | None:
        """When the next scan comes due, where that is known."""
        return self._body.next_ns

    @property
    def finished(self) -> bool:
        """Whether no scan will come any more."""
        return self._body.finished
