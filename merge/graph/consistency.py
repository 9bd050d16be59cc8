"""Which alignments of a team cannot all be right: loops of transforms must close.

A robot that knows two teammates tells whether the alignment between them is right (Hoerner 2016 keeps every edge of
its spanning tree; here edges that fail others with more evidence go first).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.config import MergeConfig
from mrslam.merge.graph.edges import Edge, Pair, pair_of
from mrslam.spatial import se2


@dataclass(frozen=True, kw_only=True, eq=False)
class Node:
    """What the graph knows of one robot's map."""

    area_m2: float
    """Known area, square metres."""
    centre_m: NDArray[np.float64]
    """``(2,)`` centre of the known cells in the map's frame, metres."""
    diameter_m: float
    """Diagonal of the known cells' box, metres."""


def tolerance(config: MergeConfig, nodes: Iterable[Node], hops: int) -> tuple[float, float]:
    """Return by how much (metres, radians) a loop of so many alignments may fail to close."""
    grows = math.sqrt(max(hops, 3) / 3.0)
    bent = config.loop_tolerance_share * max((node.diameter_m for node in nodes), default=0.0)
    return (config.loop_tolerance_m + bent) * grows, config.loop_tolerance_rad * grows


def apart(T_1: se2.Transform, T_2: se2.Transform, centre_m: NDArray[np.float64]) -> tuple[float, float]:
    """Return how far two estimates of one transform are apart: metres at a map's centre, radians."""
    one, two = se2.apply(T_1, centre_m), se2.apply(T_2, centre_m)
    return float(np.hypot(*(one - two))), se2.difference(T_1, T_2)[1]


def drop_broken_triangles(
    nodes: Mapping[str, Node], edges: Mapping[Pair, Edge], config: MergeConfig, fixed: str | None
) -> tuple[dict[Pair, Edge], dict[Pair, str]]:
    """Return the edges kept, and why the others went: while a triangle is open, its least supported edge goes.

    An edge's support is its confidence, plus the weaker of the two other edges' for every triangle that closes, minus
    the same for every one that does not. Edges at the node ``fixed`` (known poses) never go.
    """
    kept, dropped = dict(sorted(edges.items())), dict[Pair, str]()
    triangles = {t: _closure(nodes, kept, t, config) for t in _triangles(kept)}
    while True:
        support = {pair: edge.confidence for pair, edge in kept.items()}
        suspects: dict[Pair, tuple[str, str, str]] = {}
        for triangle, (closes, _) in triangles.items():
            pairs = _sides(triangle)
            for i, pair in enumerate(pairs):
                weaker = min(kept[pairs[i - 1]].confidence, kept[pairs[i - 2]].confidence)
                support[pair] += weaker if closes else -weaker
                if not closes and fixed not in pair:
                    suspects.setdefault(pair, triangle)
        if not suspects:
            return kept, dropped
        worst = min(suspects, key=lambda pair: (support[pair], kept[pair].confidence, pair))
        loop = "-".join(_named(robot_id) for robot_id in suspects[worst])
        dropped[worst] = f"the loop {loop} fails to close by {triangles[suspects[worst]][1]}"
        del kept[worst]
        triangles = {t: closure for t, closure in triangles.items() if worst not in _sides(t)}


def _named(robot_id: str) -> str:
    return robot_id or "known poses"


def _sides(triangle: tuple[str, str, str]) -> tuple[Pair, Pair, Pair]:
    a, b, c = triangle
    return (a, b), (b, c), (a, c)


def _triangles(edges: Mapping[Pair, Edge]) -> list[tuple[str, str, str]]:
    """Return all (a, b, c), a < b < c, with three edges."""
    beyond: dict[str, list[str]] = {}
    for a, b in sorted(edges):
        beyond.setdefault(a, []).append(b)
    return [(a, b, c) for a, b in sorted(edges) for c in beyond.get(b, []) if (a, c) in edges]


def _closure(
    nodes: Mapping[str, Node], edges: Mapping[Pair, Edge], triangle: tuple[str, str, str], config: MergeConfig
) -> tuple[bool, str]:
    a, b, c = triangle
    T_a_c = se2.compose(edges[a, b].T_a_b, edges[b, c].T_a_b)
    gap_m, gap_rad = apart(T_a_c, edges[a, c].T_a_b, nodes[c].centre_m)
    limit_m, limit_rad = tolerance(config, (nodes[x] for x in triangle), 3)
    return gap_m <= limit_m and gap_rad <= limit_rad, f"{gap_m:.2f} m and {math.degrees(gap_rad):.1f} deg"


def spanning_tree(edges: Mapping[Pair, Edge], strength: Callable[[Edge], float]) -> dict[Pair, Edge]:
    """Return the maximum spanning forest (Kruskal); equal strengths are taken in the order of ids."""
    parent: dict[str, str] = {}

    def root(x: str) -> str:
        while parent.setdefault(x, x) != x:
            x = parent[x]
        return x

    tree: dict[Pair, Edge] = {}
    for pair in sorted(edges, key=lambda p: (-strength(edges[p]), p)):
        a, b = root(pair[0]), root(pair[1])
        if a != b:
            parent[max(a, b)] = min(a, b)
            tree[pair] = edges[pair]
    return tree


def components(ids: Iterable[str], edges: Collection[Pair]) -> list[list[str]]:
    """Return the connected groups of robots, each sorted, in order of their first ids."""
    neighbours: dict[str, list[str]] = {robot_id: [] for robot_id in sorted(ids)}
    for a, b in edges:
        neighbours[a].append(b)
        neighbours[b].append(a)
    seen: set[str] = set()
    groups = []
    for start in neighbours:
        if start in seen:
            continue
        group, frontier = {start}, [start]
        while frontier:
            for nearby in neighbours[frontier.pop()]:
                if nearby not in group:
                    group.add(nearby)
                    frontier.append(nearby)
        seen |= group
        groups.append(sorted(group))
    return groups


def path(tree: Mapping[Pair, Edge], start: str, end: str) -> list[Pair]:
    """Return the pairs along the tree from one robot to another; empty where there is no way."""
    neighbours: dict[str, list[str]] = {}
    for a, b in tree:
        neighbours.setdefault(a, []).append(b)
        neighbours.setdefault(b, []).append(a)
    came_from: dict[str, str] = {start: start}
    frontier = [start]
    while frontier and end not in came_from:
        here = frontier.pop(0)
        for nearby in sorted(neighbours.get(here, [])):
            if nearby not in came_from:
                came_from[nearby] = here
                frontier.append(nearby)
    way: list[Pair] = []
    while end in came_from and end != start:
        way.append(pair_of(end, came_from[end]))
        end = came_from[end]
    return way[::-1]


def chain(tree: Mapping[Pair, Edge], start: str) -> dict[str, se2.Transform]:
    """Return ``T_start_x`` for every robot the tree reaches."""
    neighbours: dict[str, list[Edge]] = {}
    for edge in tree.values():
        neighbours.setdefault(edge.a, []).append(edge)
        neighbours.setdefault(edge.b, []).append(edge)
    found = {start: se2.IDENTITY}
    frontier = [start]
    while frontier:
        here = frontier.pop(0)
        for edge in sorted(neighbours.get(here, []), key=lambda e: e.pair):
            there = edge.other(here)
            if there not in found:
                found[there] = se2.compose(found[here], edge.from_to(here))
                frontier.append(there)
    return found


def drop_broken_loops(
    nodes: Mapping[str, Node], edges: Mapping[Pair, Edge], config: MergeConfig, fixed: str | None
) -> tuple[dict[Pair, Edge], dict[Pair, str]]:
    """Return the edges kept, and why the others went, for loops of any length through the spanning tree."""
    kept, dropped = dict(sorted(edges.items())), dict[Pair, str]()
    while True:
        tree = spanning_tree(kept, lambda edge: edge.confidence)
        support = {pair: edge.confidence for pair, edge in kept.items()}
        suspects: dict[Pair, str] = {}
        for pair in sorted(kept.keys() - tree.keys()):
            way = path(tree, *pair)
            T_a_b = chain({p: tree[p] for p in way}, pair[0])[pair[1]]
            gap_m, gap_rad = apart(T_a_b, kept[pair].T_a_b, nodes[pair[1]].centre_m)
            ids = {x for p in way for x in p}
            limit_m, limit_rad = tolerance(config, (nodes[x] for x in ids), len(way) + 1)
            closes = gap_m <= limit_m and gap_rad <= limit_rad
            for p in [pair, *way]:
                weakest = min(kept[q].confidence for q in [pair, *way] if q != p)
                support[p] += weakest if closes else -weakest
            if not closes:
                gap = f"{gap_m:.2f} m and {math.degrees(gap_rad):.1f} deg"
                for p in [pair, *way]:
                    if fixed not in p:
                        suspects.setdefault(p, f"a loop of {len(way) + 1} alignments fails to close by {gap}")
        if not suspects:
            return kept, dropped
        worst = min(suspects, key=lambda pair: (support[pair], kept[pair].confidence, pair))
        dropped[worst] = suspects[worst]
        del kept[worst]
