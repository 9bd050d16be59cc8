"""Whether a further alignment of a pair confirms an earlier one, or refutes it.

An alignment can be wrong in two ways that its own evidence does not show: by chance, where little wall agrees, and
because the building repeats, where another place fits as well. Both show as the maps grow: at a wrong place, new walls
contradict.
"""

from __future__ import annotations

from mrslam.alignment import Alignment, Evidence, Rejection, StabilityCheck
from mrslam.alignment.stability import CORRECTED, SAME_PLACE

FORESEEN_M = 5.0
"""Wall that agreed from which the best place of a search that found none counts as foreseen, metres."""
FORESEEN_LEAD = 0.65
"""And its least lead over other places once it is found, 0..1: a rival that is only just ruled out may come back."""
STRONG_CONFIDENCE = 0.65
"""Least confidence at which a second alignment on the same evidence confirms a first."""
WALL_GROWTH = 1.2
"""Least growth factor of the agreeing wall for a second alignment to confirm a weak first."""
MUCH_WALL_M = 40.0
"""Wall that agrees from which contradiction is forgiven, metres. Chance fits and false maps in small worlds agree along
20 m; real maps that are bent contradict as much as those along 50 to 100 m."""
CLEAN_PER_M = 0.1
"""Contradiction per agreeing metre from which less wall than that needs a second look. Measured: chance fits and false
maps in small worlds have 0.14 or more; of right alignments of simulated maps still growing, 1 % have more than 0.1."""
LITTLE_WALL_M, SPOTLESS_PER_M = 20.0, 0.025
"""The same of two robots' maps that agree along less wall than that: rooms that fit by chance while maps are young.
From there to ``MUCH_WALL_M`` more is allowed, for real maps are bent. Measured in 29 offices: of alignments with less
wall that were believed as soon as two agreed 19 of 201 contradict by more at right places, 17 of 17 at wrong ones."""
ONE_ROOM = 1.0 / 3.0
"""Share of the smaller of two robots' maps below which ``LITTLE_WALL_M`` that agrees is one room of several, which an
equal one fits without a stain: shared ground has to grow as well. Measured in 59 offices, two more of 200, by the first
look and the second of pairs that do not see each other: at three wrong places it grew by 0 to 6 %, the walls of one by
21 %; of 108 right ones 18 wait for it."""
AMBIGUOUS_MARGIN = 0.25
"""A merged pair is unmerged where a search everywhere finds another place with a smaller lead than this, 0..1: far less
than what merging asks for, so that no pair is merged and unmerged by turns."""
RIVAL_SHARE = 0.5
"""... and that place shows at least this share of the wall that agreed where the pair was merged."""
REFUTED_PER_M = 0.4
"""A merged pair is unmerged where its maps contradict each other by more per agreeing metre: a third more than any pair
is forgiven when it is merged, for the same reason."""


def is_echo(
    stability: StabilityCheck, second: Alignment, saved_m2: float | None = None, *, is_of_robots: bool = True
) -> bool:
    """Return whether a second alignment only repeats the evidence of the first, and that evidence is weak.

    The same chance, or the same false map, agrees with itself. The evidence that chose the first place cannot confirm
    it; what the maps have shown since can.

    ``saved_m2`` : known area of a saved map in which a robot's is looked for. A room of it may look like one that was
    not saved, which no other place tells: till it is a few rooms, or all that was saved, more of it must agree.
    ``is_of_robots`` : whether both maps are robots'. They grow: more may be asked for where rooms fit by chance.
    """
    first = stability.previous
    if first is None or not stability.agrees(second, first):
        return False
    before, now = first.evidence, second.evidence
    if is_of_robots and _is_one_room_again(before, now):
        return True
    may_be_a_room = saved_m2 is not None and now.matched_m < MUCH_WALL_M and WALL_GROWTH * now.overlap_m2 < saved_m2
    clean_per_m = _clean_per_m(now.matched_m) if is_of_robots else CLEAN_PER_M
    if (_is_weak(second, clean_per_m) or may_be_a_room) and now.matched_m < WALL_GROWTH * before.matched_m:
        return True
    return _comes_stained(before, second, clean_per_m)


def is_foreseen(guess: Rejection | None, found: Alignment) -> bool:
    """Return whether an alignment was the best place of the search before, which did not suffice yet.

    What has come to it since is what a second look asks for: the wall that chose the place was seen before.
    """
    if guess is None or guess.T_a_b is None or guess.evidence is None:
        return False
    before, now = guess.evidence, found.evidence
    has_grown = FORESEEN_M <= before.matched_m <= now.matched_m / WALL_GROWTH
    is_alone = now.margin >= FORESEEN_LEAD
    return has_grown and is_alone and SAME_PLACE.is_near(guess.T_a_b, found.T_a_b) and not _comes_stained(before, found)


def _is_one_room_again(before: Evidence, now: Evidence) -> bool:
    """Return whether little more is compared than the first time, and that is one room of maps that show several."""
    is_one_room = now.matched_m < LITTLE_WALL_M and now.overlap < ONE_ROOM
    return is_one_room and now.overlap_m2 < WALL_GROWTH * before.overlap_m2


def _clean_per_m(matched_m: float) -> float:
    """Return from which contradiction per agreeing metre two robots' maps need a second look."""
    much = (matched_m - LITTLE_WALL_M) / (MUCH_WALL_M - LITTLE_WALL_M)
    return SPOTLESS_PER_M + (CLEAN_PER_M - SPOTLESS_PER_M) * min(max(much, 0.0), 1.0)


def _comes_stained(before: Evidence, found: Alignment, clean_per_m: float = CLEAN_PER_M) -> bool:
    """Return whether an alignment is weak, and the wall that came to the evidence before contradicts by more."""
    now = found.evidence
    if now.matched_m >= MUCH_WALL_M or not _is_weak(found, clean_per_m):
        return False
    return any(
        new.contradicted_m - old.contradicted_m > clean_per_m * (new.matched_m - old.matched_m)
        for old, new in ((before.a, now.a), (before.b, now.b))
    )


def _is_weak(found: Alignment, clean_per_m: float) -> bool:
    """Return whether an alignment could be a chance fit: little confidence, or little wall with contradiction.

    None is where two parts of large maps were found independently, and scans tie the wholes.
    """
    if found.is_in_parts:
        return False
    wall = found.evidence
    is_stained = wall.matched_m < MUCH_WALL_M and wall.contradicted_per_m > clean_per_m
    return found.confidence < STRONG_CONFIDENCE or is_stained


def lies_elsewhere(believed: Alignment, searched: Alignment | Rejection, *, is_bent: bool = False) -> str | None:
    """Return why a merged pair may lie elsewhere, by a search everywhere after its maps have grown, or None.

    In a house that looks the same turned around, a robot that has seen one half merges; after both halves it finds that
    there are two places. ``is_bent`` : whether both maps are bent to fit each other.
    """
    if isinstance(searched, Alignment):
        return None if CORRECTED.agrees(searched, believed) else "the maps have grown, and fit better elsewhere"
    evidence = searched.evidence
    if evidence is None or evidence.margin >= AMBIGUOUS_MARGIN:
        return None
    if evidence.matched_m < RIVAL_SHARE * believed.evidence.matched_m:
        return None  # bent maps that fit nowhere as a whole: scraps of them fit anywhere
    if is_bent and not searched.ambiguous:
        return None  # they fit nowhere as they are published, and of such places each is as bad as the other
    return f"the maps have grown, and another place fits {1.0 - evidence.margin:.0%} as well"


def refuted(believed: Alignment, outcome: Alignment | Rejection) -> str | None:
    """Return why a merged pair's maps cannot lie as they were merged, by a rejection at that place, or None."""
    if isinstance(outcome, Alignment) or outcome.T_a_b is None or outcome.evidence is None:
        return None
    share = outcome.evidence.contradicted_per_m
    if share <= REFUTED_PER_M or not CORRECTED.is_near(outcome.T_a_b, believed.T_a_b):
        return None
    return f"the maps have grown, and {share / (1.0 + share):.0%} of the walls compared lie where the other map is free"
