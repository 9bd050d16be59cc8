"""What an alignment's decision rests on, as typed fields."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

NO_WALL_M = 1e-3
"""Least divisor of a ratio to agreeing wall, metres: far below a cell, so that no wall at all gives a huge ratio."""
KINDS = ("matched", "opposed", "contradicted", "deep")
"""Names of the lengths in :class:`WallEvidence`, without their unit."""


@dataclass(frozen=True)
class WallEvidence:
    """One map's walls laid on the other map, metres of wall surface."""

    matched_m: float = 0.0
    """On a wall of the other map that is free on the same side."""
    opposed_m: float = 0.0
    """On a wall of the other map that is free on the opposite side."""
    contradicted_m: float = 0.0
    """Where the other map is free."""
    deep_m: float = 0.0
    """Where the other map is free and has no wall within ``DEEP_M``."""

    @property
    def agreement(self) -> float:
        """Return 0..1: matched / (matched + opposed + contradicted)."""
        return self.matched_m / max(self.matched_m + self.opposed_m + self.contradicted_m, NO_WALL_M)


@dataclass(frozen=True)
class Evidence:
    """Measurements on two maps under one transform ``T_a_b``; everything a decision reads."""

    a: WallEvidence = WallEvidence()
    """Walls of map a laid on map b."""
    b: WallEvidence = WallEvidence()
    """Walls of map b laid on map a."""
    overlap_m2: float = 0.0
    """Area known in both maps, square metres."""
    overlap: float = 0.0
    """The same as a share (0..1) of the smaller map's known area."""
    free_m2: float = 0.0
    """Area free in both maps, square metres."""
    acceptance_index: float = 0.0
    """0..1: agreeing cells / cells known in both (Carpin 2008, equation 4)."""
    crosswise_m: float = 0.0
    """Matched wall across the direction in which the fit is held least, metres."""
    extent_m: float = 0.0
    """Standard deviation of the matched walls' points about their mean, metres."""
    walls: int = 0
    """Distinct straight walls that match."""
    residual: float = 0.0
    """Mean Geman-McClure cost (0..1) of the walls' distances."""
    score_m: float = 0.0
    """Wall that speaks for the fit, discounted by the share that contradicts (``Case.worth``), metres."""
    margin: float = 1.0
    """0..1: lead in score over the best distinct other fit; 1 where there is none."""
    bent_m: float = 0.0
    """Root mean square shift of the agreeing walls that the rigid transform leaves over, metres; 0 where none bends."""
    strain: float = 0.0
    """Root mean square change of that shift per metre: 0.03 is a scale off by 3 %."""
    proposal: Mapping[str, float] = field(default_factory=dict)
    """The proposing method's own numbers by name (matches, inliers, dissimilarity, ...)."""

    @property
    def matched_m(self) -> float:
        """Return the matched wall of the worse direction, metres."""
        return min(self.a.matched_m, self.b.matched_m)

    @property
    def contradicted_m(self) -> float:
        """Return the contradicted wall of the worse direction, metres."""
        return max(self.a.contradicted_m, self.b.contradicted_m)

    @property
    def contradicted_per_m(self) -> float:
        """Return the contradicted wall of the worse direction per metre of matched wall."""
        return self.contradicted_m / max(self.matched_m, NO_WALL_M)

    @property
    def deep_per_m(self) -> float:
        """Return the deeply contradicted wall of the worse direction per metre of matched wall."""
        return max(self.a.deep_m, self.b.deep_m) / max(self.matched_m, NO_WALL_M)

    @property
    def contradiction(self) -> float:
        """Return 0..1: contradicted / (matched + contradicted) over both directions."""
        against = self.a.contradicted_m + self.b.contradicted_m
        return against / max(self.a.matched_m + self.b.matched_m + against, NO_WALL_M)

    def swapped(self) -> Evidence:
        """Return the evidence for the inverse transform: maps a and b exchanged."""
        return replace(self, a=self.b, b=self.a)

    def as_row(self) -> dict[str, float]:
        """Return plain JSON numbers by flat names, the proposal's first; read back by :meth:`from_row`."""
        row = {name: float(value) for name, value in self.proposal.items()}
        row |= {f"{kind}_{side}_m": getattr(getattr(self, side), f"{kind}_m") for kind in KINDS for side in "ab"}
        row |= {
            "wall_agreement_a": self.a.agreement,
            "wall_agreement_b": self.b.agreement,
            "contradiction": self.contradiction,
        }
        return row | {name: float(getattr(self, name)) for name in SCALARS}

    @classmethod
    def from_row(cls, row: Mapping[str, float]) -> Evidence:
        """Return the evidence written by :meth:`as_row`; unknown names count as the proposal's."""
        one, other = (
            WallEvidence(**{f"{kind}_m": row.get(f"{kind}_{side}_m", 0.0) for kind in KINDS}) for side in "ab"
        )
        scalars: dict[str, Any] = {name: row[name] for name in SCALARS if name in row}
        scalars["walls"] = int(row.get("walls", 0))
        found = cls(one, other, **scalars)
        named = found.as_row()
        return replace(found, proposal={name: value for name, value in row.items() if name not in named})


SCALARS = tuple(f.name for f in fields(Evidence) if f.name not in ("a", "b", "proposal"))
"""Names of the fields that are one number each."""
