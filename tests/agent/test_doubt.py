"""A robot that may be anywhere keeps its map to itself, and a map that contradicts itself is not believed."""

from __future__ import annotations

import numpy as np

from agent.doubt import SelfDoubt, contradicts_itself
from spatial import Keyframes, LocalMap, OccupancyGrid, TiledMap

S = 1_000_000_000


def test_a_robot_doubts_recovers_and_gives_up() -> None:
    doubt = SelfDoubt(0.4, 10 * S)
    health = [0.9, 0.39, 0.45, 0.49, 0.5, 0.3, 0.3]
    assert [doubt.look(value, t * S) for t, value in enumerate(health)] == [
        None, "doubtful", None, None, "recovered", "doubtful", None,
    ]  # fmt: skip
    assert doubt.look(0.3, 14 * S) is None
    assert doubt.look(0.3, 15 * S) == "given_up"
    assert doubt.since_ns is None


def told(turn: float) -> LocalMap:
    """A corridor along x with a trajectory through it, turned."""
    cells = np.full((200, 200), -1, dtype=np.int8)
    cells[90:110, 100:] = 0
    cells[[89, 110], 100:] = 100
    way = np.linspace(0.3, 4.5, 20)
    poses = np.stack([way * np.cos(turn), way * np.sin(turn), np.full(20, turn)], axis=1)
    grid = OccupancyGrid(cells, 0.05, (-5.0, -5.0))
    return LocalMap(TiledMap.from_grid(grid), Keyframes(np.arange(20), poses))


def test_a_map_must_be_free_where_its_robot_has_been() -> None:
    assert contradicts_itself(told(0.0)) is None
    reason = contradicts_itself(told(np.pi / 2))
    assert reason is not None and "% of the places where it says it has been" in reason


def test_a_young_map_is_given_time() -> None:
    young = told(np.pi / 2)
    few = Keyframes(young.keyframes.stamps_ns[:3], young.keyframes.T_map_base[:3])
    assert contradicts_itself(LocalMap(young.map, few)) is None
