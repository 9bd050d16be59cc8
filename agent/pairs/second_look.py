"""What looking again at a pair of maps is worth: whether it confirms what was found, or takes a merge apart."""

from __future__ import annotations

from mrslam.alignment import Alignment, Rejection, StabilityCheck

THEREABOUTS = StabilityCheck(max_dx_m=2.0, max_dy_m=2.0, max_dtheta_rad=0.4)
"""A transform that differs by less is the one believed, corrected; one that differs by more is another place."""
CONFIDENT, MORE_WALL = 0.65, 1.2
"""What is found with less confidence is confirmed only by so many times as much agreeing wall."""
CLEAN, PLENTY_M = 0.1, 40.0
"""So is what agrees along less than so many metres and contradicts by more per agreeing metre; and what came to it must
be clean. Chance fits and lies in small worlds agree along 20 m and contradict by 0.14 or more; of right alignments of
simulated maps in the making 1 % are so stained. Real maps that are bent yet contradict so along 50 to 100 m."""
AMBIGUOUS = 0.25
"""A merged pair's maps must have come to fit elsewhere with no greater lead than this before it is unmerged: far less
than what merging asks for, so that nothing is merged and unmerged by turns."""
REFUTED = 0.4
"""A merged pair is unmerged where its maps contradict each other by more per metre of agreeing wall: a third more than
any pair is forgiven when it is merged, so that maps which are bent are not merged and unmerged by turns."""


def is_echo(stability: StabilityCheck, second: Alignment) -> bool:
    """Return whether a weak alignment only says once more what the maps said the first time.

    The same chance, or the same lie, looked at twice agrees with itself. What chose the first place cannot speak for
    it; what the maps have shown since can, and at a wrong place it contradicts.
    """
    first = stability.previous
    if first is None or not stability.agrees(second, first):
        return False
    wall_m = second.evidence.matched_m
    is_small = wall_m < PLENTY_M
    if second.confidence >= CONFIDENT and not (is_small and second.evidence.contradicted_per_m > CLEAN):
        return False
    if wall_m < MORE_WALL * first.evidence.matched_m:
        return True
    return is_small and any(
        new.contradicted_m - old.contradicted_m > CLEAN * (new.matched_m - old.matched_m)
        for old, new in ((first.evidence.a, second.evidence.a), (first.evidence.b, second.evidence.b))
    )


def doubt(believed: Alignment, outcome: Alignment | Rejection) -> str | None:
    """Return why a merged pair may lie elsewhere, now that its maps show more and all places were tried, or None.

    A house that looks the same turned around: who has seen one half of it cannot know which, and merges; who has seen
    both knows that there are two places.
    """
    if isinstance(outcome, Alignment):
        return None if THEREABOUTS.agrees(outcome, believed) else "the maps have grown, and fit better elsewhere"
    if outcome.evidence is None or outcome.evidence.margin >= AMBIGUOUS:
        return None
    return f"the maps have grown, and another place fits {1.0 - outcome.evidence.margin:.0%} as well"


def refuted(believed: Alignment, outcome: Alignment | Rejection) -> str | None:
    """Return why a merged pair's maps cannot lie as they were merged, now that they show more, or None."""
    if outcome.T_a_b is None or not THEREABOUTS.is_near(outcome.T_a_b, believed.T_a_b):
        return None
    if isinstance(outcome, Alignment) or outcome.evidence is None:
        return None
    share = outcome.evidence.contradicted_per_m
    if share <= REFUTED:
        return None
    return f"the maps have grown, and {share / (1.0 + share):.0%} of the walls compared lie where the other map is free"
