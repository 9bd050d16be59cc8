"""Alignments that would put two other robots where they looked for each other, and nobody was there.

One of the alignments between such two is wrong. The weakest goes (:class:`mrslam.agent.witness.Witness`); what would be
the weakest is not believed in the first place, or it would be found and unmerged by turns.
"""

from __future__ import annotations

from collections.abc import Mapping

from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.pairs.weighing import refused
from mrslam.alignment import Alignment, Rejection
from mrslam.merge import Pair
from mrslam.merge.graph.edges import Edge, make_edge, pair_of
from mrslam.merge.graph.tree import chain, path, spanning_tree
from mrslam.spatial import se2


def unless_refuted(
    pair: Pair, outcome: Alignment | Rejection, beliefs: Mapping[Pair, PairBelief]
) -> Alignment | Rejection:
    """Return the outcome for a pair that is not merged, refused where it leads others to places that are refuted."""
    if isinstance(outcome, Rejection) or beliefs[pair].alignment is not None:
        return outcome
    held = {names: found for names, belief in beliefs.items() if (found := belief.weighed_alignment) is not None}
    tree = spanning_tree({names: make_edge(*names, found) for names, found in held.items()}, _confidence)
    a, b = pair
    T_a, T_b = chain(tree, a), chain(tree, b)
    if b in T_a:
        return outcome  # placed through others already: it moves nobody
    for one in sorted(T_a):
        for other in sorted(T_b):
            first, second = names = pair_of(one, other)
            belief = beliefs.get(names)
            if names == pair or belief is None:
                continue
            T = se2.compose(se2.inverse(T_a[one]), se2.compose(outcome.T_a_b, T_b[other]))
            place = belief.places.at(T if first == one else se2.inverse(T))
            between = [*path(tree, one, a), *path(tree, b, other)]
            if place is not None and place.is_refuted and _is_weakest(pair, outcome, tree, between):
                reason = f"placed through it, {first} and {second} looked for each other, and nobody was there"
                return refused(outcome, f"{reason} ({place.llr:.1f} nats)")
    return outcome


def _confidence(edge: Edge) -> float:
    return edge.confidence


def _is_weakest(pair: Pair, found: Alignment, tree: Mapping[Pair, Edge], others: list[Pair]) -> bool:
    """Return whether an alignment would go first of those between two robots; of equals the first by ids does."""
    return (found.confidence, pair) < min((tree[names].confidence, names) for names in others)
