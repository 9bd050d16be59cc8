"""A robot's own trajectory in the team's frame is that of its map as it is now, not as it was published."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.agent import Agent, Settings
from mrslam.agent.layout import Layout
from mrslam.merge import Bend
from mrslam.rbpf import MapperConfig
from mrslam.spatial import se2
from tests.rbpf.rooms import drive, make_scan


def test_a_map_that_was_corrected_since_it_was_published_is_corrected_once(monkeypatch: pytest.MonkeyPatch) -> None:
    agent = Agent("r1", Settings(rbpf=MapperConfig(particles=2, threads=1)), team="team", seed=0, boot_id=1)
    for k, pose in enumerate(drive(60)):
        agent.on_scan(make_scan(pose, k * 10**8), pose, k * 10**8)
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
