"""The team as a graph: robots' maps are nodes, accepted alignments edges; the result is where every map lies."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from mrslam.merge.config import MergeConfig
from mrslam.merge.graph.consistency import drop_broken_loops, drop_broken_triangles
from mrslam.merge.graph.edges import AlignmentLike, Edge, Pair, make_edge
from mrslam.merge.graph.nodes import Node, node_of
from mrslam.merge.graph.solve import jointly
from mrslam.merge.graph.tree import ROOT, chain, components, path, tree_of, weakest
from mrslam.merge.joint.bend import Bend
from mrslam.spatial import InputError, OccupancyGrid, TiledMap, se2

CERTAIN = 1e6
"""Confidence of a known starting pose: more than all alignments of a team together, each of which is at most 1."""

Conflict = Callable[[str, str, se2.Transform, int], str | None]
"""(a, b, T_a_b, alignments between) -> how the two maps contradict each other placed like this, or None."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Placement:
    """Where the maps of a team lie."""

    anchor: str | None = None
    """The robot whose map frame is the team frame; None where known poses define it, or nothing was placed."""
    T_team_map: dict[str, se2.Transform] = field(default_factory=dict)
    """By robot id, in order: maps points of its map into the team frame; of a bent map, right at its last keyframe."""
    unplaced: dict[str, str] = field(default_factory=dict)
    """By robot id: why it is not placed."""
    T_rigid: dict[str, se2.Transform] = field(default_factory=dict)
    """``T_team_map`` by the alignments alone, without bending."""
    bends: dict[str, Bend] = field(default_factory=dict)
    """By robot id, for those tied to the anchor by what their scans saw: how its map is bent, in the team frame."""
    edges: tuple[Edge, ...] = ()
    """The alignments used."""
    dropped: dict[Pair, str] = field(default_factory=dict)
    """The alignments not used, and why."""

    def without(self, robot_id: str) -> Placement:
        """Return the placement as far as it says nothing of this robot's map."""
        edges = tuple(edge for edge in self.edges if robot_id not in edge.pair)
        dropped = {pair: reason for pair, reason in self.dropped.items() if robot_id not in pair}
        return replace(
            self, T_team_map=_except(robot_id, self.T_team_map), unplaced=_except(robot_id, self.unplaced),
            T_rigid=_except(robot_id, self.T_rigid), bends=_except(robot_id, self.bends), edges=edges, dropped=dropped,
        )  # fmt: skip

    @cached_property
    def tree(self) -> dict[Pair, Edge]:
        """The maximum spanning forest of the alignments used."""
        return tree_of({edge.pair: edge for edge in self.edges})


T = TypeVar("T")


def _except(robot_id: str, by_robot: Mapping[str, T]) -> dict[str, T]:
    return {other: one for other, one in by_robot.items() if other != robot_id}


class TeamGraph:
    """Robots' maps, and where they lie by the alignments given: :meth:`place` is a pure function of both."""

    def __init__(self, config: MergeConfig | None = None) -> None:
        self.config = config or MergeConfig()
        self._nodes: dict[str, Node] = {}
        self._known_poses: dict[str, se2.Transform] = {}
        self._solved: tuple[object, dict[str, se2.Transform], dict[Pair, Edge]] = (None, {}, {})
        """What was solved last, its places and its tree (a cache): most placements are for maps that grew."""

    @property
    def robots(self) -> list[str]:
        """The ids of all robots with a map, sorted."""
        return sorted(self._nodes)

    def set_map(self, robot_id: str, known: OccupancyGrid | TiledMap) -> None:
        """Take or replace a robot's map; only its area and extent are kept here."""
        if robot_id == ROOT:
            raise InputError("a robot's id must not be empty")
        self._nodes[robot_id] = node_of(known)

    def remove_map(self, robot_id: str) -> None:
        """Forget a robot's map."""
        self._nodes.pop(robot_id, None)

    def set_known_poses(self, T_team_map: Mapping[str, ArrayLike]) -> None:
        """Set starting poses ``T_team_map (3,)``; they define the team frame, and place maps without any overlap."""
        for robot_id, pose in T_team_map.items():
            if np.shape(pose) != (3,) or not np.isfinite(np.asarray(pose, dtype=np.float64)).all():
                raise InputError(f"known pose of {robot_id} must be x (m), y (m), theta (rad), got {pose!r}")
        self._known_poses = {x: np.array(T_team_map[x], dtype=np.float64) for x in sorted(T_team_map)}

    def place(
        self,
        alignments: Mapping[Pair, AlignmentLike],
        anchor: str | None = None,
        conflict: Conflict | None = None,
        before: str | None = None,
        tied: Collection[Pair] = frozenset(),
    ) -> Placement:
        """Return where the maps of the anchor's component lie; without an anchor, those of the largest component.

        ``alignments`` : accepted ``T_a_b`` by pair (a, b); those of robots without a map are left out. With an anchor
        the team frame is its map's frame. Without one it is that of the known poses, else the map frame of the robot
        ``before`` where that is in the component, else of the component's first robot by id. ``conflict`` compares the
        maps' content: alignments that lay walls on free space are not used. ``tied`` : pairs that a joint solution
        holds together; of maps that contradict each other through these, the weakest of them goes.
        """
        if anchor is not None and anchor not in self._nodes:
            return Placement(anchor=anchor, unplaced=dict.fromkeys(self.robots, f"{anchor} has no map"))
        edges, dropped = self._usable(alignments, conflict)
        nodes, edges, root = self._with_known_poses(edges)
        while True:
            for drop_broken in (drop_broken_triangles, drop_broken_loops):
                edges, broken = drop_broken(nodes, edges, self.config, root)
                dropped |= broken
            group = self._component(nodes, edges, anchor or root, before)
            start = anchor or (
                before if root is None and before in group else next(iter(group), None)
            )  # ROOT sorts first
            poses, tree = self._solve(edges, group, start)
            ties = tree_of({pair: edge for pair, edge in edges.items() if pair in tied})
            contradicted = _contradicted((ties, tree), group, poses, conflict) if conflict else None
            if contradicted is None:
                break
            pair, reason = contradicted
            dropped[pair] = reason
            del edges[pair]
        poses.pop(ROOT, None)
        return Placement(
            anchor=None if start == ROOT else start,
            T_team_map=poses,
            T_rigid=dict(poses),
            unplaced={x: _why(x, edges, dropped) for x in self.robots if x not in poses},
            edges=tuple(edge for edge in edges.values() if edge.a in poses and edge.b in poses),
            dropped=dict(sorted(dropped.items())),
        )

    def _usable(
        self, alignments: Mapping[Pair, AlignmentLike], conflict: Conflict | None
    ) -> tuple[dict[Pair, Edge], dict[Pair, str]]:
        """Return the alignments between known maps as edges, and those that are not to be used, with reasons."""
        usable, dropped = dict[Pair, Edge](), dict[Pair, str]()
        given = {edge.pair: edge for edge in (make_edge(a, b, found) for (a, b), found in alignments.items())}
        for pair, edge in sorted(given.items()):
            if pair[0] not in self._nodes or pair[1] not in self._nodes:
                continue
            if edge.confidence < self.config.min_confidence:
                dropped[pair] = f"confidence {edge.confidence:.2f} < {self.config.min_confidence:.2f}"
            elif conflict is not None and (reason := conflict(*pair, edge.T_a_b, 1)):
                dropped[pair] = f"contradicted: {reason}"
            else:
                usable[pair] = edge
        return usable, dropped

    def _with_known_poses(self, edges: dict[Pair, Edge]) -> tuple[dict[str, Node], dict[Pair, Edge], str | None]:
        """Return nodes and edges with those of the known poses added, and ROOT, or None where no pose is known."""
        known = {x: pose for x, pose in self._known_poses.items() if x in self._nodes}
        if not known:
            return self._nodes, edges, None
        sigma_m, sigma_rad = self.config.known_pose_sigma_m, self.config.known_pose_sigma_rad
        # The solver multiplies every edge's covariance by covariance_scale; that of known poses is to stay as set.
        covariance = np.diag([sigma_m**2, sigma_m**2, sigma_rad**2]) / self.config.covariance_scale
        nodes = {**self._nodes, ROOT: Node(area_m2=0.0, centre_m=np.zeros(2), diameter_m=0.0)}
        known_edges = {
            (ROOT, x): Edge(a=ROOT, b=x, T_a_b=pose, confidence=CERTAIN, covariance=covariance)
            for x, pose in known.items()
        }
        return nodes, edges | known_edges, ROOT

    def _component(
        self, nodes: Mapping[str, Node], edges: Mapping[Pair, Edge], must: str | None, before: str | None
    ) -> list[str]:
        """Return the connected group with ``must`` in it, or the largest one; of equals the one with ``before``."""
        groups = components(nodes, edges)
        if must is not None:
            return next(group for group in groups if must in group)

        def size(group: list[str]) -> tuple[float, bool, float]:
            area, count = sum(nodes[x].area_m2 for x in group), float(len(group))
            first, second = (area, count) if self.config.component == "area" else (count, area)
            return first, before in group, second

        return max(groups, key=size, default=[])  # the first of equals

    def _solve(
        self, edges: Mapping[Pair, Edge], group: list[str], start: str | None
    ) -> tuple[dict[str, se2.Transform], dict[Pair, Edge]]:
        """Return the places of a component's maps in the frame of ``start``, and its maximum spanning tree."""
        if start is None:
            return {}, {}
        inside = {pair: edge for pair, edge in edges.items() if pair[0] in group}
        asked = (start, *(edge.content for edge in inside.values()))
        if self._solved[0] != asked:
            tree = tree_of(inside)
            self._solved = asked, jointly(chain(tree, start), inside.values(), start, self.config), tree
        return {robot_id: pose.copy() for robot_id, pose in self._solved[1].items()}, self._solved[2]


def _contradicted(
    trees: tuple[Mapping[Pair, Edge], ...], group: list[str], poses: Mapping[str, se2.Transform], conflict: Conflict
) -> tuple[Pair, str] | None:
    """Return the weakest alignment on the path between two maps that contradict each other, and why.

    ``trees`` : the path is the one in the first of these that has any.
    """
    for i, a in enumerate(group):
        for b in group[i + 1 :]:
            if ROOT in (a, b):
                continue
            tree, between = next((tree, way) for tree in trees if (way := path(tree, a, b)))
            reason = conflict(a, b, se2.between(poses[a], poses[b]), len(between))
            if reason and (wrong := weakest(tree, between)) is not None:
                return wrong, f"contradicted: placed through it, {reason}"
    return None


def _why(robot_id: str, edges: Mapping[Pair, Edge], dropped: Mapping[Pair, str]) -> str:
    """Return in words why a robot is not placed."""
    lost = [f"{a}-{b}: {why}" for (a, b), why in dropped.items() if robot_id in (a, b)]
    fits = sorted(edge.other(robot_id) for edge in edges.values() if robot_id in edge.pair)
    text = f"fits only {_listed(fits)}, not placed either" if fits else "no accepted alignment"
    return text + (f" ({'; '.join(lost)})" if lost else "")


def _listed(names: list[str], most: int = 3) -> str:
    """Return some of the names, and the number of those left out."""
    more = f" and {len(names) - most} others" if len(names) > most else ""
    return ", ".join(names[:most]) + more
