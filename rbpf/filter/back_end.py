"""What happens to a keyframe: particles, their maps, loops. Nothing of it is needed to match the next scan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.crew import Crew
from mrslam.rbpf.filter.particle_filter import ParticleFilter
from mrslam.rbpf.filter.trajectory import smoothed
from mrslam.rbpf.front_end.health import Health
from mrslam.rbpf.front_end.motion import ARRIVAL_COLUMNS, WAY, Keyframe, chain_cov
from mrslam.rbpf.loops.loops import MOVED_M, LoopCloser
from mrslam.rbpf.outcome import Stopwatch
from mrslam.rbpf.rows import Rows
from mrslam.spatial.se2 import Transform


@dataclass(frozen=True, kw_only=True, eq=False)
class Verdict:
    """What is known after a keyframe."""

    T_map_key: Transform
    """``(3,)``, where the best particle has it."""
    neff: float
    resampled: bool
    loop_closed: bool
    health: float

    def state(self) -> dict[str, Any]:
        """Return its fields."""
        return dict(vars(self))


class BackEnd:
    """Takes one keyframe after the other."""

    def __init__(self, config: MapperConfig, seed: int, crew: Crew, watch: Stopwatch) -> None:
        self.config = config
        self.filter = ParticleFilter(config, seed, crew, watch)
        self.loops = LoopCloser(config)
        self._watch = watch
        self._arrivals = Rows(ARRIVAL_COLUMNS)
        self._health = Health()
        self._contradicted = False  # the newest keyframe's place, by what was seen there before

    @property
    def arrivals(self) -> NDArray[np.float64]:
        """``(K, 6)``: local motion from keyframe to keyframe, see ``mrslam.rbpf.front_end.motion``."""
        return self._arrivals.rows

    @property
    def T_map_key(self) -> Transform:
        """``(K, 3)``: keyframes as the best particle remembers them."""
        return self.filter.ancestry(self.filter.best)

    def take(self, key: Keyframe) -> Verdict:
        """Update every particle, and see whether the robot is back where it has been."""
        self._watch.start()
        resamplings = self.filter.resamplings
        agreement = self.filter.move(key)
        if agreement is not None:
            self._health.follow(agreement, key)
        edges = self.loops.edges
        self.filter.draw(key, beside=lambda: self._look(key))
        closed = self._contradicted and self._relax()
        if self.loops.edges > edges:
            self._health.anchor()
        self._watch.lap("loops")
        return Verdict(
            T_map_key=self.filter.ends[self.filter.best].copy(), neff=self.filter.neff, health=self._health.value,
            resampled=self.filter.resamplings > resamplings, loop_closed=closed,
        )  # fmt: skip

    def _look(self, key: Keyframe) -> None:
        """Where the best particle comes to a place it has been, see whether its trajectory agrees."""
        self._arrivals.add(key.arrival)
        self.loops.add_key(key.beams, float(key.arrival[WAY]))
        poses = self.T_map_key
        self.loops.forget(poses)
        self._contradicted = self.config.close_loops and self.loops.look(poses)
        self._watch.lap("loops")

    def _relax(self) -> bool:
        """Bend the trajectory until it agrees with all places seen again; return whether that changed the map."""
        poses = self.T_map_key
        relaxed = self.loops.relaxed(poses, chain_cov(self.config, self.arrivals))
        if np.hypot(*(relaxed - poses)[:, :2].T).max() < MOVED_M:
            return False
        self.filter.adopt(relaxed, self.loops.scans, self.loops.origins)
        return True

    def smoothed(self) -> Transform:
        """Return the best particle's keyframes ``(K, 3)`` without the jitter of sampling."""
        return smoothed(self.T_map_key, self.arrivals, self.config)

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed mapper needs."""
        return {
            "filter": self.filter.state(), "loops": self.loops.state(), "arrivals": self.arrivals,
            "health": self._health.state(),
        }  # fmt: skip

    def restore(self, state: dict[str, Any]) -> None:
        """Become what was saved."""
        self.filter.restore(state["filter"])
        self.loops.restore(state["loops"])
        self._arrivals = Rows.of(state["arrivals"])
        self._health.restore(state["health"])
