"""Hints: where teammates found maps to lie, told to each other so that few have to search; each hearer looks itself.

Hints travel, conclusions do not: a hint is a place to examine, which costs a tenth of a search. Only where the maps fit
there, and no other alignments lead there, are they searched for other places where they fit as well. A hint that fails
changes nothing but its teller's credit.

Of a robot's place in a saved map the teller knows more than the maps show: it watched its map grow there, or tracks its
pose there and maps no more. So it tells what it believes only, which counts as the first of the two looks that agree.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from mrslam.agent.config import AgentConfig
from mrslam.agent.effects import AlignJob
from mrslam.agent.known_map import KnownMap
from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.pairs.others import is_predicted, tied_enough
from mrslam.agent.pairs.schedule import PATIENCE_S, PRIOR_COVARIANCE
from mrslam.alignment import Alignment, Prior, Rejection
from mrslam.alignment.stability import SAME_PLACE
from mrslam.comms import TeammateHint, is_saved
from mrslam.merge import Pair
from mrslam.merge.graph.edges import pair_of, seen_from
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

TIMES, REPEAT_NS = 2, 20_000_000_000
"""How often a hint is told, and the time between, nanoseconds: beacons are lost, one in five on a link that just counts
as strong; both of two robots tell of their pair."""
MOST_FAILED = 3
"""Hints of one teammate that may fail in a row before no more of them are tried: an honest one's fail where the hearer
holds older maps. A search that finds the maps where it has them restores its credit."""
MOST_HINTS = 64
"""Hints kept of one teammate; bounds memory alone."""
NOTHING_TRACKED: Mapping[str, Transform] = MappingProxyType({})


@dataclass(eq=False)
class _Told:
    T_own_robot: Transform
    t_ns: int
    times: int = 1


@dataclass(eq=False)
class _Heard:
    epoch: int
    T_peer_robot: Transform
    tried_ns: int | None = None
    area_m2: tuple[float, float] = (0.0, 0.0)
    """Known areas of the two maps when it was tried, square metres."""

    def says(self, hint: TeammateHint) -> bool:
        """Return whether a hint says the same once more."""
        return self.epoch == hint.epoch and SAME_PLACE.is_near(self.T_peer_robot, hint.T_peer_robot)


class Hints:
    """What to tell teammates of the own pairs, and what they told."""

    def __init__(self, own_id: str) -> None:
        """Start with nothing told and nothing heard."""
        self.own_id = own_id
        self._told: dict[str, _Told] = {}
        self._heard: dict[str, dict[str, _Heard]] = {}
        self._failed: dict[str, int] = {}
        """By teammate: its hints that failed, since the last one that did not."""
        self._left: dict[Pair, int] = {}
        """By pair of two others that was never tried: since when it is due, and left to them."""

    # -- telling -------------------------------------------------------------------------------------------------------

    def news(
        self, beliefs: Mapping[Pair, PairBelief], now_ns: int, tracked: Mapping[str, Transform] = NOTHING_TRACKED
    ) -> list[tuple[str, Transform]]:
        """Return what is new to tell: robot or saved map, ``T_own_robot (3,)``; found since, or found elsewhere.

        ``tracked`` : by saved map in which the robot tracks its pose: ``T_own_saved (3,)``.
        """
        new = []
        for robot, T_own_robot in (dict(self._found(beliefs)) | dict(tracked)).items():
            told = self._told.get(robot)
            if told is None or not SAME_PLACE.is_near(told.T_own_robot, T_own_robot):
                self._told[robot] = _Told(T_own_robot, now_ns)
            elif told.times < TIMES and now_ns - told.t_ns >= REPEAT_NS:
                told.t_ns, told.times = now_ns, told.times + 1
            else:
                continue
            new.append((robot, T_own_robot))
        return new

    def _found(self, beliefs: Mapping[Pair, PairBelief]) -> Iterator[tuple[str, Transform]]:
        for (a, b), belief in beliefs.items():
            found = belief.alignment if any(map(is_saved, (a, b))) else belief.found
            if found is not None and self.own_id in (a, b):
                yield (b, found.T_a_b) if a == self.own_id else (a, se2.inverse(found.T_a_b))

    def meet(self, sought: Collection[str] | None = None) -> None:
        """Tell everything again, for somebody came into reach; of ``sought``, whom it has not placed, where it says."""
        for robot, told in self._told.items():
            if sought is None or robot in sought:
                told.times = 0

    # -- hearing -------------------------------------------------------------------------------------------------------

    def hear(self, hint: TeammateHint) -> None:
        """Take a hint; it is tried once the maps it is about are here."""
        if hint.peer == self.own_id or hint.peer == hint.robot:
            return
        hints = self._heard.setdefault(hint.peer, {})
        known = hints.get(hint.robot)
        if known is not None and known.says(hint):
            return
        hints.pop(hint.robot, None)
        if len(hints) >= MOST_HINTS:
            del hints[next(iter(hints))]
        hints[hint.robot] = _Heard(hint.epoch, hint.T_peer_robot)

    def is_awaited(self, pair: Pair, belief: PairBelief, searching: Collection[str], now_ns: int) -> bool:
        """Return whether a pair that is due is left to a robot of it for now: what it finds it will tell.

        ``searching`` : teammates in sight that search for the pairs of their own maps. Both hold nearly the same maps.
        Of the own pairs these are the other robot's if it is the first by id, once a try here found nothing. One whose
        hint failed is not relied on, and who tells nothing for ``PATIENCE_S`` is waited for no longer.
        """
        last_ns = None if belief.last is None else belief.last.t_ns
        is_own = self.own_id in pair
        if last_ns is None and not is_own:
            last_ns = self._left.setdefault(pair, now_ns)
        tellers = pair[:1] if is_own else pair
        is_told = any(name in searching and name not in self._failed for name in tellers)
        return is_told and last_ns is not None and now_ns - last_ns < PATIENCE_S * 1e9 and belief.found is None

    def forget(self, robot_id: str) -> None:
        """Forget what concerns a robot that began another map."""
        self._heard.pop(robot_id, None)
        for hints in self._heard.values():
            hints.pop(robot_id, None)
        self._left = {pair: since_ns for pair, since_ns in self._left.items() if robot_id not in pair}
        if robot_id == self.own_id:
            self._told.clear()

    def next_job(
        self,
        beliefs: Mapping[Pair, PairBelief],
        maps: Mapping[str, KnownMap],
        T_team_map: Mapping[str, Transform],
        config: AgentConfig,
        now_ns: int,
    ) -> AlignJob | None:
        """Return a pair to examine where a teammate has it, None where there is none.

        A hint that failed is tried again as the maps grow.
        """
        tied = tied_enough(self.own_id, beliefs, T_team_map)
        for peer, hints in self._heard.items():
            if self._failed.get(peer, 0) >= MOST_FAILED or peer not in maps:
                continue
            for robot, hint in hints.items():
                if robot not in maps or hint.epoch != maps[peer].epoch:
                    continue
                pair = pair_of(peer, robot)
                belief = beliefs[pair]
                found = belief.alignment if is_saved(robot) else belief.found
                if found is not None or (peer in tied and robot in tied):
                    continue
                a, b = (maps[name] for name in pair)
                areas = (a.area_m2, b.area_m2)
                if not _is_due(hint, areas, config, now_ns):
                    continue
                hint.tried_ns, hint.area_m2 = now_ns, areas
                place = seen_from(pair, peer, hint.T_peer_robot)
                prior = Prior(place, PRIOR_COVARIANCE) if is_predicted(pair, place, T_team_map) else None
                return AlignJob(
                    *pair, a.grid, b.grid, prior, (a.version, b.version), areas, belief.attempts, (a.trail, b.trail),
                    place=place, hinted_by=peer, by_parts=True,
                )  # fmt: skip
        return None

    def on_done(self, job: AlignJob, outcome: Alignment | Rejection) -> None:
        """Count whose hints hold: those that were tried, and those that a search has found without them."""
        if job.hinted_by is not None and not outcome.accepted:
            self._failed[job.hinted_by] = self._failed.get(job.hinted_by, 0) + 1
        if outcome.T_a_b is None or not outcome.accepted:
            return
        for peer, robot, T in ((job.a, job.b, outcome.T_a_b), (job.b, job.a, se2.inverse(outcome.T_a_b))):
            hint = self._heard.get(peer, {}).get(robot)
            if hint is not None and SAME_PLACE.is_near(hint.T_peer_robot, T):
                self._failed.pop(peer, None)


def _is_due(hint: _Heard, areas: tuple[float, float], config: AgentConfig, now_ns: int) -> bool:
    if hint.tried_ns is None:
        return True
    grown = any(now >= (1.0 + config.align_growth) * before for now, before in zip(areas, hint.area_m2, strict=True))
    return grown and now_ns - hint.tried_ns >= config.align_interval_s * 1e9
