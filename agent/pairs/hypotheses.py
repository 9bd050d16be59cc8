"""Where one pair of maps may lie: up to five places, each with what robots saw, or did not see, of each other there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mrslam.agent.known_map import Version
from mrslam.alignment import StabilityCheck
from mrslam.alignment.stability import CORRECTED, SAME_PLACE
from mrslam.mutual_detection import MutualFix, Sightings
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

MOVED = StabilityCheck(max_dx_m=0.15, max_dy_m=0.15, max_dtheta_rad=0.02)
"""A place that is corrected by more is looked at once more: half of what a body may stand beside it, and the same at
6 m."""
MOST = 5
"""Places kept of one pair; the one with the least to say for it makes room for another."""
SUPPORTED_LLR = 6.0
"""A place is supported from here, nats: three independent sightings, 400 to 1."""
LEAD_LLR = 3.0
"""Lead of one place over another from which sightings, and third robots, decide between them, nats: 20 to 1."""
DOUBTED_LLR = -2.0
"""A place is doubted from here, nats: one look in vain where the other should be. Maps alone merge nobody there. Where
robots may be too low for each other's lasers not both together say so much (``MOST_HIDDEN_LLR``)."""
REFUTED_LLR = -4.0
"""A place is refuted from here, nats: 50 to 1 against it, and more than one robot's free sight may say
(``MOST_UNSEEN_LLR``), for one robot may be too low for the other's laser. It counts as wrong from then on."""


@dataclass(eq=False)
class Hypothesis:
    """One place where map b may lie in map a."""

    T_a_b: Transform
    """``(3,)``."""
    by: str
    """Who proposed it: "maps", "sight" (two robots that saw each other), "team" (third robots lie between) or a robot's
    id."""
    proposed_ns: int
    fix: MutualFix | None = None
    """The sightings that propose it, as ``T_a_b``."""
    tried_ns: int | None = None
    """When maps were laid together there because of these sightings."""
    tries: int = 0
    """How often they were, since the place was corrected."""
    tried: tuple[Version, Version] | None = None
    """The two maps that were."""
    own: Sightings | None = None
    """What the own scans say, where the own robot is one of the pair."""
    fitted_m: float = 0.0
    """The most wall that agreed when maps were found to lie here, metres."""
    told: dict[str, float] = field(default_factory=dict)
    """By robot of the pair: what it says that its scans say, nats."""

    @property
    def llr(self) -> float:
        """Return what both robots' scans say, log-likelihood ratio in nats; 0 before they met."""
        return (0.0 if self.own is None else self.own.llr) + sum(self.told.values())

    @property
    def is_supported(self) -> bool:
        """Whether the robots saw each other where this place has them."""
        return self.llr >= SUPPORTED_LLR or (self.fix is not None and self.llr >= 0.0)

    @property
    def is_refuted(self) -> bool:
        """Whether the robots looked at each other's place, and nobody was there."""
        return self.llr <= REFUTED_LLR

    @property
    def is_doubted(self) -> bool:
        """Whether a robot looked in vain where the other should be, and neither saw it there as often."""
        return self.llr <= DOUBTED_LLR

    def correct(self, T_a_b: Transform) -> None:
        """Take a better estimate of the place."""
        if not MOVED.is_near(self.T_a_b, T_a_b):
            self.T_a_b, self.own, self.tried, self.tries = np.array(T_a_b, dtype=np.float64), None, None, 0

    def row(self) -> dict[str, Any]:
        """Return it as plain JSON values."""
        own = Sightings() if self.own is None else self.own
        return {
            "T_a_b": [round(float(value), 3) for value in self.T_a_b],
            "by": self.by,
            "llr": round(self.llr, 1),
            "refuted": self.is_refuted,
            "seen": own.seen,
            "not_there": own.not_there,
        }

    @property
    def words(self) -> str:
        """Where it has map b, for a person."""
        x, y, theta = self.T_a_b
        return f"({x:.1f} m, {y:.1f} m, {np.degrees(theta):.0f} deg)"

    def is_at(self, T_a_b: Transform) -> bool:
        """Return whether a transform is this place, up to corrections."""
        return SAME_PLACE.is_near(self.T_a_b, T_a_b)


class Hypotheses:
    """The places of one pair, in the order in which they were proposed."""

    def __init__(self) -> None:
        self._places: list[Hypothesis] = []

    def __iter__(self) -> Iterator[Hypothesis]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)

    def at(self, T_a_b: Transform) -> Hypothesis | None:
        """Return the one nearest to this transform, None where none is near."""
        near = [one for one in self._places if one.is_at(T_a_b)]
        if len(near) < 2:  # asked for all pairs at every tick
            return near[0] if near else None
        return min(near, key=lambda one: se2.difference(one.T_a_b, T_a_b)[0])

    def add(self, T_a_b: Transform, by: str, now_ns: int) -> Hypothesis | None:
        """Return the one at this transform, made where there is none; None where others say more than nothing."""
        known = self.at(T_a_b)
        if known is not None:
            return known
        if len(self._places) >= MOST:
            # Refuted places must be remembered: the maps would propose them again.
            least = min(self._places, key=lambda one: (abs(one.llr), one.proposed_ns))
            if abs(least.llr) >= SUPPORTED_LLR:
                return None
            self._places.remove(least)
        made = Hypothesis(np.array(T_a_b, dtype=np.float64), by, now_ns)
        self._places.append(made)
        return made

    @property
    def ambiguity(self) -> str | None:
        """Between which two places the pair is undecided, in words; None where fewer are left, or one is supported.

        The places that sightings say most for, or the first proposed of equals.
        """
        left = sorted((one for one in self._places if not one.is_refuted), key=lambda one: -one.llr)
        if len(left) < 2 or left[0].is_supported:
            return None
        return f"ambiguous between {left[0].words} and {left[1].words}"

    @property
    def supported(self) -> Hypothesis | None:
        """The place where the robots saw each other, the best of several; None where there is none.

        Of those where they saw each other as surely, the one where more wall fitted.
        """
        seen = [one for one in self._places if one.is_supported]
        return max(seen, key=lambda one: (one.llr, one.fitted_m), default=None)

    @property
    def misfitted_m(self) -> float:
        """How much wall fitted at wrong places, metres: nobody was there, or the robots saw each other elsewhere.

        Where neither is known of two places that fitted, the one with less wall is wrong: the maps lie in one place.
        """
        left = [one for one in self._places if not one.is_refuted]
        best = self.supported or max(left, key=lambda one: one.fitted_m, default=None)
        return sum(
            one.fitted_m
            for one in self._places
            if one.is_refuted or (best is not None and not CORRECTED.is_near(best.T_a_b, one.T_a_b))
        )

    def ahead_of(self, T_a_b: Transform) -> Hypothesis | None:
        """Return the place where the robots rather saw each other than at this one, None where there is none.

        The best of those that are supported, if no more is said for this one; else the one that is ``LEAD_LLR`` ahead.
        """
        here = self.at(T_a_b)
        best = self.supported or max(self._places, key=lambda one: one.llr, default=None)
        if best is None or CORRECTED.is_near(best.T_a_b, T_a_b):
            return None
        lead = best.llr - (0.0 if here is None else here.llr)
        enough = 0.0 if best.is_supported else LEAD_LLR
        return best if lead >= enough and (best.is_supported or best.llr > 0.0) else None
