"""Places of a pair are kept with what was seen of them."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.pairs.hypotheses import MOST, Hypotheses
from mrslam.mutual_detection import Sightings
from mrslam.spatial import se2


def at(x_m: float, turn_rad: float = 0.0) -> np.ndarray:
    return se2.transform(x_m, 0.0, turn_rad)


def test_one_place_is_one_hypothesis_and_a_better_estimate_is_looked_at_again() -> None:
    places = Hypotheses()
    first = places.add(at(0.0), "maps", 0)
    assert first is not None and places.add(at(0.3, 0.05), "r2", 1) is first and len(places) == 1
    assert places.add(at(0.6), "maps", 2) is not first and places.add(at(0.0, 0.2), "maps", 3) is not first
    first.own = Sightings(seen=1)
    first.correct(at(0.1))
    assert first.own is not None and first.T_a_b[0] == 0.0
    first.correct(at(0.2))
    assert first.own is None and first.T_a_b[0] == 0.2


def test_at_most_five_are_kept_and_those_that_sightings_speak_of_stay() -> None:
    places = Hypotheses()
    made = [places.add(at(3.0 * k), "maps", k) for k in range(MOST)]
    for k, one in enumerate(made):
        assert one is not None
        one.told["r1"] = -6.0 if k == 0 else 0.0
    places.add(at(99.0), "maps", 9)
    assert len(places) == MOST and places.at(at(0.0)) is made[0] and places.at(at(3.0)) is None
    for one in places:
        one.told["r1"] = -6.0
    assert places.add(at(50.0), "maps", 10) is None


def test_both_robots_sightings_count_and_one_of_them_refutes_nothing() -> None:
    place = Hypotheses().add(at(0.0), "maps", 0)
    assert place is not None
    place.own = Sightings(not_there=20)
    assert place.llr == -3.0 and not place.is_refuted
    place.told["r2"] = -1.0
    assert place.is_refuted
    place.own, place.told["r2"] = Sightings(seen=2), 2.0
    assert place.is_supported and not place.is_refuted
    place.told["r2"] = 1.0
    assert not place.is_supported


@pytest.mark.parametrize("decided", ["nothing", "refuted", "supported"])
def test_a_pair_is_ambiguous_between_two_places_until_one_is_decided(decided: str) -> None:
    belief = PairBelief(status="rejected", reason="another place fits 94% as well")
    one, _ = belief.places.add(at(1.0), "maps", 0), belief.places.add(at(-4.0, 3.1), "maps", 1)
    assert one is not None
    one.told |= {"nothing": {}, "refuted": {"r1": -3.0, "r2": -3.0}, "supported": {"r1": 6.0}}[decided]
    row = belief.row("r1", "r2")
    said = "ambiguous between (1.0 m, 0.0 m, 0 deg) and (-4.0 m, 0.0 m, 178 deg); another place fits 94% as well"
    assert row["reason"] == (said if decided == "nothing" else "another place fits 94% as well")
    assert [place["T_a_b"][0] for place in row["places"]] == [1.0, -4.0]


def test_of_two_places_within_reach_of_a_transform_the_nearer_one_is_meant() -> None:
    places = Hypotheses()
    first, second = places.add(at(0.0), "maps", 0), places.add(at(0.8), "maps", 1)
    assert first is not second
    assert places.at(at(0.45)) is second and places.at(at(0.35)) is first


@pytest.mark.parametrize("fitting", [0, 1])
def test_of_two_places_seen_as_surely_that_is_ahead_where_more_wall_fitted(fitting: int) -> None:
    places = Hypotheses()
    here, there = places.add(at(0.0), "maps", 0), places.add(at(5.0), "maps", 1)
    assert here is not None and there is not None
    here.told, there.told = {"r1": 6.0}, {"r2": 6.0}
    better, other = (here, there) if fitting == 0 else (there, here)
    better.fitted_m = 9.0
    assert places.supported is better
    assert places.ahead_of(better.T_a_b) is None and places.ahead_of(other.T_a_b) is better
    other.told["r3"] = 1.0
    assert places.supported is other
