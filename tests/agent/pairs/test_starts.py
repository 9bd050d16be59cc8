"""Where robots started is known: their maps are looked for there first, and everywhere now and then."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.agent.config import AgentConfig, Settings
from mrslam.agent.known_map import KnownMap
from mrslam.alignment import Rejection
from mrslam.spatial import InputError, LocalMap, OccupancyGrid, TiledMap, se2
from tests.agent.pairs.floors import Floors, found

NOWHERE = Rejection("overlap 2 %", 0.0, None, "auto")


def started(**agent: object) -> Floors:
    """Return a team of r1 and r2, which started 3 m ahead of r1 and turned by a quarter."""
    agent = {"starts": {"r1": [1.0, 2.0, np.pi / 2], "r2": [1.0, 5.0, np.pi]}, **agent}
    config = AgentConfig(align_interval_s=10.0, align_growth=0.1, **agent)  # type: ignore[arg-type]
    return Floors("r1", "r2", settings=Settings(agent=config))


def test_maps_are_looked_for_where_their_robots_started() -> None:
    prior = started(start_sigma_m=0.3, start_sigma_rad=0.2).job(0).prior
    assert prior is not None and prior.T_a_b == pytest.approx([3.0, 0.0, np.pi / 2])
    assert np.diag(prior.covariance) == pytest.approx([2 * 0.3**2 + 0.6**2, 2 * 0.3**2 + 0.6**2, 2 * 0.2**2])


@pytest.mark.parametrize("grows", [True, False])
def test_one_try_in_four_looks_everywhere_and_what_it_finds_is_confirmed_everywhere_if_maps_grow(grows: bool) -> None:
    team = started()
    priors = []
    for k in range(8):
        team.grow("r1", round(64 * 1.2**k), k + 2)
        priors.append((job := team.job(100.0 * k)).prior is not None)
        team.end(job, NOWHERE, 100.0 * k)
    assert priors == [True, True, True, False] * 2
    team.grow("r1", 500, 20)
    for k in (8, 9, 10):
        team.end(team.job(100.0 * k), NOWHERE, 100.0 * k)
        team.grow("r1", 500 + 100 * (k - 7), k + 20)
    for t_s in (1100.0, 1120.0):
        job = team.job(t_s)
        assert (job.prior is None) == (job.place is None) == (grows or t_s == 1100.0)
        team.end(job, found(9.0), t_s)
        if grows:
            team.grow("r1", 900, 60)
    assert team.beliefs["r1", "r2"].status == "accepted"


@pytest.mark.parametrize(("x_m", "follows"), [(3.2, True), (9.0, False)])
def test_a_pair_merged_where_it_started_is_never_searched_for_everywhere(x_m: float, follows: bool) -> None:
    team = started()
    for t_s in (0.0, 20.0):
        team.align(found(x_m, theta=np.pi / 2), t_s)
    assert team.beliefs["r1", "r2"].status == "accepted"
    team.grow("r1", 200, 9)
    assert (team.job(60.0).prior is not None) == follows


def test_of_a_new_map_the_start_is_not_known() -> None:
    team = started()
    team.grow("r1", 64, epoch=2)
    assert team.job(0).prior is None


@pytest.mark.parametrize("start", [[1.0], [1.0, 2.0, 3.0, 4.0], [1.0, 2.0, 1e9], [1.0, 2.0, float("nan")]])
def test_a_start_is_a_pose(start: list[float]) -> None:
    with pytest.raises(InputError, match=r"agent\.starts\.r1 must be \[x_m, y_m, theta_rad\]"):
        AgentConfig(starts={"r1": start})


def test_a_start_without_a_heading_is_a_place_in_the_others_frame() -> None:
    config = AgentConfig(starts={"r1": [1.0, 2.0], "r2": [1.0, 5.0, np.pi]}, start_sigma_m=0.3, start_sigma_rad=0.2)
    prior = Floors("r1", "r2", settings=Settings(agent=config)).job(0).prior
    assert prior is not None and prior.of_inverse
    assert prior.T_a_b[:2] == pytest.approx([0.0, 3.0], abs=1e-9)  # r1 as seen from r2
    assert np.diag(prior.covariance) == pytest.approx([2 * 0.3**2 + 0.6**2, 2 * 0.3**2 + 0.6**2, np.pi**2])
    neither = AgentConfig(starts={"r1": [1.0, 2.0], "r2": [1.0, 5.0]})
    assert Floors("r1", "r2", settings=Settings(agent=neither)).job(0).prior is None


@pytest.mark.parametrize(("near", "turn_rad"), [((20.0, 5.0), np.pi), ((20.0, 5.0, 0.7), 0.1)])
def test_a_saved_map_is_looked_at_first_where_the_robot_is_said_to_be(near: tuple[float, ...], turn_rad: float) -> None:
    team = Floors("r2")  # the team of r2
    team.take_saved_map("a@monday", saved_floor(), near)
    prior = team.job(0).prior
    # "a@monday" is the first of the pair, and its frame is sure: however far off the place is, it is as near as said.
    assert prior is not None and not prior.of_inverse and prior.T_a_b[:2] == pytest.approx([20.0, 5.0])
    assert np.sqrt(np.diag(prior.covariance)) == pytest.approx([0.5, 0.5, turn_rad])
    turned = Floors("r2")
    turned.take_saved_map("z@monday", saved_floor(), near)
    prior = turned.job(0).prior
    assert prior is not None and prior.of_inverse and prior.T_a_b[:2] == pytest.approx([20.0, 5.0])


def test_a_hint_is_of_the_map_that_the_robot_began_with() -> None:
    team = Floors("r2")
    team.take_saved_map("a@monday", saved_floor(), (1.0, 2.0))
    team.displace("r2")  # it gave its map up
    team.grow("r2", 64, epoch=2)
    assert team.job(0).prior is None
    with pytest.raises(InputError, match="where a map begins must be"):
        team.take_saved_map("b@monday", saved_floor(), (1.0,))


def saved_floor() -> KnownMap:
    grid = OccupancyGrid(np.zeros((64, 64), dtype=np.int8), 0.05)
    return KnownMap((7, 1), LocalMap(TiledMap.from_grid(grid)))


@pytest.mark.parametrize(("y_m", "follows"), [(3.0, True), (-9.0, False)])
def test_a_pair_is_followed_where_only_the_seconds_heading_at_its_start_is_known(y_m: float, follows: bool) -> None:
    team = started(start_sigma_m=0.3, start_sigma_rad=0.1, starts={"r1": [1.0, 2.0], "r2": [1.0, 5.0, np.pi]})
    T_r1_r2 = se2.inverse(se2.transform(0.0, y_m, 2.0))  # r1 as seen from r2, whichever way it looks
    for t_s in (0.0, 20.0):
        team.align(replace(found(), T_a_b=T_r1_r2), t_s)
    assert team.beliefs["r1", "r2"].status == "accepted"
    team.grow("r1", 200, 9)
    assert (team.job(60.0).prior is not None) == follows


@pytest.mark.parametrize("theta", [np.pi - 0.05, 0.05 - np.pi])
def test_a_pair_that_started_back_to_back_is_followed_on_whichever_side_of_half_a_turn_it_was_found(
    theta: float,
) -> None:
    team = started(starts={"r1": [1.0, 2.0, 0.0], "r2": [4.0, 2.0, np.pi]})
    for t_s in (0.0, 20.0):
        team.align(found(3.0, theta=theta), t_s)
    team.grow("r1", 200, 9)
    assert team.job(60.0).prior is not None
