"""What is judged of the maps that robots hold: one content a version, nothing forgotten, true to the world."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bench.chaos.knowledge import Knowledge
from bench.chaos.scene import Report
from bench.chaos.team_maps import GHOSTS_MOST, PRECISION, TeamMaps
from mrslam.spatial import OccupancyGrid, se2
from tests.chaos.versions import Team, Version


def snapshot(wall: int) -> Any:
    cells = np.full((4, 4), -1, dtype=np.int8)
    cells[wall] = 100
    return SimpleNamespace(map=SimpleNamespace(tiles={(0, 0): SimpleNamespace(cells=cells)}))


def knowing(digest: dict[str, Version], wall: int = 0, **state: Any) -> Any:
    store = SimpleNamespace(digest=lambda: digest, newest=lambda owner: snapshot(wall), own_epoch=state.get("epoch", 1))
    staged = SimpleNamespace(staging=range(state.get("staged", 0)))
    return SimpleNamespace(
        node=SimpleNamespace(store=store, staged_maps=staged), known_area_m2=lambda: state.get("area_m2", 0.0),
        team=SimpleNamespace(beliefs=range(state.get("pairs", 0))),
    )  # fmt: skip


def test_one_version_of_a_map_is_one_content_whoever_holds_it() -> None:
    report = Report()
    knowledge = Knowledge(report)
    for robot, wall, said in (("r1", 0, 0), ("r2", 0, 0), ("r3", 1, 1)):
        knowledge._contents_are_true(robot, knowing({"r1": (1, 3)}, wall))
        assert len(report.violations) == said
    knowledge._contents_are_true("r2", knowing({"r1": (1, 4)}))  # which r1 never had
    assert len(report.violations) == 2


def test_nothing_that_was_known_is_forgotten() -> None:
    report, robot = Report(), SimpleNamespace(runner=SimpleNamespace(keeper=None))
    knowledge = Knowledge(report)
    for digest, said in (({"r1": (1, 3), "r2": (1, 1)}, 0), ({"r1": (2, 1), "r2": (1, 1)}, 0), ({"r1": (2, 1)}, 1)):
        knowledge._is_monotone("r1", knowing(digest), robot, None)  # type: ignore[arg-type]
        assert len(report.violations) == said


def test_a_map_that_goes_on_does_not_shrink_but_another_may_begin() -> None:
    report = Report()
    knowledge = Knowledge(report)
    for epoch, area_m2, said in ((1, 50.0, 0), (1, 40.0, 0), (2, 1.0, 0), (2, 30.0, 0), (2, 15.0, 1)):
        knowledge._map_is_not_lost("r1", knowing({}, epoch=epoch, area_m2=area_m2))
        assert len(report.violations) == said


@pytest.mark.parametrize(("staged", "pairs", "said"), [(3, 9, 0), (4, 0, 1), (0, 10, 1)])
def test_no_more_is_kept_than_there_are_robots_and_pairs(staged: int, pairs: int, said: int) -> None:
    report = Report()
    Knowledge(report)._is_bounded("r1", knowing({}, staged=staged, pairs=pairs), 3)
    assert len(report.violations) == said


@pytest.mark.parametrize(
    ("precision", "ghosts", "shown", "own", "words"),
    [
        (1.0, 0, 1.0, 1.0, ""),
        (PRECISION - 0.01, 0, 1.0, 1.0, "of the walls"),
        (1.0, GHOSTS_MOST + 1, 1.0, 1.0, "where teammates drove"),
        (1.0, 0, 0.85, 1.0, "of the floor its maps show"),
        (1.0, 0, 0.6, 0.6, "% of the floor"),
    ],
)
def test_team_maps_are_held_against_the_world(
    precision: float, ghosts: int, shown: float, own: float, words: str
) -> None:
    def known(share: float) -> OccupancyGrid:
        cells = np.full((40, 100), -1, dtype=np.int8)
        cells[:, : round(100 * share)] = 0
        cells[0] = 100
        return OccupancyGrid(cells, 0.1)

    report, team = Report(), Team("r1", "r2")
    team.judge = SimpleNamespace(
        world=known(1.0), reachable=np.arange(40)[:, None] + np.zeros(100) > 0,
        occupied_precision=lambda *told: precision,
        ghosts=lambda grid, T, where, within_m, or_at: ghosts if len(where) else 0,
    )  # fmt: skip
    agent = team.agents["r1"]
    agent.node.store.maps = {
        name: SimpleNamespace(map=SimpleNamespace(to_grid=lambda: known(own))) for name in team.agents
    }
    agent.team_map = lambda: SimpleNamespace(T_team_map=dict.fromkeys(("r1", "r2"), se2.IDENTITY), grid=known(shown))
    agent.team = SimpleNamespace(covariance_of=lambda mate: None)
    scene = team.at(1.0)
    scene.frame_now = scene.frame
    maps = TeamMaps(report)
    maps.step(scene)
    maps._judge(scene, "r1", agent)
    assert len(report.violations) == bool(words) and all(words in line for line in report.violations)
