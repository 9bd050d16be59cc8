"""``align``: two occupancy grids in, an alignment or a reasoned rejection out."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from mrslam.alignment.aligners import ALIGNERS
from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.parts import in_parts, is_large
from mrslam.alignment.prepared import PreparedMap, is_smaller, main_part, prepare, working_resolution
from mrslam.alignment.proposals.lattice import PRIOR_SIGMAS
from mrslam.alignment.proposals.search import exhaustive
from mrslam.alignment.result import Alignment, Candidate, Prior, Rejection
from mrslam.alignment.verification.decide import decide
from mrslam.spatial import InputError, OccupancyGrid, se2

MIN_KNOWN_M2 = 2.0
"""Least known area of a map, square metres: less has no room for the walls that a fit must show."""
MIN_WALL_M = 2.0
"""Least wall of a map, metres, for the same reason."""
EXHAUSTIVE = "auto"
"""The method that proposes every distinct place, and so can tell how many fit."""


def align(
    grid_a: OccupancyGrid,
    grid_b: OccupancyGrid,
    method: str = "auto",
    prior: Prior | None = None,
    config: AlignmentConfig | None = None,
    place: se2.Transform | None = None,
    *,
    by_parts: bool = True,
) -> Alignment | Rejection:
    """Return how map b lies in map a, ``T_a_b``, or why that is not known.

    ``place`` : ``T_a_b (3,)`` where the maps may fit; nothing else can be accepted then. Other places are searched for,
    as its rivals, only once it would be, and not with a prior, which says that the maps lie nowhere else.
    ``by_parts`` : whether large maps that do not fit as a whole are looked at in parts, which takes some times as long
    (:func:`in_parts`). With a prior alone they are not.

    ``align(b, a)`` is the inverse of ``align(a, b)``: the maps are put into one order first. Raises ``InputError`` for
    an unknown method only; maps of any size, extent and resolution are handled or rejected.
    """
    config = config or AlignmentConfig()
    if method not in ALIGNERS:
        raise InputError(f"alignment method must be one of {', '.join(ALIGNERS)}, got {method!r}")
    grids = [main_part(grid_a.cropped()), main_part(grid_b.cropped())]
    if is_smaller(grids[0], grids[1]):
        grids.reverse()
        place = None if place is None else se2.inverse(np.asarray(place, dtype=np.float64))
        return _inverse(_align(grids, method, _facing(prior, inverse=True), config, place, by_parts))
    return _align(grids, method, _facing(prior, inverse=False), config, place, by_parts)


def _align(
    grids: list[OccupancyGrid],
    method: str,
    prior: Prior | None,
    config: AlignmentConfig,
    place: se2.Transform | None,
    by_parts: bool,
) -> Alignment | Rejection:
    """Align the larger map (first) and the smaller one; ``grids`` is emptied, for large maps are large."""
    lacking = _lacks("shows", "m2", [grid.known_area_m2() for grid in grids], MIN_KNOWN_M2)
    if lacking:
        return Rejection(lacking, 0.0, None, method)
    res = working_resolution(grids[0], grids[1], config)
    b, a = prepare(grids.pop(), res), prepare(grids.pop(), res)
    lacking = _lacks("holds", "m of wall", [a.wall_m, b.wall_m], MIN_WALL_M)
    if lacking:
        return Rejection(lacking, 0.0, None, method)

    def proposed(by: str) -> list[Candidate]:
        found = ALIGNERS[by](a, b, config, prior)
        if prior is None:
            return found
        # Where nothing is proposed the prior's own place is examined: the answer then says what speaks against it.
        return _within(prior, found, a, b) or [Candidate(prior.T_a_b)]

    def rivals() -> list[Candidate]:
        return proposed(EXHAUSTIVE)

    if place is not None:
        there = [Candidate(np.array(place, dtype=np.float64))]
        outcome = decide(a, b, there, method, config, rivals if prior is None else None)
    else:
        # The other methods propose some places only: what else fits is found by the exhaustive search.
        outcome = decide(a, b, proposed(method), method, config, None if method == EXHAUSTIVE else rivals)
    is_bound = prior is not None and place is None
    if isinstance(outcome, Alignment) or not by_parts or is_bound or not is_large(b):
        return outcome

    def find(part: PreparedMap) -> Alignment | Rejection:
        return decide(a, part, exhaustive(a, part, config, None, b_is_bent=False), method, config)

    return in_parts(b, outcome, find, place)


def _lacks(verb: str, unit: str, amounts: list[float], least: float) -> str | None:
    """Return why one of the two maps, the larger one first, is too small to be aligned, or None."""
    for name, amount in zip(("larger", "smaller"), amounts, strict=True):
        if amount < least:
            return f"the {name} map {verb} {amount:.1f} {unit}, at least {least:.0f} {unit.split()[0]} are needed"
    return None


def _within(prior: Prior, found: list[Candidate], a: PreparedMap, b: PreparedMap) -> list[Candidate]:
    """Return the candidates within ``PRIOR_SIGMAS`` of the prior (and a cell, for priors that are too sure)."""
    if not found:
        return []
    apart = np.array([candidate.T_a_b for candidate in found]) - prior.T_a_b
    apart[:, 2] = se2.wrap(apart[:, 2])
    slack = np.diag([a.res, a.res, a.res / max(math.hypot(*np.ptp(b.points, axis=0)), a.res)]) ** 2
    away2 = np.einsum("ni,ni->n", apart, np.linalg.solve(prior.covariance + slack, apart.T).T)
    return [candidate for candidate, is_near in zip(found, away2 < PRIOR_SIGMAS**2, strict=True) if is_near]


def _adjoint(T_a_b: se2.Transform) -> np.ndarray:
    """Return d inverse(T) / d T at ``T_a_b``, ``(3, 3)``."""
    cos, sin = math.cos(T_a_b[2]), math.sin(T_a_b[2])
    back = se2.inverse(T_a_b)
    return np.array([[-cos, -sin, back[1]], [sin, -cos, -back[0]], [0.0, 0.0, -1.0]])


def _facing(prior: Prior | None, *, inverse: bool) -> Prior | None:
    """Return a prior as one of the transform sought, which is ``T_b_a`` where ``inverse``."""
    return prior if prior is None or prior.of_inverse == inverse else _inverse_prior(prior)


def _inverse_prior(prior: Prior) -> Prior:
    J = _adjoint(prior.T_a_b)
    return Prior(se2.inverse(prior.T_a_b), J @ prior.covariance @ J.T)


def _inverse(outcome: Alignment | Rejection) -> Alignment | Rejection:
    """Return what was found for (b, a) as the answer for (a, b)."""
    if isinstance(outcome, Rejection):
        T_b_a = None if outcome.T_a_b is None else se2.inverse(outcome.T_a_b)
        evidence = None if outcome.evidence is None else outcome.evidence.swapped()
        rivals = tuple(se2.inverse(rival) for rival in outcome.rivals)
        return replace(outcome, T_a_b=T_b_a, evidence=evidence, rivals=rivals)
    J = _adjoint(outcome.T_a_b)
    C = J @ outcome.covariance @ J.T
    return replace(
        outcome, T_a_b=se2.inverse(outcome.T_a_b), evidence=outcome.evidence.swapped(), covariance=0.5 * (C + C.T)
    )
