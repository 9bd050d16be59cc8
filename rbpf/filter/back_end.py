"""Work on a keyframe: particles, their maps, loops. The front end does not need it to match the next scan."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.filter.particle_filter import ParticleFilter
from mrslam.rbpf.filter.trajectory import smoothed
from mrslam.rbpf.filter.uncertainty import chain_information, map_covariance
from mrslam.rbpf.front_end.health import Health
from mrslam.rbpf.front_end.motion import ARRIVAL_COLUMNS, WAY, Keyframe, chain_cov
from mrslam.rbpf.loops.loop_closer import LoopCloser
from mrslam.rbpf.outcome import Stopwatch
from mrslam.rbpf.rows import Rows
from mrslam.spatial import se2
from mrslam.spatial.runtime.crew import Crew
from mrslam.spatial.se2 import Transform

MOVED_M = 0.05
"""Maps are drawn again when relaxation moves a keyframe against the others by more than this, metres: a cell of the
usual size. What turns the map as a whole about its first keyframe changes nothing in it, but all of its tiles."""
HEADING_SHARE = 0.5
"""Share of the motion's deviation in heading by which relaxation bends: 0.14 degrees in the first metre, as maps that
walls keep straight drift (:mod:`.wall_directions`); the motion alone has 0.27. With all of it corridors are bent."""
WALLS_APART = 4.0
"""Factor of the variance of what walls say of headings, in relaxation: over a building errors repeat each other for
20 keyframes, 12 m, where neighbours' do for 5. With 1 the campus is bent more."""


@dataclass(frozen=True, kw_only=True, eq=False)
class KeyframeResult:
    """What the back end reports of a keyframe."""

    T_map_key: Transform
    """``(3,)``, pose of the keyframe by the best particle."""
    neff: float
    """Effective number of particles, before resampling."""
    resampled: bool
    loop_closed: bool
    """Whether the trajectory was relaxed and the maps drawn again."""
    health: float
    """0..1, see :class:`mrslam.rbpf.front_end.health.Health`."""
    is_lost: bool
    """Whether it was carried, or came where its map does not show it, and was not found since."""

    def state(self) -> dict[str, Any]:
        """Return its fields."""
        return dict(vars(self))


class BackEnd:
    """Takes one keyframe after the other."""

    def __init__(self, config: MapperConfig, seed: int, crew: Crew, watch: Stopwatch) -> None:
        self.config = config
        self.particles_most = config.particles
        """Bound on the number of particles, and of histories of a robot that was carried."""
        self.filter = ParticleFilter(replace(config, particles=1), seed, crew, watch)
        self.loops = LoopCloser(config)
        self._watch = watch
        self._arrivals = Rows(ARRIVAL_COLUMNS)
        self._matched = Rows(9)
        self._health = Health()
        self._is_contradicted = False  # whether the newest loop edge contradicts the trajectory
        self._is_carried = False  # whether the robot was carried, and was not found in its map since
        self._lost_from: int | None = None  # keyframe at which it was carried, or led by its wheels alone
        self._covariance, self._covariance_at = np.zeros((3, 3)), (0, 0)  # of so many keyframes and loop edges

    @property
    def arrivals(self) -> NDArray[np.float64]:
        """``(K, 9)``: local motion from keyframe to keyframe, see ``mrslam.rbpf.front_end.motion``."""
        return self._arrivals.rows

    @property
    def matched(self) -> NDArray[np.float64]:
        """``(K, 3, 3)``: what each keyframe's match to the best particle's map says of its pose, in its own axes."""
        return self._matched.rows.reshape(-1, 3, 3)

    def add(self, key: Keyframe) -> KeyframeResult:
        """Update every particle and its map, and see whether the robot is back where it has been."""
        self._watch.start()
        resamplings, edges = self.filter.resamplings, self.loops.edges
        self._follow_need()
        self._is_carried |= key.is_carried
        if key.is_apart:
            self._lost_from = self._arrivals.size
        agreement = self.filter.move(key, self._is_carried)
        self._matched.add(np.zeros(9) if agreement is None else agreement.information.ravel())
        if agreement is not None:
            self._health.follow(agreement, key)
        self.filter.draw(key, beside=lambda: self._look_for_loop(key))
        closed = self._is_contradicted and self._relax()
        self._is_carried &= self.loops.is_carried
        if self.loops.edges > edges and not self._is_carried:
            self._anchor(self.loops.anchors(edges))
        self._watch.lap("loops")
        return KeyframeResult(
            T_map_key=self.filter.ends[self.filter.best].copy(), neff=self.filter.neff, health=self._health.value,
            is_lost=self._health.is_lost, resampled=self.filter.resamplings > resamplings, loop_closed=closed,
        )  # fmt: skip

    def _anchor(self, old: NDArray[np.int64]) -> None:
        """Trust the pose again where new loop edges lead surely to keyframes ``old (n,)`` from before it was lost."""
        if old.size and (self._lost_from is None or old.min() < self._lost_from):
            self._health.anchor()
            self._lost_from = None

    @property
    def usual_fit(self) -> float:
        """0..1: of the beams on known cells the share that fitted the best particle's map of late."""
        return self._health.usual_fit

    def _follow_need(self) -> None:
        """Let there be as many particles as the trajectory is uncertain: one where all of the way was seen.

        Where scans show the way, all particles would be where the one is, to the centimetres that matching errs by.
        """
        count = self.particles_most if self._health.is_adrift else 1
        if self.filter.count != count:
            self.filter.resize(count)

    def use_particles(self, most: int) -> None:
        """Change the bound on the number of particles."""
        self.particles_most = self.loops.histories_most = most
        if self.filter.count > most:
            self.filter.resize(most)

    def _look_for_loop(self, key: Keyframe) -> None:
        """Where the best particle comes to a place it has been, see whether its trajectory agrees."""
        self._arrivals.add(key.arrival)
        self.loops.add_key(
            key.beams, float(key.arrival[WAY]), is_carried=key.is_carried, is_unconfirmed=key.is_unconfirmed
        )
        trajectory = self.filter.trajectory
        self.loops.scans.forget(trajectory)
        self._is_contradicted = self.config.close_loops and self.loops.look(trajectory, self.arrivals)
        self._watch.lap("loops")

    def _relax(self) -> bool:
        """Bend the trajectory until it agrees with all places seen again; return whether that changed the maps."""
        trajectory = self.filter.trajectory
        cov = chain_cov(self.config, self.arrivals)
        cov[:, 2, 2] *= HEADING_SHARE**2
        headings = self.filter.headings
        headings = headings._replace(variance=WALLS_APART * headings.variance)
        relaxed = self.loops.relaxed(trajectory, np.asarray(np.linalg.inv(cov)), headings)
        T_map_relaxed = se2.fit_rigid(trajectory[:, :2], relaxed[:, :2])
        moved = se2.compose(T_map_relaxed, relaxed) - trajectory
        if np.hypot(*moved[:, :2].T).max() < MOVED_M or not self.filter.has_room(relaxed):
            return False
        self.filter.adopt(relaxed, self.loops.scans.points, self.loops.scans.origins)
        return True

    @property
    def covariance(self) -> NDArray[np.float64]:
        """``(3, 3)``, how far off the map is at the newest keyframe by the best particle's graph, m^2 and rad^2."""
        at = (self._arrivals.size, self.loops.edges)
        if self._covariance_at != at:
            chain = chain_information(self.config, self.arrivals, self.matched)
            self._covariance_at = at
            self._covariance = map_covariance(
                self.filter.trajectory, chain, self.loops.as_edges(), self.filter.headings
            )
        return self._covariance

    def smoothed(self) -> Transform:
        """Return the best particle's keyframes ``(K, 3)`` without the jitter of sampling."""
        return smoothed(self.filter.trajectory, self.arrivals, self.config)

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed mapper needs."""
        return {
            "filter": self.filter.state(), "loops": self.loops.state(), "arrivals": self.arrivals,
            "matched": self._matched.rows, "health": self._health.state(), "is_carried": self._is_carried,
            "lost_from": self._lost_from, "particles_most": self.particles_most,
        }  # fmt: skip

    def restore(self, state: dict[str, Any]) -> None:
        """Become what was saved."""
        self.filter.restore(state["filter"])
        self.loops.restore(state["loops"])
        self._arrivals, self._matched = Rows.of(state["arrivals"]), Rows.of(state["matched"])
        self._health.restore(state["health"])
        self._is_carried, self._lost_from = state["is_carried"], state["lost_from"]
        self.particles_most = self.loops.histories_most = state["particles_most"]
