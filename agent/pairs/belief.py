"""The belief about one pair of maps: the only place where its alignment, or the reason why there is none, is kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from mrslam.agent.effects import AlignJob
from mrslam.agent.known_map import Version
from mrslam.agent.pairs.hypotheses import Hypotheses, Hypothesis
from mrslam.agent.pairs.loops import Loop
from mrslam.agent.pairs.second_look import is_echo, is_foreseen, lies_elsewhere, refuted
from mrslam.agent.pairs.weighing import agrees, by_sight, is_worth_keeping, weighed
from mrslam.alignment import Alignment, Rejection, StabilityCheck
from mrslam.merge.graph.consistency import SEEN_CONFIDENCE
from mrslam.spatial.se2 import Transform

Status = Literal["untried", "accepted", "rejected", "revoked"]
UNCONFIRMED = "found once; a second alignment that agrees is awaited"
"""Reason of a pair that ``Schedule`` tries again after ``align_interval_s`` even if its maps have not changed."""
BARREN = 0.1
"""Wall that agrees where two maps fit best, for each square metre of the smaller one, below which they have nothing in
common, 1/m. Measured from 40 m2 on: 0.14 and more in ten robots of intel whose place is in the saved map; in ten whose
map is another building's less than 0.1 in four searches of five (38 of 47), and up to 0.24 by chance in the others."""
WEAK = "found again, but on evidence that has not grown since"
"""Reason of a pair whose second alignment repeats a weak first one, or any in a saved map."""


@dataclass(frozen=True)
class Attempt:
    """When a pair was aligned last, and what its maps were then."""

    t_ns: int
    versions: tuple[Version, Version]
    area_m2: tuple[float, float]
    """Known areas of the two maps, square metres."""
    is_told: bool
    """Whether it looked only near where somebody told that the maps lie."""


@dataclass(frozen=True)
class Search:
    """The last alignment of a pair without a prior, which searches all transforms."""

    area_m2: tuple[float, float] = (0.0, 0.0)
    """Known areas of the two maps then, square metres."""
    accepted: bool = False
    guess: Rejection | None = None
    """What it said where it found no place that suffices."""
    barren: int = 0
    """Number of searches up to this one, without a break, that found next to no wall in common (:data:`BARREN`)."""

    def then(self, job: AlignJob, outcome: Alignment | Rejection) -> Search:
        """Return the next search."""
        matched_m = 0.0 if outcome.evidence is None else outcome.evidence.matched_m
        is_barren = not outcome.accepted and matched_m < BARREN * min(job.area_m2)
        guess = None if isinstance(outcome, Alignment) else outcome
        return Search(job.area_m2, outcome.accepted, guess, self.barren + 1 if is_barren else 0)


@dataclass(frozen=True)
class Verdict:
    """What one more alignment of a pair changed."""

    status: Status
    """One of "accepted", "rejected" and "revoked"."""
    reason: str
    outcome: Alignment | Rejection
    """The alignment's own result, whatever the pair's history made of it."""
    believed: Alignment | None = None
    """Where the status is "accepted": the transform to use, which may be an earlier and better one."""
    is_new: bool = False
    """Whether the pair was not merged before."""

    def fields(self) -> dict[str, Any]:
        """Return it as plain JSON values."""
        evidence = self.outcome.evidence
        return {
            "status": self.status,
            "reason": self.reason,
            "T_a_b": None if self.believed is None else [float(value) for value in self.believed.T_a_b],
            "confidence": float(self.outcome.confidence),
            "method": self.outcome.method,
            "evidence": {} if evidence is None else {name: round(v, 4) for name, v in evidence.as_row().items()},
        }


@dataclass
class PairBelief:
    """The alignment ``T_a_b`` believed of one pair of maps, if any, and what led to it."""

    status: Status = "untried"
    reason: str = "not tried yet"
    attempts: int = 0
    """Number of alignments of the pair so far."""
    accepted_at_ns: int | None = None
    stability: StabilityCheck = field(default_factory=StabilityCheck)
    """Holds the alignment believed, and the previous one that a next must agree with."""
    last: Attempt | None = None
    """The last alignment since the robot started; a checkpoint does not keep it."""
    places: Hypotheses = field(default_factory=Hypotheses)
    """Where the maps may lie; a checkpoint does not keep them, for what was seen may be of an earlier state of maps."""
    search: Search = Search()
    """A checkpoint does not keep it, either: a resumed robot searches every merged pair once more."""

    @property
    def alignment(self) -> Alignment | None:
        """The transform believed; None while none is."""
        return self.stability.believed

    @property
    def found(self) -> Alignment | None:
        """The transform believed, or else the one found that waits to be confirmed."""
        return self.alignment or self.stability.previous

    @property
    def is_seen(self) -> bool:
        """Whether the robots saw each other where the transform believed has them: what else fits, fits as well."""
        return self.alignment is not None and self._is_seen_at(self.alignment.T_a_b)

    def _is_seen_at(self, T_a_b: Transform) -> bool:
        place = self.places.at(T_a_b)
        return place is not None and place.is_supported

    @property
    def weighed_alignment(self) -> Alignment | None:
        """The transform believed, certain where the robots saw each other there: loops that fail drop others first."""
        return None if self.alignment is None else self.as_weighed(self.alignment)

    def as_weighed(self, found: Alignment) -> Alignment:
        """Return an alignment of the pair as :attr:`weighed_alignment` would be if it were believed."""
        if not self._is_seen_at(found.T_a_b):
            return found
        return replace(found, confidence=max(found.confidence, SEEN_CONFIDENCE))

    def settle(
        self,
        job: AlignJob,
        outcome: Alignment | Rejection,
        now_ns: int,
        loops: Sequence[Loop],
        unless: Callable[[Alignment | Rejection], Alignment | Rejection],
        *,
        is_bent: bool = False,
    ) -> Verdict:
        """Take one more alignment of the pair, and return what it changed; ``loops`` : where third robots have it.

        ``unless`` : refuses alignments for what is believed of other pairs; asked when it is known what the robots of
        this one saw of each other there. ``is_bent`` : whether a joint solution bends both maps. They are compared as
        they are bent then; that they do not fit rigidly says nothing.
        """
        self.attempts += 1
        self.last = Attempt(now_ns, job.versions, job.area_m2, job.is_told)
        guess = self.search.guess if self.alignment is None and job.saved_m2 is not None else None
        by_encounters = self._by_encounters(job, outcome, now_ns, loops)
        vetted = unless(by_encounters)
        if job.prior is None:  # what other pairs refuse was not found
            self.search = self.search.then(job, outcome if vetted is by_encounters else vetted)
        outcome = vetted
        if reason := self._unmerged_by(outcome, searched=job.prior is None, is_bent=is_bent):
            self.revoke(reason)
            return Verdict("revoked", reason, outcome)
        if isinstance(outcome, Rejection):
            self.stability.previous = self.stability.believed
            return self._rejected(outcome.reason, outcome)
        place = self.places.add(outcome.T_a_b, "maps", now_ns)
        if place is not None and place.is_supported:
            self._believe_at_once(outcome, place)
        elif job.is_vouched or is_foreseen(guess, outcome):
            self.stability.previous = outcome
        elif self.alignment is None and is_echo(
            self.stability, outcome, saved_m2=job.saved_m2, is_of_robots=job.is_of_robots
        ):
            return self._rejected(WEAK, outcome)
        believed = self.stability.update(outcome)
        if believed is None:
            return self._rejected(UNCONFIRMED, outcome)
        is_new = self.status != "accepted"
        if is_new:
            self.accepted_at_ns = now_ns
        self.status, self.reason = "accepted", "accepted"
        return Verdict("accepted", "accepted", outcome, believed, is_new)

    def note(self, outcome: Alignment | Rejection, now_ns: int) -> None:
        """Keep how much wall agrees where maps were found to lie."""
        if isinstance(outcome, Alignment) and (place := self.places.add(outcome.T_a_b, "maps", now_ns)) is not None:
            place.fitted_m = max(place.fitted_m, outcome.evidence.matched_m)

    def _by_encounters(
        self, job: AlignJob, outcome: Alignment | Rejection, now_ns: int, loops: Sequence[Loop]
    ) -> Alignment | Rejection:
        """Return the outcome as encounters leave it; a place that two robots' sight proposed needs no walls."""
        if outcome.T_a_b is not None and is_worth_keeping(outcome):
            self.places.add(outcome.T_a_b, "maps", now_ns)
        for rival in outcome.rivals if isinstance(outcome, Rejection) else ():
            self.places.add(rival, "maps", now_ns)
        seen = None if job.sighted is None else self.places.at(job.sighted)
        if seen is not None and isinstance(outcome, Rejection) and agrees(outcome.evidence) and not seen.is_refuted:
            outcome = by_sight(seen, outcome)
        return weighed(self.places, outcome, loops)

    def _believe_at_once(self, outcome: Alignment, place: Hypothesis) -> None:
        """Let a place where the robots saw each other need no second alignment, and replace any other."""
        if self.alignment is not None and not place.is_at(self.alignment.T_a_b):
            self.stability.contradicted()
        if self.alignment is None:
            self.stability.previous = outcome
        place.correct(outcome.T_a_b)

    def revoke(self, reason: str) -> None:
        """Withdraw the alignment, for it was contradicted. The pair is tried again when its maps have grown."""
        self.status, self.reason, self.accepted_at_ns = "revoked", reason, None
        self.stability.contradicted()

    @property
    def words(self) -> str:
        """The reason, and the two places between which a pair that is not merged is undecided."""
        between = None if self.alignment is not None else self.places.ambiguity
        return self.reason if between is None else f"{between}; {self.reason}"

    def row(self, a: str, b: str) -> dict[str, Any]:
        """Return it as plain JSON values, as the mission's metrics list it."""
        found = self.alignment
        return {
            "a": a,
            "b": b,
            "status": self.status,
            "T_a_b": None if found is None else [float(value) for value in found.T_a_b],
            "accepted_at_s": None if self.accepted_at_ns is None else round(self.accepted_at_ns / 1e9, 3),
            "confidence": None if found is None else float(found.confidence),
            "reason": self.words,
            "attempts": self.attempts,
            "places": [place.row() for place in self.places],
        }

    def _unmerged_by(self, outcome: Alignment | Rejection, *, searched: bool, is_bent: bool) -> str | None:
        """Return why a merged pair is to be unmerged, or None; only a search without a prior can find another place."""
        if self.alignment is None:
            return None
        reason = None
        if searched and not self.is_seen:
            reason = lies_elsewhere(self.alignment, outcome, is_bent=is_bent)
        return reason or (None if is_bent else refuted(self.alignment, outcome))

    def _rejected(self, reason: str, outcome: Alignment | Rejection) -> Verdict:
        """Reject one alignment; one accepted before stands, for only :meth:`revoke` withdraws it."""
        if self.alignment is None:
            self.status, self.reason = "rejected", reason
        return Verdict("rejected", reason, outcome)
