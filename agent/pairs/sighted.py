"""Which pair of maps is laid together where its robots saw each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from mrslam.agent.effects import AlignJob
from mrslam.agent.known_map import KnownMap, Version
from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.pairs.hypotheses import Hypothesis
from mrslam.agent.pairs.schedule import PATIENCE_S, PATIENT_AFTER
from mrslam.agent.pairs.weighing import covariance_of
from mrslam.alignment import Prior
from mrslam.merge import Pair
from mrslam.spatial.se2 import Transform

MARGIN = np.diag([0.1**2, 0.1**2, 0.03**2])
"""Added to the covariance of a place by sight, m^2 and rad^2: maps may have been corrected since."""


def sighted_job(
    beliefs: Mapping[Pair, PairBelief],
    maps: Mapping[str, KnownMap],
    is_known: Callable[[Pair, Transform], bool],
    interval_s: float,
    now_ns: int,
) -> AlignJob | None:
    """Return the maps of the first pair that is to be tried where its robots saw each other, None where there is none.

    A place is tried again after ``interval_s`` with maps that have changed, for what contradicted it may be corrected;
    after ``PATIENT_AFTER`` tries it takes ``PATIENCE_S``. ``is_known`` : whether the team has a pair's maps at a place
    already, and needs no alignment of these two.
    """
    for pair, belief in beliefs.items():
        (a, b), (map_a, map_b) = pair, (maps[pair[0]], maps[pair[1]])
        versions = (map_a.version, map_b.version)
        place = _untried(belief, versions, partial(is_known, pair), interval_s, now_ns)
        if place is not None:
            place.tried_ns, place.tried, place.tries = now_ns, versions, place.tries + 1
            prior = Prior(place.T_a_b, covariance_of(place) + MARGIN)
            areas, trails = (map_a.area_m2, map_b.area_m2), (map_a.trail, map_b.trail)
            return AlignJob(a, b, map_a.grid, map_b.grid, prior, versions, areas, belief.attempts, trails, place.T_a_b)
    return None


def _untried(
    belief: PairBelief,
    versions: tuple[Version, Version],
    is_known: Callable[[Transform], bool],
    interval_s: float,
    now_ns: int,
) -> Hypothesis | None:
    """Return a place where the robots saw each other and the pair is not merged, None where there is none to try now.

    Sightings proposed it, or maps did and sightings support it: maps that lie elsewhere are merged wrongly then.
    """
    for place in belief.places:
        wait_s = interval_s if place.tries < PATIENT_AFTER else max(interval_s, PATIENCE_S)
        waited = place.tried_ns is None or now_ns - place.tried_ns >= wait_s * 1e9
        is_due = waited and place.tried != versions
        is_seen = place.fix is not None or place.is_supported
        if is_seen and is_due and not place.is_refuted and _is_ahead(belief, place) and not is_known(place.T_a_b):
            return place
    return None


def _is_ahead(belief: PairBelief, place: Hypothesis) -> bool:
    """Return whether robots rather saw each other here than where the pair is merged; if it is not, than anywhere else.

    A place that would yield to another as soon as the pair is merged there is not tried (:func:`weighing.against`).
    """
    if belief.alignment is None:
        return belief.places.ahead_of(place.T_a_b) is None
    return belief.places.ahead_of(belief.alignment.T_a_b) is place
