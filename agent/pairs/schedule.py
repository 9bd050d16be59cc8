"""Which pair of maps is aligned next."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping

import numpy as np

from mrslam.agent.config import AgentConfig
from mrslam.agent.effects import AlignJob
from mrslam.agent.known_map import KnownMap
from mrslam.agent.pairs.belief import UNCONFIRMED, WEAK, PairBelief
from mrslam.agent.pairs.others import is_left_to_others, is_predicted, tied_enough
from mrslam.agent.pairs.second_look import WALL_GROWTH
from mrslam.agent.pairs.starts import Starts
from mrslam.alignment import EXHAUSTIVE, Prior
from mrslam.comms import is_saved
from mrslam.merge import Pair
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

PRIOR_COVARIANCE = np.diag([0.5**2, 0.5**2, 0.1**2])
"""Covariance of a merged pair's transform, m^2 and rad^2: corrections of both maps may have moved it since. Its
standard deviations are the limits within which two estimates confirm each other (``StabilityCheck``)."""


PATIENT_AFTER, PATIENCE_S = 6, 90.0
"""Tries of a pair that is not merged after which both of its maps must have grown (by ``agent.realign_growth``, in the
mean), or one of them and the second have passed, seconds: pairs that lie far apart are searched less often. Pairs of
two others wait so from the first try on. Pairs that a teammate in sight searches for as well wait that long in any
case.
Measured over 114 merges of missions with faults: half came with the 3rd try, nine in ten by the 6th, the last with the
9th."""
FEW = 5
"""Maps not found in the own one that are all searched for again when it has grown by ``agent.align_growth``. Where more
are not, it must have grown by as much more, or ``PATIENCE_S`` have passed: what searches cost follows what robots map,
not how many they are (docs/experiments.md)."""
CONFIRMED_GROWTH = 1.0
"""Growth of a map that the joint solution ties to another, by its own scans, after which both are searched for another
place, where that is more than ``agent.realign_growth``: twice what it was. Walls that come to contradict the place are
noticed at once, not by searching."""
CONFIRMING_SHARE = 0.2
"""Of ``agent.align_growth``, after which the place found once in a saved map is looked at again: a look costs next to
nothing there, and how much more wall a second one must show does not depend on when it is made."""
PARTS_EVERY = 3
"""Of the searches of two large maps one in so many looks at parts as well, which takes three times as long."""
LAST_LOOK_S = 3.0 * PATIENCE_S
"""The own map's pairs that are not merged are searched for again after this time, seconds, in parts as well, however
little their maps have grown: with what large ones show last they grow by less than ``agent.align_growth``."""
EVERYWHERE_EVERY = 4
"""One in this many tries of two robots with known starts looks everywhere: a start may be wrong, or of an earlier map.
In a saved map that is every second one, at once after the first: as soon as without a hint, however wrong that is."""


class Schedule:
    """Chooses from beliefs and maps passed in; it has no state but where maps are said to begin."""

    def __init__(self, own_id: str, config: AgentConfig) -> None:
        """Take the robot's id, whose own map comes first, and how often pairs are tried again."""
        self.own_id, self.config = own_id, config
        self.starts = Starts(own_id, config)

    def next_job(
        self,
        beliefs: Mapping[Pair, PairBelief],
        maps: Mapping[str, KnownMap],
        T_team_map: Mapping[str, Transform],
        confirmed: Collection[Pair],
        is_awaited: Callable[[Pair, PairBelief], bool],
        now_ns: int,
    ) -> AlignJob | None:
        """Return the pair most worth aligning: the own map's first, then untried ones, then the longest waiting.

        ``confirmed`` : merged pairs whose alignment the joint solution confirms; it follows their maps itself.
        ``is_awaited`` : whether a pair that is due is left to a teammate who searches for it and tells what it finds.
        """
        may_wait = self.config.align_method == EXHAUSTIVE  # else a second search is independent evidence
        tied = tied_enough(self.own_id, beliefs, T_team_map)
        growth = self.config.align_growth * max(1.0, self._sought(beliefs) / FEW)
        due = [
            (self._rank(pair, belief), pair)
            for pair, belief in beliefs.items()
            if self._is_due(pair, belief, (maps[pair[0]], maps[pair[1]]), tied, pair in confirmed, growth, now_ns)
            and not (belief.alignment is None and tied.issuperset(pair))
            and not is_left_to_others(self.own_id, pair, beliefs, T_team_map, now_ns)
            and not (may_wait and is_awaited(pair, belief))
        ]
        if not due:
            return None
        a, b = min(due)[1]
        belief, map_a, map_b = beliefs[a, b], maps[a], maps[b]
        prior = place = None
        if belief.alignment is None:
            prior = self._where_they_started((a, b), belief)
            place = self._just_found((a, b), belief, (map_a, map_b), T_team_map)
        elif self._may_follow((a, b), belief, (map_a, map_b), tied) and a in T_team_map and b in T_team_map:
            place = se2.between(T_team_map[a], T_team_map[b])
        if place is not None:
            prior = Prior(place, PRIOR_COVARIANCE)
        versions, areas = (map_a.version, map_b.version), (map_a.area_m2, map_b.area_m2)
        trails = (map_a.trail, map_b.trail)
        saved = [maps[name] for name in (a, b) if is_saved(name)]
        searched = saved[0] if len(saved) == 1 and prior is None else None
        grids, tries = (map_a.grid, map_b.grid), belief.attempts
        # Once merged, parts fit metres beside the whole.
        by_parts = belief.alignment is None and self._is_turn_of_parts((a, b), belief, now_ns)
        return AlignJob(
            a, b, *grids, prior, versions, areas, tries, trails, place=place, by_parts=by_parts,
            searched=searched, is_believed=belief.alignment is not None,
        )  # fmt: skip

    def _is_turn_of_parts(self, pair: Pair, belief: PairBelief, now_ns: int) -> bool:
        """Return whether a pair that is not merged is looked at in parts this time: always to confirm a find of parts.

        Where others' maps lie they search themselves, and tell.
        """
        if belief.found is not None:
            return self.own_id in pair or belief.found.is_in_parts
        return self.own_id in pair and (belief.attempts % PARTS_EVERY == 0 or _is_last_look(belief, now_ns))

    def _just_found(
        self, pair: Pair, belief: PairBelief, maps: tuple[KnownMap, KnownMap], T_team_map: Mapping[str, Transform]
    ) -> Transform | None:
        """Return where a pair was found that is to be confirmed, if a search would hardly find another place now."""
        found = belief.stability.previous
        if found is None or belief.reason not in (UNCONFIRMED, WEAK):
            return None
        is_random = self.config.align_method != EXHAUSTIVE  # a second search is independent evidence then
        has_grown = _grown(maps, belief.search.area_m2, self.config.align_growth)
        is_searched = belief.search.accepted and not is_random and not has_grown
        return found.T_a_b if is_searched or is_predicted(pair, found.T_a_b, T_team_map) else None

    def _where_they_started(self, pair: Pair, belief: PairBelief) -> Prior | None:
        """Return where to look for a pair that is not merged: by its starts, or None for everywhere.

        What a search everywhere has found is confirmed by another.
        """
        if self._seeks_place(pair, belief):
            is_turn = belief.last is not None and belief.last.is_told
        else:
            is_turn = belief.attempts % EVERYWHERE_EVERY == EVERYWHERE_EVERY - 1
        return None if belief.search.accepted or is_turn else self.starts.prior(pair)

    def _sought(self, beliefs: Mapping[Pair, PairBelief]) -> int:
        """Return the number of robots' maps that are not found in the own one."""
        return sum(
            belief.found is None and self.own_id in pair and not any(is_saved(map_id) for map_id in pair)
            for pair, belief in beliefs.items()
        )

    def _rank(self, pair: Pair, belief: PairBelief) -> tuple[int, int, int]:
        tried = -1 if belief.last is None else belief.last.t_ns
        return (0 if self.own_id in pair else 1, 0 if belief.last is None else 1, tried)

    def _is_due(
        self,
        pair: Pair,
        belief: PairBelief,
        maps: tuple[KnownMap, KnownMap],
        tied: Collection[str],
        is_confirmed: bool,
        growth: float,
        now_ns: int,
    ) -> bool:
        last = belief.last
        if last is None:
            return True
        if self._seeks_place(pair, belief):
            looks_on = last.is_told and belief.stability.previous is None
            growth = self.config.align_growth * (1.0 if belief.stability.previous is None else CONFIRMING_SHARE)
            if looks_on or _grown(maps, last.area_m2, growth):
                return True
        waited_ns = now_ns - last.t_ns
        if waited_ns < self.config.align_interval_s * 1e9:
            return False
        if belief.reason == UNCONFIRMED:
            return True
        if last.versions == (maps[0].version, maps[1].version):
            return False
        if belief.alignment is None:
            if self.own_id in pair and _is_last_look(belief, now_ns):
                return True
            has_waited = waited_ns >= PATIENCE_S * 1e9
            is_eager = has_waited or (self.own_id in pair and belief.attempts < PATIENT_AFTER)
            growth = self.config.align_growth if has_waited else growth
            return self._is_worth_a_search(belief, maps, growth, is_eager=is_eager, has_waited=has_waited)
        is_old = waited_ns / 1e9 >= self.config.realign_interval_s and not is_confirmed
        if is_old or not self._outgrown(belief, maps, CONFIRMED_GROWTH if is_confirmed else 0.0):
            return is_old
        return not _is_settled(pair, belief, tied) or _grown(maps, last.area_m2, self.config.realign_growth)

    def _seeks_place(self, pair: Pair, belief: PairBelief) -> bool:
        """Return whether the own map's place in a saved one is sought, which waits for growth alone.

        That one does not grow: there are 24 searches until the own map is ten times as large.
        """
        return belief.alignment is None and self.own_id in pair and any(is_saved(map_id) for map_id in pair)

    def _is_worth_a_search(
        self, belief: PairBelief, maps: tuple[KnownMap, KnownMap], growth: float, *, is_eager: bool, has_waited: bool
    ) -> bool:
        """Return whether the maps of a pair that is not merged have grown enough, by ``growth``, since its last try."""
        last_m2 = (0.0, 0.0) if belief.last is None else belief.last.area_m2
        if belief.reason == WEAK:
            return has_waited or (_may_confirm(belief, maps, last_m2) and _grown(maps, last_m2, growth))
        if is_eager:
            return _grown(maps, last_m2, growth)
        both = math.prod(one.area_m2 / max(area, 1e-9) for one, area in zip(maps, last_m2, strict=True))
        return both >= (1.0 + self.config.realign_growth) ** 2

    def _may_follow(
        self, pair: Pair, belief: PairBelief, maps: tuple[KnownMap, KnownMap], tied: Collection[str]
    ) -> bool:
        """Return whether a prior where the pair was found is enough, which is cheap; else everything is searched."""
        if belief.alignment is None:
            return False
        if (belief.search.accepted and not self._outgrown(belief, maps)) or _is_settled(pair, belief, tied):
            return True
        return self.starts.say(pair, belief.alignment.T_a_b)

    def _outgrown(self, belief: PairBelief, maps: tuple[KnownMap, KnownMap], least: float = 0.0) -> bool:
        """Return whether a merged pair's maps have grown so much since the last search that another place may fit.

        ``least`` : growth that is needed in any case once a search has found the pair.
        """
        found = belief.search.accepted
        growth = max(self.config.realign_growth, least) if found else self.config.align_growth
        return _grown(maps, belief.search.area_m2, growth)


def _is_last_look(belief: PairBelief, now_ns: int) -> bool:
    """Return whether a pair was not looked at for so long that it is now, however little has changed."""
    return belief.last is not None and now_ns - belief.last.t_ns >= LAST_LOOK_S * 1e9


def _may_confirm(belief: PairBelief, maps: tuple[KnownMap, KnownMap], before_m2: tuple[float, float]) -> bool:
    """Return whether a weak find may show the wall that confirms it, now that its maps have grown.

    ``WALL_GROWTH`` is asked of the wall in common. So what both maps have gained is held against the ground in common
    then, not against the maps: large ones that share a part of it bring enough long before either has grown by that.
    """
    found = belief.stability.previous
    common_m2 = 0.0 if found is None else found.evidence.overlap_m2
    gained_m2 = sum(max(one.area_m2 - area, 0.0) for one, area in zip(maps, before_m2, strict=True))
    return gained_m2 >= (WALL_GROWTH - 1.0) * common_m2


def _is_settled(pair: Pair, belief: PairBelief, tied: Collection[str]) -> bool:
    """Return whether no search would change what is believed of a merged pair: loops or the robots' eyes hold it."""
    return all(name in tied for name in pair) or belief.is_seen


def _grown(maps: tuple[KnownMap, KnownMap], before_m2: tuple[float, float], share: float) -> bool:
    return any(one.area_m2 >= (1.0 + share) * area for one, area in zip(maps, before_m2, strict=True))
