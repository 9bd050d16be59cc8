"""What a robot believes of its teammates' maps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrslam.agent import Agent, Settings, checkpoint, resume
from mrslam.agent.effects import AlignJob, Event
from mrslam.agent.known_map import KnownMap
from mrslam.agent.layout import PLACE_NS, PLACE_OWN_NS
from mrslam.agent.shells.outputs import summary
from mrslam.alignment import Alignment, Evidence, WallEvidence
from mrslam.comms.maps.snapshots import published
from mrslam.merge.graph.edges import pair_of
from mrslam.spatial import Keyframes, LocalMap, OccupancyGrid, TiledMap
from tests.agent.pairs.floors import Floors

SECOND = 1_000_000_000


def room(revision: int = 1, *, walled: bool = False, drove_in_walls: bool = False) -> LocalMap:
    """Return a room; ``walled``: with thick walls across its floor."""
    cells = np.full((200, 200), -1, dtype=np.int8)
    cells[20:180, 20:180] = 0
    cells[[20, 179], 20:180] = cells[20:180, [20]] = cells[20:180, [179]] = 100
    if walled:
        cells[30:170, 95:105] = 100
        cells[90:110, 30:170] = 100
    places = np.zeros((10, 3))
    places[:, 0] = 1.02 if drove_in_walls else 3.9
    places[:, 1] = np.linspace(1.5, 4.0, 10)
    return LocalMap(TiledMap.from_grid(OccupancyGrid(cells, 0.05), revision), Keyframes(np.arange(10) * SECOND, places))


def arrives(agent: Agent, robot: str, local: LocalMap) -> None:
    store = agent.node.store
    snapshot = published(local, store.newest(robot), 1)
    assert snapshot is not None
    store.put(robot, snapshot)
    agent.team.take_map(robot, KnownMap(snapshot.version, snapshot.local_map))


def merged(agent: Agent) -> int:
    """Let two robots' maps be merged; return when that was."""
    found = Alignment(
        T_a_b=np.zeros(3), confidence=0.9, evidence=Evidence(WallEvidence(30.0), WallEvidence(30.0)),
        covariance=1e-4 * np.eye(3), method="orb",
    )  # fmt: skip
    nothing = OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05)
    for attempt in range(2):
        job = AlignJob("a", "b", nothing, nothing, None, ((1, 1), (1, 1)), (64.0, 64.0), attempt)
        agent.team.on_aligned(job, found, (10 + attempt) * SECOND)
    assert sorted(agent.team.layout.T_team_map) == ["a", "b"]
    return 11 * SECOND


def test_a_contradicted_merge_whose_map_is_then_doubted_is_forgotten_with_it() -> None:
    agent = Agent("a", Settings())
    arrives(agent, "a", room())
    arrives(agent, "b", room())
    now_ns = merged(agent)
    agent.on_tick(now_ns + SECOND // 2)
    arrives(agent, "b", room(2, walled=True))
    agent.planning_grid()  # asked for between two ticks: it finds the contradiction
    arrives(agent, "b", room(3, walled=True, drove_in_walls=True))
    agent.on_tick(now_ns + SECOND * 6 // 10)
    assert list(agent.team.layout.T_team_map) == ["a"] and list(agent.team.doubted) == ["b"]
    assert not agent.team.beliefs


@pytest.mark.parametrize("robot", ["b", "c"])
def test_a_map_that_was_doubted_is_doubted_after_a_restart(robot: str, tmp_path: Path) -> None:
    agent = Agent("a", Settings())
    arrives(agent, "a", room())
    arrives(agent, robot, room(drove_in_walls=True))
    checkpoint.write(checkpoint.freeze(agent), tmp_path / "a.state")
    again = Agent("a", Settings(), boot_id=2)
    resume(again, tmp_path / "a.state")
    assert again.team.doubted == agent.team.doubted and list(again.team.doubted) == [robot]
    assert again.next_job(0) is None and not again.team.beliefs
    assert summary(again, {})["unplaced"] == again.team.doubted


def test_a_merge_that_grown_maps_contradict_is_taken_back_on_a_tick() -> None:
    agent = Agent("a", Settings())
    arrives(agent, "a", room())
    arrives(agent, "b", room())
    now_ns = merged(agent)
    arrives(agent, "b", room(2, walled=True))
    effects = agent.on_tick(now_ns + 3 * SECOND)
    events = [effect for effect in effects if isinstance(effect, Event) and effect.kind == "unmerged"]
    assert len(events) == 1 and "free space" in events[0].fields["reason"]
    assert list(agent.T_team_map) == ["a"]
    belief = agent.team.beliefs["a", "b"]
    assert belief.alignment is None and belief.status == "revoked"
    assert agent.team_map().unplaced == {"b": f"no accepted alignment (a-b: {belief.reason})"}


def test_a_map_that_is_sound_again_is_doubted_no_more() -> None:
    agent = Agent("a", Settings())
    arrives(agent, "a", room())
    arrives(agent, "b", room(drove_in_walls=True))
    assert list(agent.team.doubted) == ["b"]
    arrives(agent, "b", room(2))
    assert not agent.team.doubted and "b" in agent.team.maps


def test_a_map_that_is_doubted_before_the_last_one_was_placed_is_left_out() -> None:
    agent = Agent("a", Settings())
    arrives(agent, "a", room())
    arrives(agent, "b", room())
    arrives(agent, "b", room(2, drove_in_walls=True))
    agent.on_tick(3 * SECOND)
    assert list(agent.team_map().T_team_map) == ["a"]


@pytest.mark.parametrize(("robot", "wait_ns"), [("b", PLACE_NS), ("a", PLACE_OWN_NS)])
def test_a_teammates_new_map_is_placed_sooner_than_the_own_one(robot: str, wait_ns: int) -> None:
    assert PLACE_NS < PLACE_OWN_NS
    agent = Agent("a", Settings())
    arrives(agent, "a", room())
    arrives(agent, "b", room())
    now_ns = merged(agent) + SECOND
    layout = agent.team.layout
    layout.place({}, now_ns)
    assert not layout.is_due(now_ns + 10 * PLACE_OWN_NS)  # nothing is new
    arrives(agent, robot, room(2))
    assert [layout.is_due(now_ns + wait_ns + more_ns) for more_ns in (-1, 0)] == [False, True]


def test_a_pair_that_its_robots_unmerge_leaves_the_team_map_that_was_drawn_before() -> None:
    agent = Agent("a", Settings())
    arrives(agent, "a", room())
    arrives(agent, "b", room())
    now_ns = merged(agent)
    assert sorted(agent.team_map().T_team_map) == ["a", "b"]
    agent.team.unmerge(("a", "b"), "nobody was there", now_ns)
    assert list(agent.team_map().T_team_map) == ["a"]


def test_a_robot_that_begins_a_new_map_shows_the_old_team_map_no_more() -> None:
    agent = Agent("a", Settings())
    arrives(agent, "a", room())
    arrives(agent, "b", room())
    merged(agent)
    assert agent.team_map().grid.known_area_m2() > 10.0
    agent._begin_map()
    assert "b" not in agent.team_map().T_team_map and agent.team_map().grid.known_area_m2() == 0.0


def test_pairs_are_in_one_order_whatever_the_seed_of_hashes() -> None:
    names = [f"r{k}" for k in (5, 2, 8, 1, 9, 3, 7, 4, 6)]
    team = Floors(*names)
    want = [pair_of(name, other) for k, name in enumerate(names) for other in sorted(names[:k])]
    assert list(team.beliefs) == want
