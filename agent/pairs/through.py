"""Alignments that would put two other robots where they looked for each other and nobody was, or not where they met.

One of the alignments between such two is wrong, or what the two say is: one that was carried tells others for a while
that it is where it was. The weakest goes (:class:`mrslam.agent.witness.Witness`), unless its own robots saw each other
there more surely; what would go is not believed in the first place, or it would be found and unmerged by turns.
"""

from __future__ import annotations

from collections.abc import Mapping

from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.pairs.weighing import against, refused, weight_against
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
            T_names = T if names[0] == one else se2.inverse(T)
            why = against_by_way(names, belief, T_names)
            if why is None or weakest(joined, path(joined, one, other)) != pair:
                continue
            if not is_surer(beliefs[pair], outcome.T_a_b, belief, T_names):
                return refused(outcome, why)
    return outcome


def against_by_way(names: Pair, belief: PairBelief, T_a_b: Transform) -> str | None:
    """Return what was seen that speaks against a place to which third robots lead, in words, or None."""
    reason = against(belief.places, T_a_b, " and ".join(names))
    return None if reason is None else f"placed through it, {reason}"


def is_surer(belief: PairBelief, T_a_b: Transform, by_way: PairBelief, T_by_way: Transform) -> bool:
    """Return whether robots saw each other at a place more surely than two others speak against where it leads them."""
    place = belief.places.at(T_a_b)
    return place is not None and place.llr > weight_against(by_way.places, T_by_way)
