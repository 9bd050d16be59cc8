"""The team as a graph: robots' maps are nodes, accepted alignments edges; out come the maps' places."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mrslam.merge.config import MergeConfig
from mrslam.merge.graph import consistency
from mrslam.merge.graph.consistency import Node
from mrslam.merge.graph.edges import AlignmentLike, Edge, Pair, make_edge, pair_of
from mrslam.merge.graph.solve import jointly
from mrslam.spatial import InputError, OccupancyGrid, se2

ROOT = ""
"""The node that known starting poses hang on; no robot has this id."""

Conflict = Callable[[str, str, se2.Transform, int], str | None]
"""(a, b, T_a_b, alignments between) -> how the two maps contradict each other placed like this, or None."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Placement:
    """Where the maps of a team lie."""

    anchor: str | None
    """The robot whose map frame is the team frame; None where known poses define it, or nothing was placed."""
    T_team_map: dict[str, se2.Transform]
    """By robot id, in order: maps points of its map into the team frame."""
    unplaced: dict[str, str]
    """By robot id: why it is not placed."""
    edges: tuple[Edge, ...]
    """The alignments used."""
    dropped: dict[Pair, str]
    """The alignments not used, and why."""


class TeamGraph:
    """Robots' maps and the accepted alignments between them; :meth:`place` is a pure function of both."""

    def __init__(self, config: MergeConfig | None = None) -> None:
        self.config = config or MergeConfig()
        self._nodes: dict[str, Node] = {}
        self._edges: dict[Pair, Edge] = {}
        self._revoked: dict[Pair, str] = {}
        self._known_poses: dict[str, se2.Transform] = {}

    @property
    def edges(self) -> dict[Pair, Edge]:
        """The accepted alignments, in order of ids."""
        return dict(sorted(self._edges.items()))

    @property
    def revoked(self) -> dict[Pair, str]:
        """Alignments taken back by :meth:`revoke`, and why."""
        return dict(sorted(self._revoked.items()))

    @property
    def robots(self) -> list[str]:
        """The ids of all robots with a map, sorted."""
        return sorted(self._nodes)

    def set_map(self, robot_id: str, grid: OccupancyGrid) -> None:
        """Take or replace a robot's map; only its area and extent are kept here."""
        if robot_id == ROOT:
            raise InputError("a robot's id must not be empty")
        self._nodes[robot_id] = node_of(grid)

    def remove_map(self, robot_id: str) -> None:
        """Forget a robot, its map and its alignments."""
        self._nodes.pop(robot_id, None)
        self._edges = {pair: edge for pair, edge in self._edges.items() if robot_id not in pair}

    def set_edge(self, a: str, b: str, alignment: AlignmentLike) -> None:
        """Accept or replace the alignment ``T_a_b`` of a pair."""
        edge = make_edge(a, b, alignment)
        self._edges[edge.pair] = edge
        self._revoked.pop(edge.pair, None)

    def revoke(self, a: str, b: str, reason: str) -> None:
        """Take an alignment back; the pair is unmerged unless other alignments join it."""
        pair = pair_of(a, b)
        if self._edges.pop(pair, None) is not None:
            self._revoked[pair] = reason

    def set_known_poses(self, T_team_map: Mapping[str, ArrayLike]) -> None:
        """Give starting poses; they define the team frame, and place maps that overlap with none."""
        for robot_id, pose in T_team_map.items():
            if np.shape(pose) != (3,) or not np.isfinite(np.asarray(pose, dtype=np.float64)).all():
                raise InputError(f"known pose of {robot_id} must be x (m), y (m), theta (rad), got {pose!r}")
        self._known_poses = {x: np.array(T_team_map[x], dtype=np.float64) for x in sorted(T_team_map)}

    def place(
        self, anchor: str | None = None, conflict: Conflict | None = None, before: str | None = None
    ) -> Placement:
        """Return where the maps of the anchor's component lie; without anchor, of the largest component.

        With an anchor the team frame is its map's frame. Without one it is that of the known poses, else the map frame
        of the robot ``before`` where that is in the component, else of the component's first robot by id. ``conflict``
        looks at the maps' content: alignments that lay walls on free space are not used.
        """
        if anchor is not None and anchor not in self._nodes:
            return Placement(
                anchor=anchor, T_team_map={}, unplaced=self._all(f"{anchor} has no map"), edges=(), dropped={}
            )
        nodes, edges, dropped, fixed = self._usable(conflict)
        while True:
            for check in (consistency.drop_broken_triangles, consistency.drop_broken_loops):
                edges, broken = check(nodes, edges, self.config, fixed)
                dropped |= broken
            group = self._group(nodes, edges, anchor or fixed, before)
            start = anchor or (before if fixed is None and before in group else next(iter(group), None))
            poses, wrong = self._solve(nodes, edges, group, start, conflict)
            if wrong is None:
                break
            dropped[wrong[0]] = wrong[1]
            del edges[wrong[0]]
        frame = None if start == ROOT else start  # the known poses' node sorts first
        poses.pop(ROOT, None)
        used = tuple(edge for edge in edges.values() if edge.a in poses and edge.b in poses)
        unplaced = {x: self._why(x, poses, edges, dropped) for x in self.robots if x not in poses}
        return Placement(
            anchor=frame, T_team_map=poses, unplaced=unplaced, edges=used, dropped=dict(sorted(dropped.items()))
        )

    def _all(self, reason: str) -> dict[str, str]:
        return dict.fromkeys(self.robots, reason)

    def _usable(
        self, conflict: Conflict | None
    ) -> tuple[dict[str, Node], dict[Pair, Edge], dict[Pair, str], str | None]:
        """Return nodes, edges to work with, edges put aside with reasons, and the known poses' node if there is one."""
        nodes, edges, dropped = dict(self._nodes), dict[Pair, Edge](), dict[Pair, str]()
        for pair, edge in sorted(self._edges.items()):
            if pair[0] not in nodes or pair[1] not in nodes:
                continue
            if edge.confidence < self.config.min_confidence:
                dropped[pair] = f"confidence {edge.confidence:.2f} < {self.config.min_confidence:.2f}"
                continue
            against = conflict(*pair, edge.T_a_b, 1) if conflict else None
            if against:
                dropped[pair] = f"contradicted: {against}"
                continue
            edges[pair] = edge
        known = {x: pose for x, pose in self._known_poses.items() if x in nodes}
        if not known:
            return nodes, edges, dropped, None
        nodes[ROOT] = Node(area_m2=0.0, centre_m=np.zeros(2), diameter_m=0.0)
        sigma_m, sigma_rad = self.config.known_pose_sigma_m, self.config.known_pose_sigma_rad
        covariance = np.diag([sigma_m**2, sigma_m**2, sigma_rad**2]) / self.config.covariance_scale
        for x, pose in known.items():
            edges[ROOT, x] = Edge(a=ROOT, b=x, T_a_b=pose, confidence=1e6, covariance=covariance)
        return nodes, edges, dropped, ROOT

    def _group(
        self, nodes: Mapping[str, Node], edges: Mapping[Pair, Edge], must: str | None, before: str | None
    ) -> list[str]:
        groups = consistency.components(nodes, edges)
        if not groups:
            return []
        if must is not None:
            return next(group for group in groups if must in group)

        def size(group: list[str]) -> tuple[float, bool, float]:
            area, count = sum(nodes[x].area_m2 for x in group), float(len(group))
            first, second = (area, count) if self.config.component == "area" else (count, area)
            return first, before in group, second

        return max(groups, key=size)  # the first of equals

    def _solve(
        self,
        nodes: Mapping[str, Node],
        edges: Mapping[Pair, Edge],
        group: list[str],
        start: str | None,
        conflict: Conflict | None,
    ) -> tuple[dict[str, se2.Transform], tuple[Pair, str] | None]:
        """Return the places of a component in its node ``start``, or the edge that makes them impossible and why."""
        if start is None:
            return {}, None
        inside = {pair: edge for pair, edge in edges.items() if pair[0] in group}
        tree = consistency.spanning_tree(inside, lambda edge: edge.confidence)
        poses = jointly(consistency.chain(tree, start), inside.values(), start, self.config)
        if conflict is not None:
            for i, a in enumerate(group):
                for b in group[i + 1 :]:
                    if ROOT in (a, b):
                        continue
                    way = consistency.path(tree, a, b)
                    against = conflict(a, b, se2.between(poses[a], poses[b]), len(way))
                    loose = [pair for pair in way if ROOT not in pair]
                    if against and loose:
                        weakest = min(loose, key=lambda pair: (edges[pair].confidence, pair))
                        return poses, (weakest, f"contradicted: placed through it, {against}")
        return poses, None

    def _why(
        self, robot_id: str, poses: Mapping[str, se2.Transform], edges: Mapping[Pair, Edge], dropped: Mapping[Pair, str]
    ) -> str:
        """Return in words why a robot is not placed."""
        lost = [f"{pair[0]}-{pair[1]}: {why}" for pair, why in dropped.items() if robot_id in pair]
        lost += [f"{pair[0]}-{pair[1]}: {why}" for pair, why in self.revoked.items() if robot_id in pair]
        apart = [edge.other(robot_id) for edge in edges.values() if robot_id in edge.pair]
        if apart:
            text = f"fits only {_listed(sorted(apart))}, not placed either"
        else:
            text = "no accepted alignment" if poses or lost else "no map"
        return text + (f" ({'; '.join(lost)})" if lost else "")


def _listed(names: list[str], most: int = 3) -> str:
    """Return a few names, and how many more there are."""
    more = f" and {len(names) - most} others" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def node_of(grid: OccupancyGrid) -> Node:
    """Return area and extent of a map's known cells."""
    part = grid.cropped()
    size = np.array(part.shape[::-1]) * part.resolution_m
    centre = np.asarray(part.origin_m) + size / 2.0
    return Node(area_m2=part.known_area_m2(), centre_m=centre, diameter_m=float(np.hypot(*size)))
