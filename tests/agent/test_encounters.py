"""Which scans and reports make a moment of an encounter, and which bodies are new."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.agent.encounters import Encounters, Standing
from mrslam.comms import TeammatePose
from mrslam.mutual_detection import MutualDetectionConfig
from mrslam.mutual_detection.encounters import MOST_HIDDEN_LLR, MOST_UNSEEN_LLR
from tests.agent.duo import S
from tests.agent.sightings import BEGIN
from tests.mutual_detection.sights import sweep
from tests.mutual_detection.test_encounters import MATE, OWN


def test_furniture_is_reported_for_some_seconds_and_what_moves_always() -> None:
    standing, still = Standing(), np.array([2.0, 1.0])
    said = [standing.are_new(np.array([still, [0.1 * k, 5.0]]), k * S // 2).tolist() for k in range(20)]
    assert said[0] == [True, True] and said[-1] == [False, True]
    assert standing.are_new(still[None], 100 * S).tolist() == [True]  # it was forgotten


def test_only_reports_of_the_time_of_a_scan_count_and_each_place_once() -> None:
    encounters, stamp_ns = Encounters(MutualDetectionConfig()), BEGIN + S // 10
    encounters.on_scan(sweep(OWN[0], [MATE[0][:2]]), OWN[0], BEGIN)
    assert encounters.on_report(TeammatePose("r2", BEGIN + S, MATE[0], 1)) is None
    assert encounters.on_report(TeammatePose("r2", stamp_ns, MATE[0], 1)) is not None
    assert encounters.on_report(TeammatePose("r2", stamp_ns, MATE[0], 1)) is None  # nobody has moved since
    assert encounters.on_report(TeammatePose("r2", stamp_ns, MATE[-1], 1)) is not None
    assert len(encounters.moments("r2", 1)) == 2
    assert encounters.on_report(TeammatePose("r2", stamp_ns, MATE[0], 2)) is not None  # in another map
    assert len(encounters.moments("r2", 2)) == 1 and encounters.moments("r2", 1) == []


def test_what_was_seen_on_a_map_that_was_given_up_is_forgotten() -> None:
    encounters = Encounters(MutualDetectionConfig())
    for k in range(60):  # the other stands there for six seconds
        encounters.on_scan(sweep(OWN[0], [MATE[4][:2]], seed=k), OWN[0], BEGIN + k * S // 10)
        are_new = len(encounters.moving_bodies_m()) > 0
    assert encounters.on_report(TeammatePose("r2", BEGIN + 6 * S, MATE[4], 1)) is not None and not are_new
    encounters.forget()
    assert encounters.moments("r2", 1) == [] and not len(encounters.moving_bodies_m())
    assert encounters.on_report(TeammatePose("r2", BEGIN + 6 * S, MATE[0], 1)) is None  # no scan is left
    encounters.on_scan(sweep(OWN[0], [MATE[4][:2]]), OWN[0], BEGIN + 7 * S)
    assert len(encounters.moving_bodies_m())


@pytest.mark.parametrize(("visible", "most_llr"), [(True, MOST_UNSEEN_LLR), (False, MOST_HIDDEN_LLR)])
def test_free_sight_says_less_where_teammates_may_be_too_low_to_be_seen(visible: bool, most_llr: float) -> None:
    assert Encounters(MutualDetectionConfig(teammates_visible=visible)).most_unseen_llr == most_llr
