"""Which pairs of maps to align next, and what is believed about each pair."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mrslam.agent.config import AgentConfig
from mrslam.agent.effects import AlignJob
from mrslam.agent.second_look import doubt, is_echo, refuted
from mrslam.alignment import Alignment, Prior, Rejection, StabilityCheck
from mrslam.spatial import OccupancyGrid, TiledMap, se2
from mrslam.spatial.se2 import Transform

Version = tuple[int, int]
UNCONFIRMED = "found once; a second alignment that agrees is awaited"
PRIOR_SIGMA = np.diag([0.5**2, 0.5**2, 0.1**2])
"""How far a pair's transform may have moved since it was last found: both maps get corrected. m^2, rad^2."""
WEAK = "found again, but on weak evidence that has not grown since"


@dataclass
class PairStatus:
    """What is believed about one pair of maps."""

    status: str = "untried"
    """"untried", "accepted", "rejected" or "revoked"."""
    alignment: Alignment | None = None
    accepted_at_ns: int | None = None
    reason: str = "not tried yet"
    attempts: int = 0
    tried_ns: int | None = None
    tried_area_m2: tuple[float, float] = (0.0, 0.0)
    tried_versions: tuple[Version, Version] | None = None
    searched_area_m2: tuple[float, float] = (0.0, 0.0)
    """How large the maps were when the place was last looked for everywhere."""
    confirmed: bool = False
    """Whether that look was accepted."""
    stability: StabilityCheck = field(default_factory=StabilityCheck)

    @property
    def awaits_confirmation(self) -> bool:
        """Whether one alignment was found and a second is needed before it is believed."""
        return self.alignment is None and self.stability.previous is not None and self.reason != WEAK

    def row(self, a: str, b: str) -> dict[str, Any]:
        """Return it as plain JSON values, as the mission's metrics list it."""
        found = self.alignment
        return {
            "a": a,
            "b": b,
            "status": self.status,
            "T_a_b": None if found is None else [float(value) for value in found.T_a_b],
            "accepted_at_s": None if self.accepted_at_ns is None else round(self.accepted_at_ns / 1e9, 3),
            "confidence": None if found is None else float(found.confidence),
            "reason": self.reason,
            "attempts": self.attempts,
        }


@dataclass(frozen=True)
class Verdict:
    """What came of one alignment, after the stability check."""

    status: str
    reason: str
    outcome: Alignment | Rejection
    edge: Alignment | None = None
    is_new: bool = False

    def fields(self) -> dict[str, Any]:
        """Return it as plain JSON values."""
        evidence = self.outcome.evidence
        return {
            "status": self.status,
            "reason": self.reason,
            "T_a_b": None if self.edge is None else [float(value) for value in self.edge.T_a_b],
            "confidence": float(self.outcome.confidence),
            "method": self.outcome.method,
            "evidence": {} if evidence is None else {name: round(v, 4) for name, v in evidence.as_row().items()},
        }


@dataclass
class PairBook:
    """Every pair of known maps, its last alignment, and which pair is worth the next try."""

    own_id: str
    config: AgentConfig
    pairs: dict[tuple[str, str], PairStatus] = field(default_factory=dict)
    _maps: dict[str, tuple[Version, TiledMap]] = field(default_factory=dict)
    _grids: dict[str, tuple[Version, OccupancyGrid, float]] = field(default_factory=dict)

    def map_changed(self, robot_id: str, version: Version, tiled: TiledMap) -> bool:
        """Note the newest map of a robot; return whether it started anew, so that its old frame is gone.

        Pairs with every other known map come into being.
        """
        old = self._maps.get(robot_id)
        is_anew = old is not None and old[0][0] != version[0]
        if is_anew:
            self._forget(robot_id)
        self._maps[robot_id] = (version, tiled)
        for other in self._maps:
            if other != robot_id:
                self.pairs.setdefault(_key(robot_id, other), PairStatus())
        return is_anew

    def forget(self, robot_id: str) -> None:
        """Forget a robot's map, and its pairs."""
        self._maps.pop(robot_id, None)
        self._grids.pop(robot_id, None)
        for pair in [pair for pair in self.pairs if robot_id in pair]:
            del self.pairs[pair]

    def _forget(self, robot_id: str) -> None:
        for pair in self.pairs:
            if robot_id in pair:
                self.pairs[pair] = PairStatus(reason=f"{robot_id} started a new map")

    def area_m2(self, robot_id: str) -> float:
        """Return the known area of a robot's map, 0 where there is none."""
        return self._grid(robot_id)[2] if robot_id in self._maps else 0.0

    def next_job(self, now_ns: int, T_team_map: Mapping[str, Transform]) -> AlignJob | None:
        """Return the pair most worth aligning: untried first, then the own map's, then the longest waiting."""
        due = [
            (self._rank(pair, status), pair)
            for pair, status in self.pairs.items()
            if self._is_due(pair, status, now_ns)
        ]
        if not due:
            return None
        a, b = min(due)[1]
        (version_a, grid_a, area_a), (version_b, grid_b, area_b) = self._grid(a), self._grid(b)
        prior = self._prior(a, b, T_team_map)
        attempt = self.pairs[a, b].attempts
        return AlignJob(a, b, grid_a, grid_b, prior, (version_a, version_b), (area_a, area_b), attempt)

    def _rank(self, pair: tuple[str, str], status: PairStatus) -> tuple[int, int, int]:
        tried = -1 if status.tried_ns is None else status.tried_ns
        return (0 if status.tried_ns is None else 1, 0 if self.own_id in pair else 1, tried)

    def _is_due(self, pair: tuple[str, str], status: PairStatus, now_ns: int) -> bool:
        a, b = pair
        if status.tried_ns is None:
            return True
        if now_ns - status.tried_ns < self.config.align_interval_s * 1e9:
            return False
        if status.awaits_confirmation:
            return True
        if status.tried_versions == (self._maps[a][0], self._maps[b][0]):
            return False
        if status.status != "accepted":
            return self._grown(pair, status.tried_area_m2, self.config.align_growth)
        waited_s = (now_ns - status.tried_ns) / 1e9
        return waited_s >= self.config.realign_interval_s or self._outgrown(pair, status)

    def _outgrown(self, pair: tuple[str, str], status: PairStatus) -> bool:
        """Return whether a merged pair's maps hold so much more that what was the only place may not be so any more."""
        growth = self.config.realign_growth if status.confirmed else self.config.align_growth
        return self._grown(pair, status.searched_area_m2, growth)

    def _grown(self, pair: tuple[str, str], before_m2: tuple[float, float], share: float) -> bool:
        return any(self._grid(one)[2] >= (1.0 + share) * area for one, area in zip(pair, before_m2, strict=True))

    def _grid(self, robot_id: str) -> tuple[Version, OccupancyGrid, float]:
        version, tiled = self._maps[robot_id]
        known = self._grids.get(robot_id)
        if known is None or known[0] != version:
            grid = tiled.to_grid()
            known = (version, grid, grid.known_area_m2())
            self._grids[robot_id] = known
        return known

    def _prior(self, a: str, b: str, T_team_map: Mapping[str, Transform]) -> Prior | None:
        """Return what is believed of a pair already aligned, so that following it is cheap; None: look everywhere."""
        status = self.pairs[a, b]
        is_placed = status.status == "accepted" and a in T_team_map and b in T_team_map
        if is_placed and status.confirmed and not self._outgrown((a, b), status):
            return Prior(se2.between(T_team_map[a], T_team_map[b]), PRIOR_SIGMA)
        return None

    def settle(self, job: AlignJob, outcome: Alignment | Rejection, now_ns: int) -> Verdict:
        """Judge the outcome by the pair's history and remember it."""
        if self._stale(job):
            return Verdict("rejected", "a map was started anew while this was computed", outcome)
        status = self.pairs[job.a, job.b]
        status.attempts += 1
        status.tried_ns, status.tried_area_m2, status.tried_versions = now_ns, job.area_m2, job.versions
        if job.prior is None:
            status.searched_area_m2, status.confirmed = job.area_m2, outcome.accepted
        if status.alignment is not None:
            reason = doubt(status.alignment, outcome) if job.prior is None else None
            if reason := reason or refuted(status.alignment, outcome):
                return Verdict("revoked", reason, outcome)
        if isinstance(outcome, Rejection):
            status.stability.previous = status.stability.believed
            if status.status != "accepted":  # it never outweighs an accepted alignment: only contradiction and doubt do
                status.status, status.reason = "rejected", outcome.reason
            return Verdict("rejected", outcome.reason, outcome)
        if status.alignment is None and is_echo(status.stability, outcome):
            status.status, status.reason = "rejected", WEAK
            return Verdict("rejected", WEAK, outcome)
        believed = status.stability.update(outcome)
        if believed is None:
            status.status, status.reason = "rejected", UNCONFIRMED
            return Verdict("rejected", UNCONFIRMED, outcome)
        is_new = status.status != "accepted"
        if is_new:
            status.accepted_at_ns = now_ns
        status.status, status.reason, status.alignment = "accepted", "accepted", believed
        return Verdict("accepted", "accepted", outcome, edge=believed, is_new=is_new)

    def _stale(self, job: AlignJob) -> bool:
        return any(
            robot not in self._maps or self._maps[robot][0][0] != version[0]
            for robot, version in zip((job.a, job.b), job.versions, strict=True)
        )

    def revoke(self, a: str, b: str, reason: str) -> None:
        """Forget a pair's alignment: it was contradicted. The pair is tried again when its maps have changed."""
        status = self.pairs[_key(a, b)]
        status.status, status.reason, status.alignment, status.accepted_at_ns = "revoked", reason, None, None
        status.stability = StabilityCheck()


def _key(one: str, other: str) -> tuple[str, str]:
    return (one, other) if one < other else (other, one)
