"""What a robot saw of its teammates, for and against every place of a pair of maps: weighed, told to all, acted on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrslam.agent.early_claims import EarlyClaims
from mrslam.agent.effects import Effect
from mrslam.agent.encounters import Encounters
from mrslam.agent.own_sightings import OwnSightings
from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.pairs.through import misplacing
from mrslam.agent.pairs.weighing import against
from mrslam.agent.team import Team
from mrslam.comms import TeammateClaim, TeammatePose
from mrslam.merge import Pair
from mrslam.merge.graph.edges import inverse_covariance, pair_of, seen_from
from mrslam.mutual_detection import MutualDetectionConfig, MutualFix
from mrslam.mutual_detection.encounters import MOST_SEEN_LLR, MOST_UNSEEN_LLR
from mrslam.spatial import Scan, se2
from mrslam.spatial.se2 import Transform

TELL_NS = 1_000_000_000
"""Least time between two claims about one place, nanoseconds."""
REPEAT_NS = 20_000_000_000
"""A claim is repeated after this time, nanoseconds: beacons are lost. Whoever comes into reach is told at once."""
CHANGED_LLR = 0.9
"""A claim is made again where it has changed by one more sighting, nats."""
IN_CONTACT_NS = 3_000_000_000
"""A teammate whose last report is not older may look for this robot, nanoseconds."""


@dataclass(frozen=True)
class _Told:
    llr: float
    t_ns: int

    def is_outdated_by(self, llr: float, now_ns: int, *, may_repeat: bool) -> bool:
        """Return whether to tell a place's log-likelihood ratio, nats, again."""
        waited_ns, said_llr = now_ns - self.t_ns, self.llr
        if may_repeat and waited_ns >= REPEAT_NS:
            said_llr = 0.0
        return waited_ns >= TELL_NS and abs(llr - said_llr) >= CHANGED_LLR


class Witness:
    """Weighs the places of the own pairs by the own scans, and those of all pairs by what teammates claim."""

    def __init__(self, robot_id: str, config: MutualDetectionConfig) -> None:
        """Start without teammates."""
        self.robot_id = robot_id
        self._encounters = Encounters(config)
        self._sightings = OwnSightings(robot_id, self._encounters)
        self._heard: dict[str, tuple[int, int]] = {}
        """By teammate: when its last report came, nanoseconds, and the epoch of the map it was about."""
        self._told: dict[tuple[str, bytes], _Told] = {}
        self._early = EarlyClaims()

    def on_scan(self, scan: Scan, T_map_base: Transform, now_ns: int) -> None:
        """Take a scan with the beams that end at teammates, and where it was taken in the own map."""
        self._encounters.on_scan(scan, T_map_base, now_ns)

    def forget(self) -> None:
        """Forget all that was seen: the own map was given up."""
        self._encounters.forget()

    def meet(self) -> None:
        """Tell everything again, for somebody came into reach: who is placed by way of others should know, too."""
        self._told.clear()

    def bodies_m(self, team: Team, now_ns: int) -> NDArray[np.float64] | None:
        """Return ``(N, 2)`` bodies to report, base frame; None where every teammate in contact is seen and placed."""
        wanting = [
            peer
            for peer, (heard_ns, _) in self._heard.items()
            if now_ns - heard_ns < IN_CONTACT_NS and not self._is_settled(team, peer)
        ]
        return self._encounters.moving_bodies_m() if wanting else None

    def _is_settled(self, team: Team, peer: str) -> bool:
        """Return whether a teammate was seen where it is placed, by its alignment or by way of others.

        One that was not, though nobody missed it there, may stand somewhere else, in sight.
        """
        belief = team.beliefs.get(pair := pair_of(self.robot_id, peer))
        if belief is None:
            return False
        T_a_b = team.layout.T_between(*pair) if belief.alignment is None else belief.alignment.T_a_b
        place = None if T_a_b is None else belief.places.at(T_a_b)
        return place is not None and place.llr > 0.0

    # -- what comes in -------------------------------------------------------------------------------------------------

    def on_report(self, report: TeammatePose, team: Team, now_ns: int) -> None:
        """Take a teammate's report of where it is, to look for it in the scan of that time."""
        self._heard[report.peer] = (now_ns, report.epoch)
        moment = self._encounters.on_report(report)
        known = team.maps.get(report.peer)
        if moment is None or known is None or known.epoch != report.epoch:
            return
        pair = pair_of(self.robot_id, report.peer)
        belief = team.beliefs.get(pair)
        if belief is None:
            return
        self._sightings.add(report.peer, moment)
        if len(moment.bodies_m) and len(moment.mate_bodies_m):
            self._propose(pair, belief, self._encounters.fix(report.peer), now_ns)

    def on_claim(self, claim: TeammateClaim, team: Team, now_ns: int) -> None:
        """Take what a teammate says of a place of its map and another's."""
        if claim.peer == claim.robot or self.robot_id == claim.peer:
            return
        pair = pair_of(claim.peer, claim.robot)
        belief = team.beliefs.get(pair)
        if belief is None or not claim.is_of(team.maps[claim.peer].epoch, team.maps[claim.robot].epoch):
            self._early.keep(claim)
            return
        place = belief.places.add(seen_from(pair, claim.peer, claim.T_peer_robot), claim.peer, now_ns)
        if place is not None:
            place.told[claim.peer] = min(max(claim.llr, MOST_UNSEEN_LLR), MOST_SEEN_LLR)

    def _propose(self, pair: Pair, belief: PairBelief, fix: MutualFix | None, now_ns: int) -> None:
        """Take a transform that sightings agree on as a place of the pair."""
        if fix is None:
            return
        if self.robot_id != pair[0]:
            T_a_b = se2.inverse(fix.T_map_mate)
            fix = MutualFix(T_a_b, inverse_covariance(fix.T_map_mate, fix.covariance), fix.moments)
        place = belief.places.add(fix.T_map_mate, "sight", now_ns)
        if place is None or (place.fix is not None and place.fix.moments > fix.moments):
            return
        place.fix = fix
        if belief.alignment is None:
            place.correct(fix.T_map_mate)

    # -- what follows --------------------------------------------------------------------------------------------------

    def look(self, team: Team, now_ns: int) -> list[Effect]:
        """Weigh new places by what was seen before, and unmerge pairs of which that speaks against their place."""
        effects: list[Effect] = []
        for claim in self._early.take({name: known.epoch for name, known in team.maps.items()}):
            self.on_claim(claim, team, now_ns)
        self._sightings.weigh(team)
        for pair, belief in team.beliefs.items():
            if belief.alignment is None:
                continue
            belief.places.add(T_a_b := belief.alignment.T_a_b, "maps", now_ns)
            if (objection := against(belief.places, T_a_b)) is not None:
                effects += team.unmerge(pair, objection.words, now_ns)
        return effects or self._look_through(team, now_ns)

    def _look_through(self, team: Team, now_ns: int) -> list[Effect]:
        """Unmerge the weakest alignment between two robots that are placed through others, but not where they are."""
        for pair, belief in team.beliefs.items():
            is_own = self.robot_id in pair
            if belief.alignment is not None or not (is_own or len(belief.places)):  # nobody saw anything
                continue
            if (T_a_b := team.layout.T_between(*pair)) is None:
                continue
            if is_own:
                belief.places.add(T_a_b, "team", now_ns)
            if (wrong := misplacing(pair, T_a_b, team.layout.placement.tree, team.beliefs)) is not None:
                return team.unmerge(*wrong, now_ns)
        return []

    def claims(self, team: Team, now_ns: int) -> list[tuple[str, Transform, float, int]]:
        """Return what is new to tell of the own pairs: teammate, ``T_own_peer (3,)``, nats, epoch of its map.

        Of a teammate that is not here no more than once, until somebody comes into reach (:meth:`meet`); nothing of one
        that reported last from another map than is known of it: it began a new one.
        """
        new, told = [], {}
        for pair, belief in team.beliefs.items():
            if self.robot_id not in pair:
                continue
            peer = pair[1] if pair[0] == self.robot_id else pair[0]
            epoch = team.maps[peer].epoch
            heard_ns, heard_epoch = self._heard.get(peer, (-IN_CONTACT_NS, epoch))
            is_here = now_ns - heard_ns < IN_CONTACT_NS
            for place in belief.places:
                if place.own is None:
                    continue
                key = (peer, place.T_a_b.tobytes())
                told[key] = self._told.get(key, _Told(0.0, -REPEAT_NS))
                is_due = told[key].is_outdated_by(place.own.llr, now_ns, may_repeat=is_here)
                if is_due and heard_epoch == epoch:
                    told[key] = _Told(place.own.llr, now_ns)
                    new.append((peer, seen_from(pair, self.robot_id, place.T_a_b), place.own.llr, epoch))
        self._told = told  # of places that are gone nothing is kept
        return new
