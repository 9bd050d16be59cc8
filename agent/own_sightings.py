"""What the own scans say of every place of the own pairs, weighed as moments come and teammates are placed.

A body may be any robot. One that a placed teammate's own report explains speaks for no place of another one.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from mrslam.agent.encounters import Encounters
from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.pairs.hypotheses import Hypothesis
from mrslam.agent.team import Team
from mrslam.merge import Pair
from mrslam.merge.graph.edges import pair_of, seen_from
from mrslam.mutual_detection import Moment, sightings
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform


class OwnSightings:
    """Keeps the moments that were not weighed yet, and who was placed when bodies were weighed last."""

    def __init__(self, robot_id: str, encounters: Encounters) -> None:
        """Start without moments; ``encounters`` : those kept for places that are proposed later."""
        self.robot_id = robot_id
        self._encounters = encounters
        self._fresh: list[tuple[str, Moment]] = []
        """Each with its teammate; they wait for the next look, till when others tell where they were then."""
        self._placed: frozenset[tuple[str, int]] = frozenset()
        """Teammates with the epochs of their maps."""

    def add(self, peer: str, moment: Moment) -> None:
        """Take a moment of a teammate."""
        self._fresh.append((peer, moment))

    def weigh(self, team: Team) -> None:
        """Weigh the places of the own pairs by what came since: moments, teammates that were placed, places."""
        for peer, moment in self._fresh:
            pair = pair_of(self.robot_id, peer)
            if (belief := team.beliefs.get(pair)) is not None:  # else its map contradicts itself by now
                self._weigh_fresh(team, peer, moment, pair, belief)
        self._fresh.clear()
        own = {pair: belief for pair, belief in team.beliefs.items() if self.robot_id in pair}
        if self._is_somebody_placed(team):
            for belief in own.values():
                _forget_bodies(belief)
        for pair, belief in own.items():
            self._weigh_new(team, pair, belief)

    def _weigh_fresh(self, team: Team, peer: str, moment: Moment, pair: Pair, belief: PairBelief) -> None:
        for place in belief.places:
            if place.own is not None:
                T_own_peer = self._now(team, peer, pair, belief, place)
                place.own.take(moment, T_own_peer, self._encounters.radius_m, partial(_others_m, team, peer))

    def _weigh_new(self, team: Team, pair: Pair, belief: PairBelief) -> None:
        peer = pair[1] if pair[0] == self.robot_id else pair[0]
        moments: list[Moment] | None = None
        for place in belief.places:
            if place.own is None:
                moments = self._encounters.moments(peer, team.maps[peer].epoch) if moments is None else moments
                T_own_peer = self._as_proposed(pair, place)
                radius_m, unseen_llr = self._encounters.radius_m, self._encounters.most_unseen_llr
                others_m = partial(_others_m, team, peer)
                place.own = sightings(moments, T_own_peer, radius_m, unseen_llr, others_m)

    def _is_somebody_placed(self, team: Team) -> bool:
        """Return whether a teammate was placed since the last look: it may be a body that was seen."""
        places = {name: team.layout.T_own_map(name) for name in team.maps.keys() - team.saved - {self.robot_id}}
        before = self._placed
        self._placed = frozenset((name, team.maps[name].epoch) for name, T in places.items() if T is not None)
        return not self._placed <= before

    def _now(self, team: Team, peer: str, pair: Pair, belief: PairBelief, place: Hypothesis) -> Transform:
        """Return where the teammate's map lies in the own one by a place: near the robots, where maps are bent."""
        T_now = team.layout.T_own_map(peer)
        if T_now is not None and belief.alignment is not None and place.is_at(belief.alignment.T_a_b):
            return T_now
        return self._as_proposed(pair, place)

    def _as_proposed(self, pair: Pair, place: Hypothesis) -> Transform:
        return seen_from(pair, self.robot_id, place.T_a_b)


def _forget_bodies(belief: PairBelief) -> None:
    """Have the places of a pair where bodies were seen weighed anew."""
    for place in belief.places:
        if place.own is not None and place.own.seen:
            place.own = None


def _others_m(team: Team, peer: str, moment: Moment) -> NDArray[np.float64]:
    """Return ``(K, 2)`` where teammates that are placed, but for one, were at a moment, base frame."""
    found = []
    for name, (epoch, T_map_base) in moment.others.items():
        T_own_map = None if name == peer else team.layout.T_own_map(name)
        if T_own_map is not None and team.maps[name].epoch == epoch:
            found.append(se2.between(moment.T_map_base, se2.compose(T_own_map, T_map_base))[:2])
    return np.reshape(found, (-1, 2))
