"""What teammates claimed of maps that are not here yet, kept until they are.

A robot that comes into reach is told all at once, and holds none of the maps by then. What it missed would be said
again only where it changes, and what changes is not all: a wrong place that gained a sighting, without the right one.
"""

from __future__ import annotations

from collections.abc import Mapping

from mrslam.agent.pairs import hypotheses
from mrslam.alignment.stability import SAME_PLACE
from mrslam.comms import TeammateClaim

MOST = 64
"""Pairs of a teammate and the robot it speaks of that are kept; the oldest makes room."""


class EarlyClaims:
    """The newest claims of each teammate about each other robot whose maps are not here."""

    def __init__(self) -> None:
        """Start with nothing kept."""
        self._kept: dict[tuple[str, str], list[TeammateClaim]] = {}

    def keep(self, claim: TeammateClaim) -> None:
        """Keep a claim; it replaces what the teammate said of that place, and of earlier maps."""
        others = [
            one
            for one in self._kept.pop((claim.peer, claim.robot), ())
            if (one.epoch, one.of_robot) == (claim.epoch, claim.of_robot)
            and not SAME_PLACE.is_near(one.T_peer_robot, claim.T_peer_robot)
        ]
        if len(self._kept) >= MOST:
            del self._kept[next(iter(self._kept))]
        self._kept[claim.peer, claim.robot] = [*others, claim][-hypotheses.MOST :]

    def take(self, epochs: Mapping[str, int]) -> list[TeammateClaim]:
        """Return the claims that are of the maps that are here, by robot their epochs, and keep them no longer."""
        taken = []
        for names, claims in list(self._kept.items()):
            if epochs.keys() >= set(names) and claims[-1].is_of(*(epochs[name] for name in names)):
                taken += self._kept.pop(names)
        return taken
