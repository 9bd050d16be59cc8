"""Alignments that would put two other robots where they looked for each other and nobody was, or not where they met.

One of the alignments between such two is wrong, or what the two say is: one that was carried tells others for a while
that it is where it was. The weakest goes (:class:`mrslam.agent.witness.Witness`), unless its own robots saw each other
there more surely; what would go is not believed in the first place, or it would be found and unmerged by turns.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.pairs.weighing import against, refused
from mrslam.alignment import Alignment, Rejection
from mrslam.merge import Pair
from mrslam.merge.graph.edges import Edge, make_edge, pair_of
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
    joined = {**tree, pair: make_edge(a, b, beliefs[pair].as_weighed(outcome))}
    for one in sorted(T_a):
        for other in sorted(T_b):
            names = pair_of(one, other)
            if names == pair or names not in beliefs:
                continue
            T = se2.compose(se2.inverse(T_a[one]), se2.compose(outcome.T_a_b, T_b[other]))
            wrong = misplacing(names, T if names[0] == one else se2.inverse(T), joined, beliefs)
            if wrong is not None and wrong.pair == pair:
                return refused(outcome, wrong.reason)
    return outcome


class Misplacing(NamedTuple):
    """An alignment that leads two other robots to a place where they were not."""

    pair: Pair
    reason: str


def misplacing(
    names: Pair, T_a_b: Transform, tree: Mapping[Pair, Edge], beliefs: Mapping[Pair, PairBelief]
) -> Misplacing | None:
    """Return which alignment has to go for what two robots saw, who are placed through third ones; None where none has.

    ``T_a_b`` : where the tree of alignments has the maps of these two robots.
    """
    objection = against(beliefs[names].places, T_a_b, " and ".join(names))
    if objection is None or (pair := weakest(tree, path(tree, *names))) is None:
        return None
    met = beliefs[pair].places.at(tree[pair].T_a_b)
    if met is not None and met.llr > objection.llr:
        return None  # its own robots saw each other there, and more surely
    return Misplacing(pair, f"placed through it, {objection.words}")
