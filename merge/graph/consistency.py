"""Which alignments of a team cannot all be right: around a loop of alignments the transforms compose to identity.

Hoerner (2016) keeps every edge of his spanning tree; here a third robot decides: of the edges of a loop that fails to
close, the one with the least support by other loops is dropped.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from mrslam.merge.config import MergeConfig
from mrslam.merge.graph.edges import Edge, Pair
from mrslam.merge.graph.nodes import Node
from mrslam.merge.graph.tree import chain, path, spanning_tree
from mrslam.spatial import se2

SEEN_CONFIDENCE = 0.99
"""Confidence from which an alignment is one of robots that saw each other, 0..1: above those by walls alone."""


@dataclass(frozen=True)
class Loop:
    """A cycle of alignments."""

    pairs: tuple[Pair, ...]
    closes: bool
    complaint: str
    """Reason reported for an edge that is dropped because this loop fails to close."""


def tolerance(config: MergeConfig, nodes: Iterable[Node], hops: int) -> tuple[float, float]:
    """Return by how much (metres, radians) a loop of ``hops`` alignments may fail to close.

    The settings are for a triangle; errors of independent alignments add up with the square root of their number.
    """
    grows = math.sqrt(max(hops, 3) / 3.0)
    bent = config.loop_tolerance_share * max((node.diameter_m for node in nodes), default=0.0)
    return (config.loop_tolerance_m + bent) * grows, config.loop_tolerance_rad * grows


def drop_broken_triangles(
    nodes: Mapping[str, Node], edges: Mapping[Pair, Edge], config: MergeConfig, fixed: str | None
) -> tuple[dict[Pair, Edge], dict[Pair, str]]:
    """Return the edges kept, and why the others went, by loops of three; edges at the node ``fixed`` never go."""
    triangles = [_triangle(nodes, edges, ids, config, fixed) for ids in _triangles(edges)]

    def remaining(kept: Mapping[Pair, Edge]) -> list[Loop]:
        return [loop for loop in triangles if all(pair in kept for pair in loop.pairs)]

    return _drop_broken(edges, remaining, fixed)


def drop_broken_loops(
    nodes: Mapping[str, Node], edges: Mapping[Pair, Edge], config: MergeConfig, fixed: str | None
) -> tuple[dict[Pair, Edge], dict[Pair, str]]:
    """Return the edges kept, and why the others went, by the loops that each edge closes over the spanning tree."""

    def fundamental(kept: Mapping[Pair, Edge]) -> list[Loop]:
        tree = spanning_tree(kept, lambda edge: edge.confidence)
        return [_over_tree(nodes, tree, kept[pair], config, fixed) for pair in sorted(kept.keys() - tree.keys())]

    return _drop_broken(edges, fundamental, fixed)


def _drop_broken(
    edges: Mapping[Pair, Edge], loops: Callable[[Mapping[Pair, Edge]], list[Loop]], fixed: str | None
) -> tuple[dict[Pair, Edge], dict[Pair, str]]:
    """Drop the least supported edge of the loops that fail to close until all of them close, seen ones last."""
    kept, dropped = dict(sorted(edges.items())), dict[Pair, str]()
    while True:
        found = loops(kept)
        suspects = _suspects(found, fixed)
        if not suspects:
            return kept, dropped
        support = _support(kept, found)
        # What robots saw of each other is no chance that repeats itself, as look-alikes are: others go first.
        worst = min(
            suspects,
            key=lambda pair: (kept[pair].confidence >= SEEN_CONFIDENCE, support[pair], kept[pair].confidence, pair),
        )
        dropped[worst] = suspects[worst]
        del kept[worst]


def _support(kept: Mapping[Pair, Edge], loops: Iterable[Loop]) -> dict[Pair, float]:
    """Return each edge's confidence, plus that of the weakest other edge of every loop it closes, minus where not."""
    support = {pair: edge.confidence for pair, edge in kept.items()}
    for loop in loops:
        for pair in loop.pairs:
            weakest = min(kept[other].confidence for other in loop.pairs if other != pair)
            support[pair] += weakest if loop.closes else -weakest
    return support


def _suspects(loops: Iterable[Loop], fixed: str | None) -> dict[Pair, str]:
    """Return the edges that may be dropped, with the first complaint about each."""
    suspects: dict[Pair, str] = {}
    for loop in loops:
        for pair in loop.pairs:
            if not loop.closes and fixed not in pair:
                suspects.setdefault(pair, loop.complaint)
    return suspects


def _triangles(edges: Mapping[Pair, Edge]) -> list[tuple[str, str, str]]:
    """Return all (a, b, c), a < b < c, with three edges."""
    beyond: dict[str, list[str]] = {}
    for a, b in sorted(edges):
        beyond.setdefault(a, []).append(b)
    return [(a, b, c) for a, b in sorted(edges) for c in beyond.get(b, []) if (a, c) in edges]


def _triangle(
    nodes: Mapping[str, Node],
    edges: Mapping[Pair, Edge],
    ids: tuple[str, str, str],
    config: MergeConfig,
    fixed: str | None,
) -> Loop:
    a, b, c = ids
    T_a_c = se2.compose(edges[a, b].T_a_b, edges[b, c].T_a_b)
    name = "the loop " + "-".join(robot_id or "known poses" for robot_id in ids)
    return _loop(name, ((a, b), (b, c), (a, c)), T_a_c, edges[a, c], nodes, config, fixed)


def _over_tree(
    nodes: Mapping[str, Node], tree: Mapping[Pair, Edge], edge: Edge, config: MergeConfig, fixed: str | None
) -> Loop:
    between = path(tree, *edge.pair)
    T_a_b = chain({pair: tree[pair] for pair in between}, edge.a)[edge.b]
    pairs = (edge.pair, *between)
    return _loop(f"a loop of {len(pairs)} alignments", pairs, T_a_b, edge, nodes, config, fixed)


def _loop(
    name: str,
    pairs: tuple[Pair, ...],
    T_a_b: se2.Transform,
    direct: Edge,
    nodes: Mapping[str, Node],
    config: MergeConfig,
    fixed: str | None,
) -> Loop:
    """Return the loop of an edge and a path beside it; ``T_a_b`` : the same transform by the path."""
    gap_m, gap_rad = se2.difference_at(T_a_b, direct.T_a_b, nodes[direct.b].centre_m)
    ids = {robot_id for pair in pairs for robot_id in pair}
    limit_m, limit_rad = tolerance(config, (nodes[x] for x in ids), len(pairs))
    limit_m += limit_rad * _lever_m(pairs, nodes, fixed)
    closes = gap_m <= limit_m and gap_rad <= limit_rad
    return Loop(pairs, closes, f"{name} fails to close by {gap_m:.2f} m and {math.degrees(gap_rad):.1f} deg")


def _lever_m(pairs: Iterable[Pair], nodes: Mapping[str, Node], fixed: str | None) -> float:
    """Return the longest lever arm of a loop's known poses, metres: from a map's origin to its known cells' edge.

    A known pose is that of the map's origin; an error of its heading displaces the cells by that angle times the lever.
    """
    known = [a if b == fixed else b for a, b in pairs if fixed in (a, b)]
    return max([0.0, *(float(np.hypot(*nodes[x].centre_m)) - nodes[x].diameter_m / 2.0 for x in known)])
