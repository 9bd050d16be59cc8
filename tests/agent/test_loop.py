"""Maps that are given up, contradicted or restored, in a robot that maps a made-up room."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.agent import Agent, Event, Settings, checkpoint, resume
from mrslam.agent.effects import AlignJob, Effect
from mrslam.agent.known_map import KnownMap
from mrslam.alignment import Alignment, Evidence, WallEvidence
from mrslam.comms.maps.snapshots import published
from mrslam.mutual_detection import MutualDetectionConfig
from mrslam.rbpf import MapperConfig
from mrslam.spatial import Keyframes, LocalMap, OccupancyGrid, TiledMap, se2
from mrslam.spatial.se2 import Transform
from tests.rbpf.rooms import make_scan

S = 1_000_000_000
T_A_B = np.array([2.0, 1.0, np.pi / 2])
"""Where the teammate's map lies in the own one."""
MATE = np.array([1.2, 0.3])
"""Where the teammate has been, in the own map."""
SETTINGS = Settings(rbpf=MapperConfig(particles=2, threads=1))


def local(cells: NDArray[np.int8], places: NDArray[np.float64], revision: int = 1) -> LocalMap:
    """Return a map from (-5, -5) m on, and a trajectory."""
    grid = OccupancyGrid(cells, 0.05, (-5.0, -5.0))
    return LocalMap(TiledMap.from_grid(grid, revision), Keyframes(np.arange(len(places)) * S, places))


def floor() -> LocalMap:
    """Return the teammate's map: floor around where it is, and 15 m2 that the own map, a room, cannot show."""
    cells = np.full((200, 200), -1, dtype=np.int8)
    here = se2.apply(se2.inverse(T_A_B), MATE)
    col, row = ((here + 5.0) / 0.05).astype(int)
    cells[row - 10 : row + 10, col - 10 : col + 10] = 0
    cells[90:190, 124:184] = 0
    return local(cells, np.tile([*here, 0.0], (10, 1)))


def arrives(agent: Agent, robot: str, new: LocalMap, epoch: int = 1) -> None:
    store = agent.node.store
    before = store.newest(robot)
    snapshot = published(new, before if before is not None and before.epoch == epoch else None, epoch)
    assert snapshot is not None
    store.put(robot, snapshot)
    agent.team.take_map(robot, KnownMap(snapshot.version, snapshot.local_map))


def job(attempt: int = 0) -> AlignJob:
    nothing = OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05)
    return AlignJob("a", "b", nothing, nothing, None, ((1, 1), (1, 1)), (64.0, 64.0), attempt)


def found(T_a_b: Transform = T_A_B) -> Alignment:
    evidence = Evidence(WallEvidence(30.0), WallEvidence(30.0))
    return Alignment(T_a_b=T_a_b, confidence=0.9, evidence=evidence, covariance=1e-4 * np.eye(3), method="orb")


def merge(agent: Agent, T_a_b: Transform = T_A_B) -> None:
    for attempt in range(2):
        agent.on_done(job(attempt), found(T_a_b), (attempt + 1) * S // 10)
    assert sorted(agent.T_team_map) == ["a", "b"]


def step(agent: Agent, t_s: float, turn: float = 0.0) -> list[Effect]:
    """Let the agent take a scan where it stands, turned."""
    pose = np.array([0.0, 0.0, turn])
    return agent.on_scan(make_scan(pose, round(t_s * S), beams=360, fov=2 * np.pi), pose, round(t_s * S))


@pytest.fixture
def agent() -> Agent:
    """Return a robot that has mapped a first scan, holds its teammate's map, and has merged it."""
    agent = Agent("a", SETTINGS)
    step(agent, 0.0)
    arrives(agent, "b", floor())
    merge(agent)
    return agent


def test_a_robot_that_gives_its_map_up_begins_another_one(agent: Agent) -> None:
    old = agent.node.store.version("a")
    agent.self_doubt = replace(agent.self_doubt, doubtful=True, torn=True, give_up_ns=S)
    kinds = [effect.kind for effect in step(agent, 3.0, 0.6) if isinstance(effect, Event)]
    assert "given_up" in kinds and agent.map_number == 1 and not agent.self_doubt.doubtful
    assert list(agent.T_team_map) in ([], ["a"])  # at once: that frame is gone
    step(agent, 3.1, 0.6)
    assert agent.node.store.version("a")[0] > old[0]
    assert agent.team.beliefs["a", "b"].alignment is None


def test_a_contradicted_merge_is_taken_back_on_a_tick() -> None:
    cells = np.full((200, 200), -1, dtype=np.int8)
    cells[20:180, 20:180] = 0
    cells[[20, 179], 20:180] = cells[20:180, [20]] = cells[20:180, [179]] = 100
    walled = cells.copy()
    walled[30:170, 95:105] = walled[90:110, 30:170] = 100
    away = np.tile([-3.0, -3.0, 0.0], (10, 1))
    agent = Agent("a", SETTINGS)
    arrives(agent, "a", local(cells, away))
    arrives(agent, "b", local(cells, away))
    merge(agent, np.zeros(3))
    agent.on_tick(S)
    arrives(agent, "b", local(walled, away, 2))
    kinds = [effect.kind for effect in agent.on_tick(4 * S) if isinstance(effect, Event)]
    assert "unmerged" in kinds and list(agent.T_team_map) == ["a"]
    assert agent.team.beliefs["a", "b"].status == "revoked"


def test_an_alignment_of_a_map_that_was_given_up_is_not_used(agent: Agent) -> None:
    arrives(agent, "b", floor(), epoch=2)
    assert agent.team.beliefs["a", "b"].alignment is None and list(agent.T_team_map) == ["a"]
    for attempt in range(2):
        agent.on_done(job(attempt), found(), (20 + attempt) * S)
    assert agent.team.beliefs["a", "b"].attempts == 0 and list(agent.T_team_map) == ["a"]


@pytest.mark.parametrize("enabled", [True, False])
def test_ghosts_where_a_teammate_drove_are_in_the_team_map_only_where_that_is_off(enabled: bool) -> None:
    cells = np.zeros((200, 200), dtype=np.int8)
    cells[100:103, 140:143] = 100  # a speck at 2 m on x
    stood = np.zeros((10, 3))
    agent = Agent("a", replace(SETTINGS, mutual_detection=MutualDetectionConfig(enabled=enabled)))
    arrives(agent, "a", local(cells, stood))
    passed = np.stack([np.linspace(1.0, 3.0, 10), np.full(10, 0.07), np.zeros(10)], axis=1)
    elsewhere = np.zeros((200, 200), dtype=np.int8)
    col, row = ((se2.apply(se2.inverse(T_A_B), np.array([2.07, 0.07])) + 5.0) / 0.05).astype(int)
    elsewhere[row - 3 : row + 4, col - 3 : col + 4] = -1  # a map that shows floor at the speck would free it, too
    arrives(agent, "b", local(elsewhere, se2.compose(se2.inverse(T_A_B), passed)))
    assert agent.team_map().grid.is_occupied.any()
    merge(agent)
    assert agent.team_map().grid.is_occupied.any() != enabled


def test_a_restarted_robot_has_its_teammates_at_once(agent: Agent, tmp_path: Path) -> None:
    checkpoint.write(checkpoint.freeze(agent), tmp_path / "a.state")
    again = Agent("a", SETTINGS, boot_id=2)
    resume(again, tmp_path / "a.state")
    assert np.allclose(again.T_team_map["b"], T_A_B)
