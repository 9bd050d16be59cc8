"""What of its map a robot tells: all of it, or what is news to a team that has long been of one mind."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.agent import Agent, AgentConfig
from mrslam.agent.known_map import KnownMap
from mrslam.agent.news import NEWS_CELLS, QUIET_NS, SCAN_EVERY_M, TEAM_LEAST, News
from mrslam.agent.team import Team
from mrslam.spatial import LocalMap, OccupancyGrid, Tile, TiledMap, se2
from tests.agent.duo import SETTINGS, S, live, merge, odometry, robot, scan, talk
from tests.agent.test_joining import align, joined, team_of
from tests.merge.joint.blocks import drive, local_map

SETTLED_S = 180.0
SETTLED_NS = round(SETTLED_S * 1e9)
SAID = {"b": (True, 10**19)}
"""That b has placed a's map, and said so last."""
A, B = drive(0.0, 40.0, 1e-4, seed=1), drive(20.0, 65.0, -1e-4, seed=2)
MAPS = {"a": local_map(A), "b": local_map(B)}
FIRST = len(A.trail)
LONG = local_map(drive(0.0, 70.0, 1e-4, seed=1), revision=2)
"""The map of a, who drove on where b has been."""


@pytest.fixture(autouse=True)
def _two_are_a_team(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mrslam.agent.news.TEAM_LEAST", 2)


@pytest.fixture
def team() -> Team:
    team = team_of(maps=MAPS)
    align(team, se2.between(A.truth[0], B.truth[0]))
    joined(team)
    return team


@pytest.fixture
def news(team: Team) -> News:
    """What was told of a's first map, when the team has been of one mind for long."""
    news = News(SETTLED_S)
    assert news.of(MAPS["a"], team, SAID, 0) is MAPS["a"]
    assert news.of(MAPS["a"], team, SAID, SETTLED_NS - 1) is MAPS["a"]
    return news


def with_box(local: LocalMap, cells: int) -> tuple[LocalMap, tuple[int, int]]:
    """Return the map with a square of wall in free floor, and in which tile it is."""
    for index, tile in sorted(local.map.tiles.items()):
        for row, col in ((8, 8), (8, 40), (40, 8), (40, 40)):
            if (tile.cells[row - 6 : row + cells + 6, col - 6 : col + cells + 6] == 0).all():
                changed = tile.cells.copy()
                changed[row : row + cells, col : col + cells] = 100
                tiles = {**local.map.tiles, index: Tile(3, changed)}
                return replace(local, map=TiledMap(local.map.resolution_m, tiles, 3)), index
    raise AssertionError("no floor is free")


def test_a_map_that_was_told_is_not_told_again_but_after_a_while(news: News, team: Team) -> None:
    assert news.of(MAPS["a"], team, SAID, SETTLED_NS) is None
    last_ns = SETTLED_NS - 1
    assert news.of(MAPS["a"], team, SAID, last_ns + QUIET_NS - 1) is None
    told = news.of(MAPS["a"], team, SAID, last_ns + QUIET_NS)
    assert told is not None and dict(told.map.tiles) == dict(MAPS["a"].map.tiles)
    assert news.of(MAPS["a"], team, SAID, last_ns + QUIET_NS + 1) is None


def test_robots_that_are_but_two_tell_each_other_all(team: Team, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mrslam.agent.news.TEAM_LEAST", TEAM_LEAST)
    news = News(SETTLED_S)
    for now_ns in (0, 2 * SETTLED_NS, 4 * SETTLED_NS):
        assert news.of(LONG, team, SAID, now_ns) is LONG


@pytest.mark.parametrize("views", [1, 2])
def test_floor_that_a_teammate_knows_is_not_told_and_few_scans_are_where_enough_know_it(
    news: News, team: Team, views: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mrslam.agent.news.VIEWS", views)
    told = news.of(LONG, team, SAID, SETTLED_NS)
    assert told is not None and told.map.revision == 2
    new = LONG.map.tiles.keys() - MAPS["a"].map.tiles.keys()
    later = told.key_scans.shown[told.key_scans.shown >= FIRST]
    stood = {(int(y // 3.2), int(x // 3.2)) for x, y, _ in LONG.keyframes.T_map_base[later]}
    if views == 2:  # b is but one
        assert later.tolist() == list(range(FIRST, len(LONG.key_scans)))
        return
    assert len(new - stood) >= 15 and new & stood <= told.map.tiles.keys()
    assert len((new - stood) & told.map.tiles.keys()) <= 3  # there a saw round a corner that b did not
    assert all(told.map.tiles[index] is tile for index, tile in MAPS["a"].map.tiles.items())
    np.testing.assert_array_equal(told.keyframes.T_map_base, LONG.keyframes.T_map_base)
    shown = told.key_scans.shown
    assert shown[shown < FIRST].tolist() == list(range(FIRST))
    assert len(later) <= 18 and np.diff([FIRST - 1, *later]).max() in (
        round(2 * SCAN_EVERY_M),
        1 + 2 * SCAN_EVERY_M,
    )  # half a metre apart
    for k in shown.tolist():
        np.testing.assert_array_equal(told.key_scans.of(k), LONG.key_scans.of(k))
        np.testing.assert_array_equal(told.key_scans.origins[k], LONG.key_scans.origins[k])


def test_floor_that_nobody_knows_is_told(news: News, team: Team) -> None:
    team.maps["b"] = KnownMap((1, 2), local_map(drive(20.0, 10.0, -1e-4, seed=2)))  # it saw no more than a
    team.layout.renew("b")
    told = news.of(LONG, team, SAID, SETTLED_NS)
    assert told is not None
    new = {i: tile for i, tile in LONG.map.tiles.items() if i not in MAPS["a"].map.tiles}
    whole = [index for index, tile in new.items() if tile.known_cells > 800]
    assert len(whole) >= 4 and all(told.map.tiles[index] is new[index] for index in whole)
    assert told.key_scans.shown[-5:].tolist() == list(range(len(LONG.key_scans) - 5, len(LONG.key_scans)))


@pytest.mark.parametrize("cells", [8, 4])
def test_what_stands_in_floor_that_was_free_is_told(news: News, team: Team, cells: int) -> None:
    changed, index = with_box(MAPS["a"], cells)
    told = news.of(changed, team, SAID, SETTLED_NS)
    if cells**2 < NEWS_CELLS:
        assert told is None
        return
    assert told is not None and told.map.tiles[index] is changed.map.tiles[index]
    assert [i for i, tile in told.map.tiles.items() if MAPS["a"].map.tiles[i] is not tile] == [index]


def test_what_grows_little_by_little_is_told_once_it_is_enough(news: News, team: Team) -> None:
    for cells in (3, 4):
        assert news.of(with_box(MAPS["a"], cells)[0], team, SAID, SETTLED_NS) is None
    assert news.of(with_box(MAPS["a"], 5)[0], team, SAID, SETTLED_NS) is not None


@pytest.mark.parametrize(("cells", "is_told"), [(1, False), (3, True)])
def test_a_map_that_is_corrected_is_told_again_where_that_is_more_than_a_cell(
    news: News, team: Team, cells: int, is_told: bool
) -> None:
    grid = MAPS["a"].map.to_grid()
    row, col = grid.cell0
    moved = TiledMap.from_grid(OccupancyGrid.at_cell(grid.cells, grid.resolution_m, row + cells, col + cells))
    told = news.of(replace(MAPS["a"], map=moved), team, SAID, SETTLED_NS)
    assert (told is not None) == is_told


def test_what_is_gone_from_the_map_is_told(news: News, team: Team) -> None:
    gone, *kept = sorted(MAPS["a"].map.tiles)
    tiles = {index: MAPS["a"].map.tiles[index] for index in kept}
    told = news.of(replace(MAPS["a"], map=TiledMap(0.05, tiles, 2)), team, SAID, SETTLED_NS)
    assert told is not None and gone not in told.map.tiles and len(told.map.tiles) == len(kept)


def test_scans_are_told_where_no_tile_is_news(news: News, team: Team) -> None:
    told = news.of(replace(LONG, map=MAPS["a"].map), team, SAID, SETTLED_NS)
    assert told is not None and len(told.key_scans.shown) == len(LONG.key_scans)


def test_what_saved_maps_show_teammates_may_not_know(team: Team, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[set[str]] = []
    monkeypatch.setattr(team.layout, "elsewhere", lambda others, _: asked.append(set(others)))
    team.take_saved_map("c@monday", KnownMap((1, 1), MAPS["b"]))
    team.elsewhere()
    assert asked == [{"b"}]


def of_one_mind() -> tuple[Agent, Agent]:
    """Return two robots at one place that have merged, said so, and told all they know."""
    one, two = (robot(name, 1, replace(SETTINGS, agent=AgentConfig(settled_s=1.0))) for name in ("r1", "r2"))
    live([one, two], 0, 60)
    merge(one, [0.0, 0.0, 0.0])
    merge(two, [0.0, 0.0, 0.0])
    for k in range(280, 300):
        talk([one, two], k)
    one.publish(30 * S)
    return one, two


def test_a_robot_that_stops_tells_its_way_in_the_end_and_knows_what_it_has_not_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    one, _ = of_one_mind()
    monkeypatch.setattr("mrslam.rbpf.filter.history.is_known", lambda *_: True)
    monkeypatch.setattr("mrslam.agent.news.News._news_among", lambda *_: [])  # from here on it sees nothing new
    for k in range(60, 90):
        one.on_scan(scan(k), odometry(k), 31 * S)
    version = one.node.store.version("r1")
    one.publish(33 * S)
    assert one.has_news and one.node.store.version("r1") == version
    one.on_tick(30 * S + QUIET_NS)
    assert not one.has_news and one.node.store.version("r1") > version

    whole, own = one.local_map(), one.team.maps["r1"]
    few = dict(sorted(whole.map.tiles.items())[:1])
    one.team.take_map("r1", KnownMap(own.version, replace(whole, map=TiledMap(0.05, few, whole.map.revision))))
    assert one.known_area_m2() == pytest.approx(whole.map.known_area_m2())
    grids: list[OccupancyGrid] = []
    monkeypatch.setattr("mrslam.agent.core.fits_map", lambda _scan, _T, grid: grids.append(grid) or True)
    monkeypatch.setattr(one.self_doubt, "look", lambda _health, _score, fits, _now, is_lost: fits() and None)
    one.on_scan(scan(340), odometry(340), 340 * S)
    assert [grid.known_area_m2() for grid in grids] == pytest.approx([whole.map.known_area_m2()], rel=0.05)


def test_what_was_kept_back_is_told_as_soon_as_there_is_a_map_without_a_place() -> None:
    one, two = of_one_mind()
    versions = []
    for t_s in (30, 31, 32):
        one.publish(t_s * S)
        versions.append(one.node.store.version("r1"))
    one.on_tick(33 * S)
    assert versions[1] == versions[2] == one.node.store.version("r1")
    one.team.take_map("r3", KnownMap((1, 1), two.local_map()))
    for t_s in (34, 35):
        one.on_tick(t_s * S)
        versions.append(one.node.store.version("r1"))
    assert versions[4] == versions[3] > versions[2]


def test_all_is_told_to_a_robot_that_nobody_has_placed_and_after_a_map_was_begun_anew(news: News, team: Team) -> None:
    assert news.of(LONG, team, SAID, SETTLED_NS) is not LONG
    assert team.unplaced == []
    team.take_map("c", KnownMap((1, 1), MAPS["b"]))
    assert team.unplaced == ["c"]
    team.doubted["d"] = "its scans hit what its map does not show"
    assert team.unplaced == ["c", "d"]
    del team.doubted["d"]
    for t_ns in (SETTLED_NS + 1, 3 * SETTLED_NS):  # however long it is there
        assert news.of(LONG, team, SAID, t_ns) is LONG
    team._forget("c")
    assert news.of(LONG, team, SAID, 4 * SETTLED_NS) is LONG
    assert news.of(LONG, team, SAID, 5 * SETTLED_NS - 1) is LONG
    assert news.of(LONG, team, SAID, 5 * SETTLED_NS) is None  # nothing is taken back
    team.maps["b"] = KnownMap((2, 1), MAPS["b"])
    assert news.of(LONG, team, SAID, 6 * SETTLED_NS) is LONG


def test_all_is_told_while_a_teammate_that_is_met_has_not_placed_the_map(news: News, team: Team) -> None:
    assert news.of(LONG, team, {"b": (False, 1)}, SETTLED_NS) is LONG
    assert news.of(LONG, team, SAID, SETTLED_NS) is None
    said = {"b": (False, 2)}
    assert news.is_owed(team, said, SETTLED_NS) and not news.is_owed(team, SAID, SETTLED_NS)
    for who_is_away in ({}, {"b": (False, 0)}, {"b": (True, 0)}, {"c": (False, SETTLED_NS)}):
        assert not news.is_owed(team, who_is_away, SETTLED_NS)
    assert not news.is_owed(team, said, SETTLED_NS + 2)


def test_all_is_told_while_a_saved_map_has_no_place(news: News, team: Team) -> None:
    """The own map is looked for in it as it is told."""
    team.take_saved_map("c@monday", KnownMap((1, 1), MAPS["b"]))
    assert team.unplaced == ["c@monday"]
    for t_ns in (SETTLED_NS, 3 * SETTLED_NS):
        assert news.of(LONG, team, SAID, t_ns) is LONG


def test_a_robot_alone_and_one_with_saved_maps_only_tell_all() -> None:
    alone = team_of(maps={"a": MAPS["a"]})
    news = News(SETTLED_S)
    for t_ns in (0, SETTLED_NS):
        assert news.of(MAPS["a"], alone, SAID, t_ns) is MAPS["a"]
    with_saved = team_of(maps={"a": MAPS["a"]})
    with_saved.take_saved_map("b@monday", KnownMap((1, 1), MAPS["b"]))
    with_saved.layout.placement.T_team_map["b@monday"] = np.zeros(3)
    news = News(SETTLED_S)
    for t_ns in (0, SETTLED_NS):
        assert news.of(MAPS["a"], with_saved, SAID, t_ns) is MAPS["a"]
