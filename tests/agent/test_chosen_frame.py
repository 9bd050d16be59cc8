"""A robot tells where it is in the frame of its choice, once it knows where that is."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.agent import Agent, AgentConfig, Settings, chosen_frame, write_robot
from mrslam.agent.chosen_frame import in_frame
from mrslam.spatial import InputError, OccupancyGrid, read_map, se2
from tests.agent.test_saved_maps import MONDAY, SECOND, T_A_MONDAY, localise, robot_with_map


def robot_in(frame: str) -> Agent:
    return robot_with_map(settings=Settings(agent=AgentConfig(frame=frame)))


def walls_m(grid: OccupancyGrid) -> NDArray[np.float64]:
    """Return the centres ``(N, 2)`` of occupied cells, metres."""
    rows, cols = np.nonzero(grid.is_occupied)
    return np.stack([cols + 0.5, rows + 0.5], axis=-1) * grid.resolution_m + np.array(grid.origin_m)


def test_its_own_map_is_the_frame_unless_another_is_chosen() -> None:
    agent = robot_in("")
    localise(agent)
    assert agent.T_frame_base == pytest.approx(np.zeros(3)) and agent.T_frame_team == pytest.approx(np.zeros(3))


def test_the_frame_is_known_once_the_robot_is_localised_and_stays_when_that_is_withdrawn() -> None:
    agent = robot_in(MONDAY)
    assert agent.T_frame_base is None and agent.T_frame_team is None
    localise(agent)
    assert agent.T_frame_base == pytest.approx(se2.inverse(T_A_MONDAY))
    agent.team.displace(MONDAY)
    agent.on_tick(20 * SECOND)
    assert agent.T_frame_base == pytest.approx(se2.inverse(T_A_MONDAY))
    agent._begin_map()  # a new map has another frame
    assert agent.T_frame_base is None


def test_the_frame_is_that_of_the_map_wherever_the_robot_is_and_however_it_is_turned(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    T_frame_map, T_team_own = np.array([4.0, -2.0, 1.1]), np.array([0.5, 0.3, -0.4])
    T_frame_team = se2.compose(T_frame_map, se2.inverse(T_team_own))
    monkeypatch.setattr(chosen_frame, "pose_in", lambda team, map_id, T: se2.compose(T_frame_team, T))
    frame = chosen_frame.ChosenFrame(MONDAY)
    team = SimpleNamespace(layout=SimpleNamespace(T_team_own=T_team_own))
    frame.follow(team, np.array([3.0, 1.0, 0.7]))  # type: ignore[arg-type]
    assert frame.T_frame_map == pytest.approx(T_frame_map)


def test_the_team_map_is_written_in_that_frame(tmp_path: Path) -> None:
    agent = robot_in(MONDAY)
    localise(agent)
    write_robot(agent, tmp_path, {})
    row = json.loads((tmp_path / "robot.json").read_text())["chosen_frame"]
    assert row["map"] == MONDAY and row["T_frame_map"] == pytest.approx(list(se2.inverse(T_A_MONDAY)))
    walls, moved = walls_m(agent.team_map().grid), walls_m(read_map(tmp_path / "team_map.yaml"))
    expected = se2.apply(se2.inverse(T_A_MONDAY), walls)
    away_m = np.hypot(*(expected[:, None] - moved[None]).transpose(2, 0, 1)).min(axis=1)
    assert len(walls) > 500 and away_m.max() < 0.08


def test_before_it_is_localised_the_team_map_is_in_its_own_frame(tmp_path: Path) -> None:
    agent = robot_in(MONDAY)
    write_robot(agent, tmp_path, {})
    row = json.loads((tmp_path / "robot.json").read_text())["chosen_frame"]
    assert row == {"map": MONDAY, "T_frame_map": None, "T_frame_base": None}
    assert read_map(tmp_path / "team_map.yaml").origin_m == pytest.approx(agent.team_map().grid.origin_m)


def test_a_grid_that_does_not_move_is_not_drawn_again() -> None:
    grid = OccupancyGrid(np.zeros((4, 4), dtype=np.int8), 0.05)
    assert in_frame(grid, None) is grid and in_frame(grid, se2.IDENTITY) is grid
    moved = in_frame(grid, np.array([1.0, 0.0, 0.0]))
    assert moved.origin_m[0] == pytest.approx(grid.origin_m[0] + 1.0)


def test_a_robot_is_no_frame_to_choose() -> None:
    with pytest.raises(InputError, match=r"agent\.frame must be the name of a saved map"):
        replace(AgentConfig(), frame="r2")
