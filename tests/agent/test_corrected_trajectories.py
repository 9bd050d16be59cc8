"""A robot's own trajectory and pose in the team's frame, in which its own map may be bent."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.agent import Agent, Settings
from mrslam.agent.chosen_frame import ChosenFrame
from mrslam.agent.layout import Layout
from mrslam.merge import Bend
from mrslam.rbpf import MapperConfig
from mrslam.spatial import se2
from tests.rbpf.rooms import drive, make_scan

T_TEAM_OWN = np.array([0.3, -0.2, 0.05])
"""How far a bent team map is off the own map, where the robot is."""


@pytest.fixture
def driven(monkeypatch: pytest.MonkeyPatch) -> Agent:
    """A robot whose team map is bent where it is."""
    monkeypatch.setattr(Layout, "T_team_own", property(lambda _: T_TEAM_OWN))
    return robot_along(drive(20))


def robot_along(poses: np.ndarray) -> Agent:
    """A robot that drove along poses ``(N, 3)`` in a room."""
    agent = Agent("r1", Settings(rbpf=MapperConfig(particles=2, threads=1)), team="team", seed=0, boot_id=1)
    for k, pose in enumerate(poses):
        agent.on_scan(make_scan(pose, k * 10**8), pose, k * 10**8)
    return agent


def test_the_pose_in_the_team_map_is_bent_with_it(driven: Agent) -> None:
    assert np.array_equal(driven.T_team_base, se2.compose(T_TEAM_OWN, driven.T_map_base))


def test_without_a_saved_map_the_team_map_is_told_as_it_is(driven: Agent) -> None:
    assert np.array_equal(driven.T_frame_team, se2.IDENTITY)


def test_the_team_map_lies_in_a_saved_maps_frame_so_that_the_robot_stands_where_it_is_in_that(driven: Agent) -> None:
    driven.frame = ChosenFrame("r9@monday")
    driven.frame.T_frame_map = np.array([5.0, 1.0, -0.8])
    np.testing.assert_allclose(se2.compose(driven.T_frame_team, driven.T_team_base), driven.T_frame_base, atol=1e-12)


def test_ghosts_of_the_own_map_are_looked_for_in_its_own_frame(driven: Agent, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    monkeypatch.setattr(
        driven.team, "without_ghosts", lambda grid, *, of_own_map=False: asked.append(of_own_map) or grid
    )
    driven.own_map()
    assert asked == [True]


def test_saved_maps_have_no_trajectory_of_their_own(driven: Agent, monkeypatch: pytest.MonkeyPatch) -> None:
    keys = driven.mapper.snapshot().keyframes
    bend = Bend(keys.T_map_base, keys.T_map_base)
    monkeypatch.setattr(Layout, "bends", property(lambda _: {"r1": bend, "r2": bend, "r9@monday": bend}))
    monkeypatch.setattr(Layout, "keyframes", lambda _: {"r2": keys, "r9@monday": keys, "r3": keys})
    driven.team.saved.add("r9@monday")
    assert sorted(driven.corrected_trajectories()) == ["r1", "r2"]


def test_a_map_that_was_corrected_since_it_was_published_is_corrected_once(monkeypatch: pytest.MonkeyPatch) -> None:
    agent = robot_along(drive(60))
    keys = agent.mapper.snapshot().keyframes.T_map_base
    assert len(keys) > 5
    T_team_map = np.array([4.0, -2.0, 0.6])
    as_published = keys + np.linspace(0.0, 0.3, len(keys))[:, None] * np.array([1.0, 0.0, 0.0])
    bend = Bend(as_published, se2.compose(T_team_map, keys))
    monkeypatch.setattr(Layout, "bends", property(lambda layout: {"r1": bend}))
    monkeypatch.setattr(Layout, "keyframes", lambda layout: {})
    found = agent.corrected_trajectories()["r1"].T_map_base
    expected = se2.compose(T_team_map, agent.trajectory_laser().T_map_base)
    assert np.allclose(found, expected, atol=1e-6)
