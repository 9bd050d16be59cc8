"""Teammates' places carry the uncertainty of the transform to their maps."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.agent.teammates import Teammates
from mrslam.alignment import Alignment, Evidence
from mrslam.comms import TeammatePose
from mrslam.merge import Bend
from mrslam.merge.joint.bent_team import BentTeam
from mrslam.mutual_detection import MutualDetectionConfig
from mrslam.spatial import Scan, se2
from tests.agent.duo import S, live, robot

COVARIANCE = np.diag([0.01, 0.02, 0.003])


def masked(covariance: np.ndarray | None, *, enabled: bool = True, is_placed: bool = True) -> int:
    """Return how many of the beams that end around a teammate 4 m ahead are masked."""
    beams = np.full(200, 4.0, dtype=np.float32)
    scan = Scan(stamp_ns=S, ranges_m=beams, angle_min_rad=-0.3, angle_increment_rad=0.003, range_max_m=9.0)
    teammates = Teammates(MutualDetectionConfig(enabled=enabled))
    teammates.observe(TeammatePose("r2", S, np.zeros(3), 1), se2.transform(4.0, 0.0, 0.0), covariance)
    return teammates.mask(scan, np.zeros(3), {"r2": np.zeros(3)} if is_placed else {}, S)[1]


def test_the_less_sure_the_transform_the_wider_the_mask() -> None:
    assert masked(None) == masked(np.zeros((3, 3))) > 10
    assert masked(np.diag([0.02, 0.02, 0.0])) > 1.3 * masked(None)


@pytest.mark.parametrize(("enabled", "is_placed"), [(True, True), (False, True), (True, False)])
def test_only_teammates_whose_maps_are_placed_are_masked_and_none_where_that_is_switched_off(
    enabled: bool, is_placed: bool
) -> None:
    assert (masked(None, enabled=enabled, is_placed=is_placed) > 0) == (enabled and is_placed)


@pytest.mark.parametrize(("age_s", "is_told"), [(9.9, True), (10.0, False)])
def test_a_teammate_that_said_long_ago_where_it_is_may_be_anywhere(age_s: float, is_told: bool) -> None:
    teammates = Teammates(MutualDetectionConfig())
    teammates.observe(TeammatePose("r2", 5 * S, se2.transform(1.0, 0.0, 0.0), 1), None)
    teammates.observe(TeammatePose("r3", 5 * S, np.zeros(3), 1), None)  # nobody knows where its map lies
    places = teammates.places({"r2": se2.transform(3.0, 2.0, np.pi / 2)}, 5 * S + round(age_s * 1e9))
    assert list(places) == (["r2"] if is_told else [])
    if is_told:
        np.testing.assert_allclose(places["r2"], [3.0, 3.0, np.pi / 2], atol=1e-12)


@pytest.mark.parametrize("own", ["r1", "r3"])
def test_the_covariance_is_that_of_the_alignment_seen_from_the_own_map(own: str) -> None:
    one, two = robot(own, 1), robot("r2", 1)
    live([one, two], 0, 60)
    first, T = min(own, "r2"), se2.transform(1.0, 2.0, 0.7)
    found = Alignment(T, 0.9, Evidence(walls=9), COVARIANCE, "auto")
    for t_ns in (0, 20 * S):
        job = one.next_job(t_ns)
        assert job is not None and job.a == first
        one.on_done(job, found, t_ns)
    got = one.team.covariance_of("r2")
    assert got is not None
    if own == first:
        np.testing.assert_array_equal(got, COVARIANCE)
    else:
        drawn = np.random.default_rng(0).multivariate_normal(T, COVARIANCE, 4000)
        np.testing.assert_allclose(got, np.cov(np.array([se2.inverse(one) for one in drawn]).T), rtol=0.2, atol=2e-3)


def circle_m(covariance: np.ndarray) -> float:
    """Return the radius around a teammate that was merged with this covariance and has reported its place since."""
    one, two = robot("r1", 1), robot("r2", 1)
    live([one, two], 0, 60)
    found = Alignment(se2.transform(0.0, 0.0, 0.0), 0.9, Evidence(walls=9), covariance, "auto")
    for t_ns in (0, 20 * S):
        job = one.next_job(t_ns)
        assert job is not None
        one.on_done(job, found, t_ns)
    live([one, two], 60, 70)
    (radius_m,) = one._teammates._tracker.predict(69 * S // 10)[1]
    return float(radius_m)


def test_an_agent_follows_reports_with_that_covariance() -> None:
    assert circle_m(np.diag([0.02, 0.02, 0.0])) > circle_m(np.diag([1e-8, 1e-8, 0.0])) + 0.05


def test_a_teammate_is_followed_where_its_map_lies_on_the_own_one_though_that_is_bent_in_the_team_map() -> None:
    one, two = robot("r1", 1), robot("r2", 1)
    live([one, two], 0, 60)
    T = se2.transform(0.2, 0.1, 0.0)
    found = Alignment(T, 0.9, Evidence(walls=9), COVARIANCE, "auto")
    for t_ns in (0, 20 * S):
        job = one.next_job(t_ns)
        assert job is not None
        one.on_done(job, found, t_ns)
    layout, off = one.team.layout, se2.transform(1.0, 0.0, 0.0)
    places = {"r1": off, "r2": se2.compose(off, T)}
    trails = {name: known.trail for name, known in one.team.maps.items()}
    bends = {name: Bend(trail.T_map_key, se2.compose(places[name], trail.T_map_key)) for name, trail in trails.items()}
    stamps = {name: trail.stamps_ns for name, trail in trails.items()}
    layout.bend(BentTeam(bends=bends, joined=frozenset(bends), T_a_b={("r1", "r2"): T}, stamps_ns=stamps))
    layout.place(one.team._alignments(), 21 * S)
    live([one, two], 60, 80)
    (place,) = one._teammates._tracker.predict(79 * S // 10)[0]
    assert place == pytest.approx(T[:2], abs=0.02)
    assert place + off[:2] == pytest.approx(layout.T_team_map["r2"][:2], abs=0.02)
