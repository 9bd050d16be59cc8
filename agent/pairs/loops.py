"""Loops of three: where two maps lie by what is believed of each and a third; evidence to choose between places."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from mrslam.merge import Pair
from mrslam.merge.graph.edges import pair_of
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

if TYPE_CHECKING:
    from mrslam.agent.pairs.belief import PairBelief

SUREST = 0.98
"""Most that two alignments are trusted together, 0..1: those of robots that saw each other."""


class Loop(NamedTuple):
    """Where a third robot has a pair."""

    T_a_b: Transform
    """``(3,)``: T_a_c T_c_b."""
    llr: float
    """What it says for this place against another where the maps fit alike, nats."""


def loops_of(pair: Pair, beliefs: Mapping[Pair, PairBelief]) -> list[Loop]:
    """Return where each robot that is merged with both of a pair has them.

    With p the product of the two confidences, both are right and lead to the right place, or one of them is wrong and
    may lead to any: p to 1 - p at least. Two right ones of walls alone (0.89 each) say 4 to 1, robots that were seen
    (0.99) 50 to 1; one that just passed says next to nothing.
    """
    a, b = pair
    found = []
    for third in sorted({name for names in beliefs for name in names} - {a, b}):
        sides = [beliefs.get(pair_of(name, third)) for name in pair]
        held = [None if belief is None else belief.weighed_alignment for belief in sides]
        if held[0] is None or held[1] is None:
            continue
        T_a_c = held[0].T_a_b if a < third else se2.inverse(held[0].T_a_b)
        T_b_c = held[1].T_a_b if b < third else se2.inverse(held[1].T_a_b)
        p = min(held[0].confidence * held[1].confidence, SUREST)
        found.append(Loop(se2.compose(T_a_c, se2.inverse(T_b_c)), max(math.log(p / (1.0 - p)), 0.0)))
    return found
