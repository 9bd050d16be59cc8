"""Graph algorithms over the edges of a team: components, the maximum spanning tree, paths and poses along it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping

from mrslam.merge.graph.edges import Edge, Pair, pair_of
from mrslam.spatial import se2

ROOT = ""
"""The node that known starting poses are edges of; no robot has this id."""


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


def tree_of(edges: Mapping[Pair, Edge]) -> dict[Pair, Edge]:
    """Return the maximum spanning forest of alignments by their confidences."""
    return spanning_tree(edges, lambda edge: edge.confidence)


def weakest(tree: Mapping[Pair, Edge], between: Iterable[Pair]) -> Pair | None:
    """Return the weakest alignment of a path, the first by ids of equals; known poses are none."""
    loose = [pair for pair in between if ROOT not in pair]
    return min(loose, key=lambda pair: (tree[pair].confidence, pair), default=None)


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


def path(tree: Iterable[Pair], start: str, end: str) -> list[Pair]:
    """Return the pairs along the tree from one robot to another; empty where none leads there."""
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
    pairs: list[Pair] = []
    while end in came_from and end != start:
        pairs.append(pair_of(end, came_from[end]))
        end = came_from[end]
    return pairs[::-1]


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
