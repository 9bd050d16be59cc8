"""Buildings that repeat themselves, known by having been wrong: maps that fitted where the robots were not.

Equal rooms and equal wings fit onto each other as well as one place seen twice, and a robot that has seen one of them
cannot know that there is another. A fit that turned out wrong tells: from then on less is believed of maps alone.
"""

from __future__ import annotations

from collections.abc import Mapping

from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.pairs.weighing import refused
from mrslam.alignment import Alignment, Rejection
from mrslam.merge import Pair

MORE_WALL = 2.0
"""Times as much wall as has fitted at wrong places must agree, where nothing but maps speaks for a place."""
AS_MUCH_WALL = 1.0
"""Times as much below which a pair is unmerged again: less than what merging asks for, so that it is not by turns."""


def misfitted_m(beliefs: Mapping[Pair, PairBelief]) -> float:
    """Return how much wall has fitted at wrong places so far, of all pairs together, metres."""
    return sum(belief.places.misfitted_m for belief in beliefs.values())


def unless_repeated(
    pair: Pair, outcome: Alignment | Rejection, beliefs: Mapping[Pair, PairBelief]
) -> Alignment | Rejection:
    """Return the outcome for a pair that is not merged, refused where as much wall may well agree at a wrong place."""
    belief = beliefs[pair]
    if isinstance(outcome, Rejection) or belief.alignment is not None:
        return outcome
    here, wrong_m = belief.places.at(outcome.T_a_b), misfitted_m(beliefs)
    if outcome.evidence.matched_m >= MORE_WALL * wrong_m or (here is not None and here.llr > 0.0):
        return outcome
    return refused(
        outcome,
        f"maps are alike at several places here ({wrong_m:.0f} m of wall fitted at wrong ones): "
        f"{MORE_WALL * wrong_m:.0f} m must agree, or the robots see each other",
    )


def too_little(beliefs: Mapping[Pair, PairBelief]) -> list[tuple[Pair, str]]:
    """Return the merged pairs for which no more wall speaks than has fitted at wrong places since, and why, in words.

    Not those of which the robots saw each other there.
    """
    least_m = AS_MUCH_WALL * misfitted_m(beliefs)
    found = []
    for pair, belief in beliefs.items():
        if belief.alignment is None:
            continue
        here = belief.places.at(belief.alignment.T_a_b)
        wall_m = max(belief.alignment.evidence.matched_m, 0.0 if here is None else here.fitted_m)
        if wall_m < least_m and (here is None or here.llr <= 0.0):
            found.append((pair, f"as much wall as agrees here ({wall_m:.0f} m) has fitted at wrong places since"))
    return found
