"""Alignments that would put two other robots where they looked for each other and nobody was, or not where they met.

One of the alignments between such two is wrong. The weakest goes (:class:`mrslam.agent.witness.Witness`); what would be
the weakest is not believed in the first place, or it would be found and unmerged by turns.
"""

from __future__ import annotations

from collections.abc import Mapping

from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.pairs.hypotheses import Hypothesis
from mrslam.agent.pairs.weighing import refused, seen_elsewhere
from mrslam.alignment import Alignment, Rejection
from mrslam.merge import Pair
from mrslam.merge.graph.edges import make_edge, pair_of
from mrslam.merge.graph.tree import chain, path, tree_of, weakest
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform


def unless_refuted(
    pair: Pair, outcome: Alignment | Rejection, beliefs: Mapping[Pair, PairBelief]
) -> Alignment | Rejection:
    """Return the outcome for a pair that is not merged, refused where it leads others to places that are refuted."""
    if isinstance(outcome, Rejection) or beliefs[pair].alignment is not None:
        return outcome
    held = {names: found for names, belief in beliefs.items() if (found := belief.weighed_alignment) is not None}
    tree = tree_of({names: make_edge(*names, found) for names, found in held.items()})
    a, b = pair
    T_a, T_b = chain(tree, a), chain(tree, b)
    if b in T_a:
        return outcome  # placed through others already: it moves nobody
    joined = {**tree, pair: make_edge(a, b, outcome)}
    for one in sorted(T_a):
        for other in sorted(T_b):
            names = pair_of(one, other)
            belief = beliefs.get(names)
            if names == pair or belief is None:
                continue
            T = se2.compose(se2.inverse(T_a[one]), se2.compose(outcome.T_a_b, T_b[other]))
            why = _against(names, belief, T if names[0] == one else se2.inverse(T))
            if why is not None and weakest(joined, path(joined, one, other)) == pair:
                return refused(outcome, why)
    return outcome


def _against(names: Pair, belief: PairBelief, T_a_b: Transform) -> str | None:
    """Return what speaks against a place of two robots: nobody was there, or they saw each other elsewhere."""
    a, b = names
    place = belief.places.at(T_a_b)
    if place is not None and place.is_refuted:
        return nobody_there(a, b, place)
    ahead = belief.places.ahead_of(T_a_b)
    return None if ahead is None else f"placed through it, {seen_elsewhere(f'{a} and {b}', ahead)}"


def nobody_there(a: str, b: str, place: Hypothesis) -> str:
    """Return why an alignment between two robots is given up that have this place by it."""
    return f"placed through it, {a} and {b} looked for each other, and nobody was there ({place.llr:.1f} nats)"
