"""A robot that may be anywhere keeps its map to itself, and a map that contradicts itself is not believed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike

from mrslam.agent import Agent, Settings
from mrslam.agent.known_map import KnownMap
from mrslam.agent.map_check import _on_walls, contradicts_itself
from mrslam.agent.self_doubt import PATIENCE, SelfDoubt, fits_map
from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.spatial import Keyframes, KeyScans, LocalMap, OccupancyGrid, Scan, TiledMap, se2

S = 1_000_000_000


def never() -> bool:
    """No scan fits the map of before."""
    return False


def test_a_robot_doubts_recovers_and_gives_up() -> None:
    doubt = SelfDoubt(0.4, 10 * S)
    health = [0.9, 0.39, 0.45, 0.49, 0.5, 0.3, 0.3]
    assert [doubt.look(value, 1.0, never, t * S, is_lost=t > 4) for t, value in enumerate(health)] == [
        None, "doubtful", None, None, "recovered", "doubtful", None,
    ]  # fmt: skip
    assert doubt.look(0.3, 1.0, never, 14 * S, is_lost=True) is None
    assert doubt.look(0.3, 1.0, never, 15 * S, is_lost=True) == "given_up"
    assert not doubt.doubtful


@pytest.mark.parametrize("at", [0, 1])
@pytest.mark.parametrize("is_shown", [True, False])
def test_a_robot_that_its_mapper_found_again_is_believed_only_where_the_published_map_shows_it(
    at: int, is_shown: bool
) -> None:
    doubt, healths = SelfDoubt(0.4, 10 * S), [0.2, 0.2, *[1.0] * 10]
    told = [doubt.look(h, 1.0, lambda: is_shown, t * S, is_lost=t == at) for t, h in enumerate(healths)]
    end = 5 if is_shown else 10  # scans that fit while the mapper still doubts count among the five
    assert told[: end + 1] == ["doubtful", *[None] * (end - 1), "recovered" if is_shown else "given_up"]


def test_a_map_that_scans_contradict_though_nobody_carried_the_robot_is_kept_for_long() -> None:
    doubt = SelfDoubt(0.4, 10 * S)
    told = [doubt.look(0.3, 1.0, never, t * S) for t in range(PATIENCE * 10 + 1)]
    assert told == ["doubtful"] + [None] * (PATIENCE * 10 - 1) + ["given_up"]


def test_where_a_scan_is_left_out_it_doubts_until_the_next_one() -> None:
    doubt = SelfDoubt(0.4, 10 * S)
    assert doubt.look(0.9, 1.0, never, 0) is None
    assert doubt.leave_out(0.4) is None and not doubt.doubtful
    assert [doubt.leave_out(0.39), doubt.leave_out(0.39)] == ["doubtful", None] and doubt.doubtful
    assert doubt.look(0.41, 1.0, never, 1 * S) == "recovered" and not doubt.doubtful
    assert doubt.leave_out(0.2) == "doubtful"
    assert doubt.look(0.3, 1.0, never, 2 * S) is None and doubt.doubtful
    assert doubt.leave_out(0.2) is None
    assert [doubt.look(health, 1.0, never, 3 * S) for health in (0.41, 0.5)] == [None, "recovered"]


def test_a_robot_that_resumes_where_a_scan_was_left_out_doubts_unless_its_map_shows_the_next() -> None:
    for fits, told in ((lambda: True, "recovered"), (never, None)):
        doubt = SelfDoubt(0.4, 10 * S)
        assert doubt.look(0.9, 1.0, never, 0) is None
        assert doubt.leave_out(0.2) == "doubtful"
        resumed = SelfDoubt(0.4, 10 * S).resumed(doubt.state())
        assert resumed.look(0.9, 0.1, fits, 9 * S) == told
        assert resumed.doubtful == resumed.torn == (told is None)


def test_a_clock_that_is_set_back_makes_no_doubt_longer() -> None:
    doubt = SelfDoubt(0.4, 10 * S)
    told = [doubt.look(0.3, 1.0, never, t * S, is_lost=True) for t in (100, 106, 50, 53, 54)]
    assert told == ["doubtful", None, None, None, "given_up"]


def test_the_time_that_it_was_off_is_no_time_of_doubt() -> None:
    doubt = SelfDoubt(0.4, 10 * S)
    assert doubt.look(0.3, 1.0, never, 0, is_lost=True) == "doubtful"
    assert doubt.look(0.3, 1.0, never, 6 * S, is_lost=True) is None
    resumed = SelfDoubt(0.4, 10 * S).resumed(doubt.state())
    assert [resumed.look(0.3, 1.0, never, t * S, is_lost=True) for t in (60, 63, 64)] == [None, None, "given_up"]


def test_a_robot_that_wakes_up_elsewhere_doubts_until_the_old_map_fits_again() -> None:
    asleep = SelfDoubt(0.4, 100 * S)
    assert [asleep.look(1.0, 0.9, never, t * S) for t in range(30)] == [None] * 30
    doubt = SelfDoubt(0.4, 100 * S).resumed(asleep.state())
    told = [doubt.look(1.0, score, never, (30 + t) * S) for t, score in enumerate([0.3] + [0.9] * 10)]
    assert told == ["doubtful"] + [None] * 10
    fits = [True, True, False, True, True, True, True, True]
    told = [doubt.look(1.0, 0.9, lambda one=one: one, (50 + t) * S) for t, one in enumerate(fits)]
    assert told == [None] * 7 + ["recovered"]


@pytest.mark.parametrize(("fits", "told"), [(True, None), (None, "doubtful"), (False, "doubtful")])
def test_a_robot_that_comes_back_where_it_has_driven_on_believes_its_wheels_only_if_its_map_confirms_them(
    fits: bool | None, told: str | None
) -> None:
    doubt = SelfDoubt(0.4, 10 * S)
    assert [doubt.look(1.0, 0.9, never, t * S) for t in range(30)] == [None] * 30
    resumed = SelfDoubt(0.4, 10 * S).resumed(doubt.state())
    assert resumed.look(0.45, 0.0, lambda: fits, 60 * S) == told
    assert resumed.doubtful == (told is not None)
    again = SelfDoubt(0.4, 10 * S).resumed(doubt.state())
    assert again.look(1.0, 0.9, never, 60 * S) is None
    assert again.look(1.0, 0.2, lambda: fits, 61 * S) is None  # only the first scan is another view: the rest it saw


def test_a_robot_that_woke_up_elsewhere_gives_its_map_up_as_soon_as_one_that_is_lost() -> None:
    asleep = SelfDoubt(0.4, 10 * S)
    assert asleep.look(1.0, 0.9, never, 0) is None
    doubt = SelfDoubt(0.4, 10 * S).resumed(asleep.state())
    told = [doubt.look(1.0, 0.3, never, t * S) for t in range(30, 41)]
    assert told == ["doubtful"] + [None] * 9 + ["given_up"]


def test_a_robot_in_the_middle_of_its_way_leaves_sudden_views_to_its_mapper() -> None:
    doubt = SelfDoubt(0.4, 100 * S)
    assert [doubt.look(1.0, score, never, t * S) for t, score in enumerate([0.9] * 30 + [0.1] * 5)] == [None] * 35
    assert doubt.look(0.2, 0.9, never, 40 * S) == "doubtful" and not doubt.torn


def test_a_young_robot_that_comes_back_elsewhere_doubts() -> None:
    doubt = SelfDoubt(0.4, 10 * S)
    assert [doubt.look(1.0, 0.9, never, t * S) for t in range(5)] == [None] * 5
    resumed = SelfDoubt(0.4, 10 * S).resumed(doubt.state())
    assert resumed.look(1.0, 0.2, lambda: None, 60 * S) == "doubtful"


def test_a_young_robot_and_one_in_the_dark_do_not_tear() -> None:
    doubt = SelfDoubt(0.4, 100 * S)
    assert [doubt.look(1.0, 0.2, never, t) for t in range(10)] == [None] * 10
    resumed = SelfDoubt(0.4, 100 * S).resumed(doubt.state())
    assert resumed.look(1.0, 0.35, never, 20) is None  # it saw as little before


def room(T_base_laser: ArrayLike = (0.0, 0.0, 0.0)) -> tuple[Scan, OccupancyGrid]:
    """A room's map, and what a laser in its middle, heading along x, sees of it."""
    cells = np.zeros((120, 160), dtype=np.int8)
    cells[[0, 1, -2, -1]] = cells[:, [0, 1, -2, -1]] = 100
    cells[40:44, 90:100] = 100
    angles = np.linspace(-np.pi, np.pi, 180, endpoint=False)
    with np.errstate(divide="ignore"):
        ranges = np.minimum(np.abs(3.95 / np.cos(angles)), np.abs(2.95 / np.sin(angles)))
    scan = Scan(
        stamp_ns=0, ranges_m=ranges.astype(np.float32), angle_min_rad=-np.pi, angle_increment_rad=2 * np.pi / 180,
        range_max_m=20.0, T_base_laser=np.array(T_base_laser),
    )  # fmt: skip
    return scan, OccupancyGrid(cells, 0.05, (-4.0, -3.0))


def test_a_scan_fits_the_map_where_it_was_taken_and_not_elsewhere() -> None:
    scan, grid = room()
    assert fits_map(scan, np.zeros(3), grid)
    assert fits_map(scan, np.array([1.0, 0.5, 0.6]), grid) is False
    assert fits_map(scan, np.array([30.0, 0.0, 0.0]), grid) is None


def test_a_scan_fits_by_the_lasers_place_on_the_robot() -> None:
    T_base_laser = np.array([0.4, -0.2, np.pi / 2])
    scan, grid = room(T_base_laser)
    assert fits_map(scan, se2.inverse(T_base_laser), grid)
    assert fits_map(scan, np.zeros(3), grid) is False


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
    assert doubted(told(0.0)) is None
    reason = doubted(told(np.pi / 2))
    assert reason is not None and "% of the places where it says it has been" in reason


def test_a_young_map_is_given_time() -> None:
    young = told(np.pi / 2)
    few = Keyframes(young.keyframes.stamps_ns[:3], young.keyframes.T_map_base[:3])
    assert doubted(LocalMap(young.map, few)) is None


def test_a_ghost_where_a_robot_turned_on_the_spot_is_not_held_against_its_map() -> None:
    way = np.zeros((30, 3))
    way[:10, 0] = np.linspace(-2.0, 0.0, 10)
    way[10:20, 2] = np.linspace(0.0, 6.0, 10)  # ten keyframes at one place, where a teammate stood later
    way[20:, 0] = np.linspace(0.0, 2.0, 10)
    cells = np.zeros((120, 120), dtype=np.int8)
    cells[57:63, 57:63] = 75
    ghost = OccupancyGrid(cells, 0.05, (-3.0, -3.0))
    assert doubted(LocalMap(TiledMap.from_grid(ghost), Keyframes(np.arange(30), way))) is None
    cells[57:63, 20:57] = 75  # but half of its way is
    wall = OccupancyGrid(cells, 0.05, (-3.0, -3.0))
    assert doubted(LocalMap(TiledMap.from_grid(wall), Keyframes(np.arange(30), way))) is not None


def hall(turn: float, count: int = 20) -> LocalMap:
    """An open hall of 6 x 4 m, a way that stays near its middle, and scans of its walls; the map is turned."""
    cells = np.full((200, 200), -1, dtype=np.int8)
    cells[60:140, 40:160] = 0
    cells[[59, 140], 39:161] = cells[59:141, [39, 160]] = 100
    turned = np.rot90(cells, round(turn / (np.pi / 2)))
    way = np.stack([np.linspace(-0.5, 0.5, count), np.zeros(count), np.zeros(count)], axis=1)
    x, y = np.linspace(-2.9, 2.9, 20), np.linspace(-1.9, 1.9, 15)
    walls = [np.stack([x, np.full(20, side * 2.025)], axis=1) for side in (-1.0, 1.0)]
    walls += [np.stack([np.full(15, side * 3.025), y], axis=1) for side in (-1.0, 1.0)]
    scans = KeyScans.of_points([np.concatenate(walls)[::2] - pose[:2] for pose in way], np.zeros((count, 2)))
    grid = OccupancyGrid(np.ascontiguousarray(turned), 0.05, (-5.0, -5.0))
    return LocalMap(TiledMap.from_grid(grid), Keyframes(np.arange(count), way), scans)


def test_a_map_must_show_what_its_robot_has_seen() -> None:
    assert doubted(hall(0.0)) is None and doubted(hall(np.pi)) is None  # half a turn of this hall is this hall
    reason = doubted(hall(np.pi / 2))
    assert reason is not None and "% of what its scans hit is wall in its own map" in reason
    assert doubted(hall(0.0, count=1)) is None and doubted(hall(np.pi / 2, count=1)) == reason  # however young
    silent = hall(np.pi / 2)
    assert doubted(LocalMap(silent.map, silent.keyframes)) is None  # of a robot that sends no scans nobody can say


def test_the_scans_that_a_map_must_show_are_sought_among_keyframes_without() -> None:
    turned = hall(np.pi / 2, count=3)
    before, after = KeyScans.blank(5), KeyScans.blank(992)  # few of these would be looked at
    stamps, way = np.arange(1000), np.concatenate([np.zeros((5, 3)), turned.keyframes.T_map_base, np.zeros((992, 3))])
    among = LocalMap(turned.map, Keyframes(stamps, way), before.append(turned.key_scans).append(after))
    assert doubted(among) == doubted(turned) is not None
    nothing = LocalMap(turned.map, Keyframes(stamps, way), KeyScans.blank(1000))
    assert doubted(nothing) is None


def three_of_four_walls(count: int, *, mirrored: bool) -> LocalMap:
    """A hall with a wall across, and so many scans in its larger part; mirrored, three of its walls lie on walls."""
    cells = np.full((200, 200), -1, dtype=np.int8)
    cells[60:140, 40:160] = 0
    cells[[59, 140], 39:161] = cells[59:141, [39, 160]] = 100
    cells[59:141, 120] = 100  # two metres from one wall, and not from the other
    x, y = np.linspace(-2.9, 0.9, 15), np.linspace(-1.9, 1.9, 15)
    seen = [np.stack([x, np.full(15, side * 2.025)], axis=1) for side in (-1.0, 1.0)]
    seen += [np.stack([np.full(15, at), y], axis=1) for at in (-3.025, 1.025)]
    way = np.stack([np.linspace(-1.5, 0.5, count), np.zeros(count), np.zeros(count)], axis=1)
    scans = KeyScans.of_points([np.concatenate(seen) - pose[:2] for pose in way], np.zeros((count, 2)))
    grid = OccupancyGrid(np.ascontiguousarray(cells[:, ::-1] if mirrored else cells), 0.05, (-5.0, -5.0))
    return LocalMap(TiledMap.from_grid(grid), Keyframes(np.arange(count), way), scans)


def test_a_mirrored_map_is_found_out_where_most_of_it_looks_the_same() -> None:
    """Three walls of four lie where others are when mirrored."""
    assert doubted(three_of_four_walls(20, mirrored=False)) is None
    reason = doubted(three_of_four_walls(20, mirrored=True))
    assert reason == "only 77 % of what its scans hit is wall in its own map"


def test_a_map_of_which_a_part_is_not_told_is_held_against_the_rest() -> None:
    """Of the hall's west neither floor nor walls are told, nor what was seen from there."""
    whole = three_of_four_walls(20, mirrored=False)
    way = whole.keyframes.T_map_base
    scans = [whole.key_scans.of(k) if way[k, 0] > 0.0 else np.empty((0, 2)) for k in range(20)]
    assert 0 < sum(len(points) > 0 for points in scans) < 10
    east = {index: tile for index, tile in whole.map.tiles.items() if index[1] >= 0}
    told = LocalMap(
        TiledMap(0.05, east, 1),
        whole.keyframes,
        KeyScans.of_points([p.astype(float) for p in scans], np.zeros((20, 2))),
    )
    assert len(east) < len(whole.map.tiles) and doubted(told) is None
    west = {index: tile for index, tile in whole.map.tiles.items() if index[1] < 0}
    assert doubted(replace(told, map=TiledMap(0.05, west, 1))) is not None


def test_a_map_that_was_sound_for_long_is_not_doubted_for_a_hedge_that_shows_as_free() -> None:
    worse, known = three_of_four_walls(60, mirrored=True), three_of_four_walls(50, mirrored=False)
    assert contradicts_itself(worse, known) is None
    assert contradicts_itself(worse, three_of_four_walls(49, mirrored=False)) == doubted(worse) is not None
    assert contradicts_itself(hall(np.pi / 2), known) is not None  # but no map turns round
    young = three_of_four_walls(49, mirrored=False)
    way = np.concatenate([young.keyframes.T_map_base, np.zeros((9, 3))])
    without = LocalMap(young.map, Keyframes(np.arange(58), way), young.key_scans.append(KeyScans.blank(9)))
    assert contradicts_itself(worse, without) == doubted(worse)  # keyframes without scans prove nothing


def test_what_is_known_of_a_teammates_map_says_nothing_of_its_next_one() -> None:
    agent = Agent("a", Settings())
    for epoch, is_believed in ((1, True), (2, False)):
        agent.team.take_map("b", KnownMap((1, 1), three_of_four_walls(50, mirrored=False)))
        agent.team.take_map("b", KnownMap((epoch, 2), three_of_four_walls(60, mirrored=True)))
        assert ("b" in agent.team.maps) is is_believed is ("b" not in agent.team.doubted)
    again = Agent("a", Settings())
    again.team.restore({"b": KnownMap((1, 2), three_of_four_walls(60, mirrored=True))}, {}, None)
    assert "b" not in again.team.maps  # it may be one that was doubted before


def test_what_was_seen_a_few_cells_beside_a_wall_is_not_that_wall() -> None:
    cells = np.zeros((60, 60), dtype=np.int8)
    cells[30] = 100
    tiled = TiledGrid.of(OccupancyGrid(cells, 0.05))
    shown = [_on_walls(tiled, np.array([[1.5, (30.5 + off) * 0.05]])) for off in (-4, -3, -2, 0, 2, 3, 4)]
    assert shown == [0, 0, 1, 1, 1, 0, 0]


def doubted(local: LocalMap) -> str | None:
    return contradicts_itself(local)
