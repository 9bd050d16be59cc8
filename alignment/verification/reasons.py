"""What a fit must show to be accepted, and how a failure is told to whoever asked."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.evidence import NO_WALL_M, Evidence

MOST_MARGIN = 0.95
"""No greater lead is asked for."""
SOME_WALL_M, MUCH_WALL_M = 15.0, 75.0
"""Agreeing wall from which contradiction begins to be forgiven, and from which it is forgiven most, metres."""
FEW_M, ENOUGH_M, STRICTER = 10.0, 20.0, 0.6
"""Below so many agreeing metres only this part of the usual contradiction is allowed; from so many on, all of it."""
CLEAN = 0.05
"""Contradiction per metre of agreeing wall up to which no greater lead is asked for."""
PLENTY_M, LEAD_PER_M = 8.0, 0.06
"""Below so many metres each metre less asks for so much more lead: chance fits are small."""
MANY_WALLS = 10
"""Distinct walls that go with it."""
CHANCE = 0.446
"""Mean cost of agreeing walls that lie anywhere within the tolerance: 1 - atan(2) / 2, the kernel's scale being half of
it. That of right fits is 0.06 to 0.33, the median 0.15."""
SHARP, RAGGED = 0.1, 0.2
"""Cost of fits of maps that are drawn to a cell, and from which maps are ragged."""
LOOSE, SMALL_M = 0.3, 12.0
"""Largest cost of a fit that is worth less than so many metres: half way from right fits to chance."""


@dataclass(frozen=True)
class Test:
    """One thing a fit must show."""

    value: float
    bound: float
    scale: float
    """Change of ``value`` that matters; negative where less is better."""
    complaint: str
    """What is said where it is not shown."""
    bends: bool = False
    """Whether maps of one place that are bent may fail it."""
    is_lead: bool = False
    """Whether it is the lead over other places: a fit that fails nothing else is ambiguous."""

    @property
    def slack(self) -> float:
        """Return by how much it is passed, in ``scale``; negative where failed."""
        return (self.value - self.bound) / self.scale


def forgiven(evidence: Evidence) -> float:
    """Return 0..1: how much evidence outweighs contradiction; real maps are bent and changed, chance fits are small."""
    much = (evidence.matched_m - SOME_WALL_M) / (MUCH_WALL_M - SOME_WALL_M)
    return min(max(much, 0.0), 1.0) * min(evidence.walls / MANY_WALLS, 1.0)


@dataclass(frozen=True)
class Bounds:
    """What is asked of a fit's score, contradictions and lead."""

    score_m: float
    contradicted: float
    deep: float
    lead: float


def rigid_bounds(evidence: Evidence, config: AlignmentConfig) -> Bounds:
    """Return what is asked of maps that are laid as they are."""
    lead = config.min_margin + config.margin_per_contradiction * max(0.0, evidence.contradicted_per_m - CLEAN)
    lead = min(MOST_MARGIN, lead + LEAD_PER_M * max(0.0, PLENTY_M - evidence.score_m))
    more = config.forgiveness * forgiven(evidence)
    usual = STRICTER + (1.0 - STRICTER) * min(max((evidence.matched_m - FEW_M) / (ENOUGH_M - FEW_M), 0.0), 1.0)
    return Bounds(
        config.min_score_m, config.max_contradiction * usual + more, config.max_deep_contradiction + more, lead
    )


def bent_bounds(residual: float, wall_m: float, config: AlignmentConfig) -> Bounds:
    """Return what is asked of maps that are bent to fit, as are the rivals; ``wall_m`` : of the smaller map.

    More wall, for any place is helped by bending; no more lead for walls that contradict: rivals contradict likewise.
    What may contradict, deeply or not, depends on how ragged the maps are: of walls that agree to a cell none is.
    """
    ragged = min(max((residual - SHARP) / (RAGGED - SHARP), 0.0), 1.0)
    most, most_deep = (
        usual + ragged * (config.max_bent_contradiction - usual)
        for usual in (config.max_contradiction, config.max_deep_contradiction)
    )
    return Bounds(max(config.min_bent_score_m, config.min_bent_share * wall_m), most, most_deep, config.min_margin)


def tests(evidence: Evidence, config: AlignmentConfig, bounds: Bounds | None = None) -> list[Test]:
    """Return all that a fit must show to be accepted; without ``bounds`` what is asked of maps laid as they are."""
    bounds = bounds or rigid_bounds(evidence, config)
    matched, across = max(evidence.matched_m, NO_WALL_M), evidence.crosswise_m
    shallow, deep = evidence.contradicted_per_m, evidence.deep_per_m
    score, other = evidence.score_m, 1.0 - evidence.margin
    wall = f"{matched:.1f} m of wall agree, {shallow * matched:.1f} m contradict"
    counted = "" if matched < bounds.score_m else " once what contradicts is taken off"
    little = f"too little wall in common{counted}: {wall}"
    agree = "1 separate wall agrees" if evidence.walls == 1 else f"{evidence.walls} separate walls agree"
    slides = f"the maps can slide along each other: only {across:.1f} m of the {matched:.1f} m that agree run across"
    return [
        Test(score, bounds.score_m, 2.0, little if score > 0 else f"more speaks against than for it: {wall}"),
        Test(evidence.walls, config.min_walls, 2.0,
             f"only {agree}, {config.min_walls} are needed"),
        Test(shallow, bounds.contradicted, -0.1, f"{_share(shallow)} of the walls compared lie where the other map is "
             f"free, more than {_share(bounds.contradicted)}", bends=True),
        Test(deep, bounds.deep, -0.05, f"{_share(deep)} of the walls compared lie clearly where the other map is free, "
             f"more than {_share(bounds.deep)}", bends=True),
        Test(evidence.residual, LOOSE if score < SMALL_M else math.inf, -0.05,
             f"walls that agree lie {evidence.residual / CHANCE:.0%} as far apart as chance would lay them, more than "
             f"{LOOSE / CHANCE:.0%}", bends=True),
        Test(across, config.min_crosswise_wall_m, 0.5, slides),
        Test(across / matched, config.min_crosswise, 0.05, slides),
        Test(evidence.margin, bounds.lead, 0.2,
             f"ambiguous: another place fits {other:.0%} as well, at most {1.0 - bounds.lead:.0%} is allowed",
             bends=True, is_lead=True),
    ]  # fmt: skip


def _share(per_matched: float) -> str:
    """Return a length per metre of agreeing wall as a share of all that is compared, which never exceeds 100 %."""
    return f"{per_matched / (1.0 + per_matched):.1%}"
