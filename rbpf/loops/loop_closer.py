"""Loop closing: where the newest keyframe sees a place seen before, and how that bends the trajectory.

A fit is an edge between two keyframes. Where the trajectory already agrees with it, it only holds the trajectory there;
where it does not, a second fit has to say the same before it is believed.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.front_end.motion import CARRIED_M, chain_cov
from mrslam.rbpf.loops.drift import REACH_MOST_M, Drift, drift_from_newest, most
from mrslam.rbpf.loops.far_search import FarSearch
from mrslam.rbpf.loops.guesses import Guess
from mrslam.rbpf.loops.headings import NO_HEADINGS, Headings
from mrslam.rbpf.loops.kept_scans import KeptScans
from mrslam.rbpf.rows import Rows
from mrslam.spatial import se2
from mrslam.spatial.hits.views import Beams
from mrslam.spatial.matching import places
from mrslam.spatial.matching.gauss_newton import Match
from mrslam.spatial.matching.places import Place, PlaceMatcher, edge_information, fits
from mrslam.spatial.pose_graph import Edges, relax, relax_graduated
from mrslam.spatial.se2 import Transform

OLD_WAY_M = 12.0
"""A place is old when at least this much way lies between: what was seen on less is still in the rolling map."""
TAIL = 4
"""Keyframes before the newest one that are matched with it: one scan alone fits many places."""
EDGE_WAY_M = 2.5
"""Places that agreed are compared again after this much way."""
CONSISTENT_M, CONSISTENT_RAD = 0.12, 0.03
"""A fit within this of the trajectory is believed at once."""
AT_ONCE_M = 0.6
"""A very good fit that is no farther from the trajectory than this needs no second one."""
AGREE_M, AGREE_RAD, AGREE_WAY_M = 0.25, 0.05, 5.0
"""Two fits confirm each other that correct the trajectory alike within ``AGREE_M`` and ``AGREE_RAD``, at most
``AGREE_WAY_M`` of way apart."""


LOOP_CHI2 = 16.3
"""An edge that misses by more in the end is not believed: chi2 of 3 degrees of freedom, 99.9 %."""


class LoopCloser:
    """Edges between keyframes that saw one place, and the search for more of them."""

    def __init__(self, config: MapperConfig) -> None:
        self.scans = KeptScans()
        self._config = config
        self._far = FarSearch(self.scans, self._compare, config.evidence_beams, config.particles)
        self._is_far = False  # whether an edge was found that is far from the trajectory
        self.is_carried = False
        """Whether the robot was carried, and was not found in its map since."""
        self._matcher = PlaceMatcher(config.resolution_m, config.sigma_m)
        self._edges = Rows(2, np.int64)  # an old keyframe, and the one that saw it again
        self._edge_values = Rows(3 + 9)  # where the second is in the frame of the first, and the information of that
        # A fit to be confirmed: its keyframe, and its correction of the trajectory in the map frame.
        self._waiting: tuple[int, Transform] | None = None
        # Way at the newest edge; before there is one, far back for the next comparison and 0 for drift.
        self._last_fit_m, self._anchored_m = -1e9, 0.0

    @property
    def histories_most(self) -> int:
        """Bound on their number."""
        return self._far.most

    @histories_most.setter
    def histories_most(self, most: int) -> None:
        self._far.most = most

    @property
    def histories(self) -> list[Guess]:
        """Where else the robot may be than where the trajectory ends."""
        return self._far.guesses

    @property
    def edges(self) -> int:
        """Number of loop edges so far."""
        return self._edges.size

    def anchors(self, since: int) -> NDArray[np.int64]:
        """Return the old keyframes ``(n,)`` of edges from this number on that say where the robot is, not just along.

        Along a corridor an edge may lead metres beside the place.
        """
        information = self._edge_values.rows[since:, 3:].reshape(-1, 3, 3)
        return self._edges.rows[since:, 0][places.is_seen_all_round(information)]

    def add_key(self, beams: Beams, way_m: float, *, is_carried: bool = False, is_unconfirmed: bool = False) -> None:
        """Take a keyframe's scan, taken ``way_m`` after the keyframe before.

        ``is_carried`` : whether the robot was carried there; ``is_unconfirmed`` : whether its wheels alone led there.
        """
        self.scans.add(beams, way_m, is_apart=is_carried or is_unconfirmed)
        self.is_carried |= is_carried
        if is_carried:
            self._far.drop()

    def look(self, T_map_key: Transform, arrivals: NDArray[np.float64]) -> bool:
        """Compare the newest of the keyframes ``(K, 3)`` with an old one near it, or else with all of the map.

        ``arrivals (K, 9)`` : local motion to each keyframe (``mrslam.rbpf.front_end.motion``). Return whether there is
        a new edge that contradicts the trajectory.
        """
        return self._look_near(T_map_key) or self._look_far(T_map_key, arrivals)

    def _look_far(self, T_map_key: Transform, arrivals: NDArray[np.float64]) -> bool:
        """Look for the newest keyframes wherever drift may have put them off."""
        if not self._far.is_due(self.is_carried):
            return False
        way_m = self.scans.way_m
        cov = chain_cov(self._config, arrivals)
        reach_m, turn_rad = drift_from_newest(way_m, cov, self._edges.rows)
        kept = np.fromiter(self.scans.points, np.int64, len(self.scans.points))
        is_far = (reach_m > places.FAR_MOST_M) & (way_m[-1] - way_m > OLD_WAY_M + np.minimum(reach_m, REACH_MOST_M))
        if self.is_carried:
            is_far = reach_m > CARRIED_M
        old = kept[is_far[kept]]
        if not old.size:
            self._far.rest()
            return False
        drift = most(reach_m[old], turn_rad[old])
        if self.is_carried:
            farthest_m = np.hypot(*(T_map_key[old, :2] - T_map_key[-1, :2]).T).max()
            drift = Drift(float(farthest_m) + OLD_WAY_M, math.pi)
        believed = self._far.look(T_map_key, old, drift)
        for fit in believed:
            self._add_edge(fit.old, fit.found, fit.new)
        self.is_carried &= not believed
        self._is_far |= bool(believed)
        return bool(believed)

    def _look_near(self, T_map_key: Transform) -> bool:
        """Compare the newest of the keyframes ``(K, 3)`` with an old one near it."""
        if self.is_carried:
            return False
        way_m = float(self.scans.way_m[-1])
        lost_m = way_m - self._anchored_m  # way since the trajectory was last seen to agree with an old place
        if way_m - self._last_fit_m < EDGE_WAY_M:
            return False
        old = self._candidate(T_map_key, lost_m)
        if old is None:
            return False
        found = self._compare(T_map_key, old, se2.between(T_map_key[old], T_map_key[-1]), lost_m)
        if not fits(found):
            return False
        away_m, turned = se2.difference(found.pose, se2.between(T_map_key[old], T_map_key[-1]))
        consistent = away_m < CONSISTENT_M and turned < CONSISTENT_RAD
        sure = consistent or (away_m < AT_ONCE_M and fits(found, places.VERY_CLEAR))
        if not sure and not self._is_confirmed(T_map_key, old, found):
            return False
        self._add_edge(old, found)
        return not consistent

    def _candidate(self, T_map_key: Transform, lost_m: float) -> int | None:
        """Return the old keyframe that most likely saw what the newest sees."""
        kept, away_m, turned = self.scans.from_newest(T_map_key)
        way_m, newest = self.scans.way_m, T_map_key.shape[0] - 1
        is_old = (way_m[newest] - way_m[kept] > OLD_WAY_M) & (kept < newest - TAIL)
        is_near = is_old & (away_m < places.within_m(lost_m))
        if not is_near.any():
            return None
        cost = np.where(is_near, away_m + places.TURN_COST_M * turned, np.inf)
        return int(kept[np.argmin(cost)])

    def _compare(self, T_map_key: Transform, old: int, T_old_new: Transform, lost_m: float) -> Match:
        """Return how the newest of the keyframes ``(K, 3)`` matches the place of an ``old`` one, in its frame.

        ``T_old_new (3,)`` : where it is expected, by what may have drifted over ``lost_m``.
        """
        new = T_map_key.shape[0] - 1
        last = min(old + places.GROUP + 1, new - TAIL)
        group = self.scans.connected(old - places.GROUP, max(last, old + 1), old)  # its own at least
        keys = [k for k in group if k in self.scans.points]
        T_old_key = se2.between(T_map_key[old], T_map_key[keys])
        place = Place(self.scans.origins[keys], T_old_key, [self.scans.points[k] for k in keys])
        points = self.scans.joined(T_map_key, self.scans.connected(new - TAIL, new + 1, new), new)
        return self._matcher.match(place, points, T_old_new, lost_m)

    def _is_confirmed(self, T_map_key: Transform, old: int, found: Match) -> bool:
        """Return whether the fit before this one corrects the trajectory alike; if not, this one waits for the next."""
        newest, way_m = T_map_key.shape[0] - 1, self.scans.way_m
        T_map_fit = se2.compose(T_map_key[old], found.pose)
        before, self._waiting = self._waiting, (newest, se2.compose(T_map_fit, se2.inverse(T_map_key[newest])))
        if before is None or way_m[newest] - way_m[before[0]] > AGREE_WAY_M:
            return False
        away_m, turned = se2.difference(se2.compose(before[1], T_map_key[newest]), T_map_fit)
        return bool(away_m <= AGREE_M and turned <= AGREE_RAD)

    def _add_edge(self, old: int, found: Match, new: int | None = None) -> None:
        """Believe a fit of a keyframe, the newest if it is None."""
        self._last_fit_m = float(self.scans.way_m[-1])
        information = edge_information(found)
        if places.is_seen_all_round(information):
            self._anchored_m = self._last_fit_m
        self._waiting = None
        self._edges.add((old, self.scans.way_m.size - 1 if new is None else new))
        self._edge_values.add((*found.pose, *information.flat))

    def relaxed(self, T_map_key: Transform, chain: NDArray[np.float64], headings: Headings = NO_HEADINGS) -> Transform:
        """Return the trajectory ``(K, 3)`` that fits all edges.

        Neighbours are held where the filter has them, by the information ``chain (K, 3, 3)`` of each to the one before,
        and headings by the walls that were seen.
        """
        if not self.edges:
            return T_map_key.copy()
        count = T_map_key.shape[0]
        poses = self._put_back(T_map_key) if self._is_far else T_map_key
        directions, seen = headings.as_edges(poses)
        keys = np.arange(count - 1)
        motion = Edges(keys, keys + 1, se2.between(T_map_key[:-1], T_map_key[1:]), chain[1:])
        edges = Edges.joined([motion, self.as_edges(), seen])
        nodes, doubtful = np.concatenate([poses, directions]), np.arange(edges.first.size) >= keys.size
        if not self._is_far:
            return relax(nodes, edges, robust=doubtful)[:count]
        self._is_far = False
        bent, weight = relax_graduated(nodes, edges, doubtful, LOOP_CHI2)
        self._keep(weight[keys.size :][: self.edges] > 0.0)
        return bent[:count]

    def as_edges(self) -> Edges:
        """Return the loop edges as edges of a pose graph."""
        (first, second), values = self._edges.rows.T, self._edge_values.rows
        return Edges(first, second, values[:, :3], values[:, 3:].reshape(-1, 3, 3))

    def _keep(self, believed: NDArray[np.bool_]) -> None:
        """Drop the edges that are not ``believed (E,)``."""
        keys, values = self._edges.rows[believed].copy(), self._edge_values.rows[believed].copy()
        self._edges, self._edge_values = Rows.of(keys), Rows.of(values)

    def _put_back(self, T_map_key: Transform) -> Transform:
        """Return the trajectory with all keyframes since the robot was carried where the newest edge has them."""
        begin, (old, new) = self.scans.newest_start, self._edges.rows[-1]
        if not old < begin <= new:
            return T_map_key
        T_map_new = se2.compose(T_map_key[old], self._edge_values.rows[-1, :3])
        poses = T_map_key.copy()
        poses[begin:] = se2.compose(T_map_new, se2.between(T_map_key[new], T_map_key[begin:]))
        return poses

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed search needs."""
        return {
            "scans": self.scans.state(), "edges": self._edges.rows, "edge_values": self._edge_values.rows,
            "waiting": None if self._waiting is None else list(self._waiting),
            "way_m": [self._last_fit_m, self._anchored_m], "far": self._far.state(),
            "is_carried": self.is_carried,
        }  # fmt: skip

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from what :meth:`state` returned."""
        self.scans.restore(state["scans"])
        self._edges, self._edge_values = Rows.of(state["edges"]), Rows.of(state["edge_values"])
        self._waiting = None if state["waiting"] is None else (state["waiting"][0], state["waiting"][1])
        self._last_fit_m, self._anchored_m = state["way_m"]
        self._far.restore(state["far"])
        self.is_carried = state["is_carried"]
