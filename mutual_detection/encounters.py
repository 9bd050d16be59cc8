"""What one robot saw, and did not see, of a teammate that said where it was at the same instant.

For any transform between the two maps it follows where the teammate should have stood in each of these scans: the log
of the likelihood ratio of "the transform is right" over "it is wrong" is added up over independent moments.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mrslam.mutual_detection.sight import NOT_THERE, SEEN, look
from mrslam.spatial import Scan, se2
from mrslam.spatial.se2 import Transform

MOVED_M = 0.3
"""Two moments are independent where one of the robots has moved by this since, metres."""
FOLLOWED_M = 2.0 * MOVED_M
"""A body counts again as the teammate where that has moved by this since, by its own report, metres: twice what a body
may stand beside the place, so that no thing that stands still can be there both times."""
SEEN_LLR = 2.0
"""What a body where the teammate should be says, nats: seen in 6 of 10 moments if it is there (it may be half covered),
and something round stands on a given spot in less than 1 of 10."""
NOT_THERE_LLR = -2.0
"""What free sight of that floor says, nats: one look in vain doubts a place. Of 6571 looks of simulated robots at right
places that were blocked by nothing else none was in vain, of 4497 at wrong ones 4318; real bodies may be of glass."""
MOST_SEEN_LLR = 6.0
"""Bound of what all bodies say: moments are not quite independent."""
MOST_UNSEEN_LLR = -3.0
"""Bound of what free sight says while the teammate was never seen, though every laser of the team should meet
teammates' bodies: one robot in 20 is behind glass, or leans."""
MOST_HIDDEN_LLR = -0.9
"""The same where teammates may be too low for each other's lasers: both robots' together must not make a place doubted,
for of two robots of one kind neither sees the other then."""
MOST_NOT_THERE_LLR = -6.0
"""... and where it was seen some time at the same place."""
MOMENTS_MOST = 100
"""Moments kept of one teammate, for transforms that are proposed later: a minute of driving, 200 kB."""

Others = Callable[["Moment"], NDArray[np.float64]]
"""What tells where other teammates were at a moment, ``(K, 2)``, base frame of the robot that took the scan."""


def nobody(_: Moment) -> NDArray[np.float64]:
    """Return ``(0, 2)`` : of other teammates nothing is known."""
    return np.empty((0, 2))


@dataclass(frozen=True, eq=False)
class Moment:
    """One scan, and where the teammate was when it was taken."""

    scan: Scan
    bodies_m: NDArray[np.float64]
    """``(N, 2)`` bodies in the scan, base frame."""
    T_map_base: Transform
    """``(3,)`` where this robot was in its own map."""
    T_mate_base: Transform
    """``(3,)`` where the teammate was in the teammate's map, as it reported."""
    mate_bodies_m: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    """``(M, 2)`` bodies that the teammate saw then, in its base frame; none where it reported none."""
    others: Mapping[str, tuple[int, Transform]] = field(default_factory=dict)
    """By robot that said where it was then: the epoch of its map, and where it was in it."""

    def place_m(self, T_map_mate: Transform) -> NDArray[np.float64]:
        """Return ``(2,)`` where the teammate should be by ``T_map_mate``, this robot's base frame."""
        T_map_matebase = se2.compose(T_map_mate, self.T_mate_base)
        return se2.between(self.T_map_base, T_map_matebase)[:2]

    def mate_place_m(self, T_map_mate: Transform) -> NDArray[np.float64]:
        """Return ``(2,)`` where this robot should be by ``T_map_mate``, the teammate's base frame."""
        T_map_matebase = se2.compose(T_map_mate, self.T_mate_base)
        return se2.between(T_map_matebase, self.T_map_base)[:2]

    def is_after(self, other: Moment, moved_m: float = MOVED_M) -> bool:
        """Return whether one of the robots has moved by this since the other moment."""
        own, mate = self.T_map_base - other.T_map_base, self.T_mate_base - other.T_mate_base
        return bool(np.hypot(*own[:2]) >= moved_m or np.hypot(*mate[:2]) >= moved_m)


@dataclass
class Sightings:
    """What moments say of one transform."""

    seen: int = 0
    not_there: int = 0
    most_unseen_llr: float = MOST_UNSEEN_LLR
    """Bound of what free sight says while the teammate was never seen."""
    _last: Moment | None = None
    """The last moment in which a body counted."""

    @property
    def llr(self) -> float:
        """Return the log-likelihood ratio, nats; positive for the transform."""
        against = MOST_NOT_THERE_LLR if self.seen else self.most_unseen_llr
        return min(SEEN_LLR * self.seen, MOST_SEEN_LLR) + max(NOT_THERE_LLR * self.not_there, against)

    def take(self, moment: Moment, T_map_mate: Transform, radius_m: float, others_m: Others = nobody) -> None:
        """Count one more moment; ``radius_m`` of the teammate's body. A body that is another teammate says nothing."""
        place_m = moment.place_m(T_map_mate)
        verdict = look(moment.scan, moment.bodies_m, place_m, radius_m)
        if verdict == NOT_THERE:
            self.not_there += 1
        elif verdict == SEEN and not _is_another(moment.bodies_m, place_m, others_m(moment)):
            last = self._last
            if last is None or np.hypot(*(moment.T_mate_base - last.T_mate_base)[:2]) >= FOLLOWED_M:
                self.seen, self._last = self.seen + 1, moment


def _is_another(bodies_m: NDArray[np.float64], place_m: NDArray[np.float64], others_m: NDArray[np.float64]) -> bool:
    """Return whether the body next to a place is one of other teammates, to whose place it is nearer still."""
    apart_m = np.hypot(*(bodies_m - place_m).T)
    nearest_m = np.hypot(*(others_m - bodies_m[apart_m.argmin()]).T).min(initial=np.inf)
    return bool(nearest_m < apart_m.min())


def sightings(
    moments: list[Moment],
    T_map_mate: Transform,
    radius_m: float,
    most_unseen_llr: float = MOST_UNSEEN_LLR,
    others_m: Others = nobody,
) -> Sightings:
    """Return what all these moments say of a transform from the teammate's map to the own one."""
    found = Sightings(most_unseen_llr=most_unseen_llr)
    for moment in moments:
        found.take(moment, T_map_mate, radius_m, others_m)
    return found
