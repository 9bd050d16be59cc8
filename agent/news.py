"""What of the own map teammates are told: all of it, until the team has long been of one mind; then what is news to it.

Sixteen robots that drive about in one building would else tell each other sixteen maps of it, of which fifteen say
nothing new. What is not told stays in the robot's own map, and is told at once when a robot joins or begins a new map,
when this one loses a place, or another one this map's: to find a map, and to doubt it, all of it is needed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mrslam.agent.team import Team
from mrslam.merge.elsewhere import Elsewhere
from mrslam.merge.grids.shown import Shown
from mrslam.spatial import FREE_MAX, OCCUPIED_MIN, TILE_CELLS, UNKNOWN, KeyScans, LocalMap, Tile, TiledMap, se2
from mrslam.spatial.se2 import Transform
from mrslam.spatial.tiles import TileIndex

TEAM_LEAST = 3
"""Robots in a team, from which on not all is told. Of two that patrol an office that both know each then tells 1.3 kB a
minute in place of 0.4; to ask what is news took an eighth of the CPU of two on a long corridor."""
NEWS_CELLS = 20
"""Cells of a tile that nobody has told like this, from which on it is news: 0.05 m2, less than a chair's."""
OWN_CELLS = 1
"""Cells by which the own map may have been told elsewhere: corrections of more are told."""
VIEWS = 2
"""Teammates' maps that show the walls of a place, from which on scans there are told only every ``SCAN_EVERY_M``: with
one alone the errors between three robots on intel are 4 % larger, and 9 % with a scan every 5 m."""
KNOWN_HITS = 0.75
"""Share of a scan's hits that lie on such walls, from which on it says nothing new: as for a place seen before
(:data:`mrslam.spatial.key_scans.SHARED`)."""
SCAN_EVERY_M = 2.0
"""Path after which a scan is told all the same, metres: by these the own map is tied to those that know the place."""
QUIET_NS = 300_000_000_000
"""Time after which keyframes are told that saw nothing new, nanoseconds."""
BLANK = Tile(0, np.full((TILE_CELLS, TILE_CELLS), UNKNOWN, dtype=np.int8))
"""What others know of a tile that was not told."""


class News:
    """Remembers what was told of one map."""

    def __init__(self, settled_s: float) -> None:
        """Begin with nothing told.

        ``settled_s`` : time for which all maps have to be placed before what teammates know is no longer told, seconds:
        as long as places may still be found to be wrong by what robots see.
        """
        self._settled_ns = round(settled_s * 1e9)
        self.area_m2 = 0.0
        """Known area of the own map, told or not, when it was looked at last, square metres."""
        self._told: dict[TileIndex, Tile] = {}
        self._judged: dict[TileIndex, Tile] = {}
        """Tiles as they were when they were looked at last."""
        self._is_kept_back = np.zeros(0, dtype=np.bool_)
        """By keyframe: whether its scan is not told."""
        self._keeps_back = False
        self._known: frozenset[tuple[str, int]] = frozenset()
        self._known_ns = self._told_ns = 0

    def of(
        self, local: LocalMap, team: Team, placed_by: Mapping[str, tuple[bool, int]], now_ns: int
    ) -> LocalMap | None:
        """Return what is told of the own map now; None where there is nothing to tell yet.

        ``placed_by`` : whether teammates have placed the own map, and when they said so (``CommsNode.placed_by``).
        """
        self.area_m2 = local.map.known_area_m2()
        self._keeps_back = self._is_settled(team, placed_by, now_ns)
        if not self._keeps_back:
            self._told = self._judged = dict(local.map.tiles)
            self._is_kept_back = np.zeros(len(local.key_scans), dtype=np.bool_)
            self._told_ns = now_ns
            return local
        elsewhere = team.elsewhere()
        new = self._look_at_scans(local, elsewhere)
        tiles, has_news = self._tiles(local.map, elsewhere, _around(local.keyframes.T_map_base[new], local.map))
        if not has_news and not new.size and now_ns - self._told_ns < QUIET_NS:
            return None
        self._told, self._told_ns = tiles, now_ns
        told = TiledMap(local.map.resolution_m, tiles, local.map.revision)
        return replace(local, map=told, key_scans=_without(local.key_scans, self._is_kept_back))

    def is_owed(self, team: Team, placed_by: Mapping[str, tuple[bool, int]], now_ns: int) -> bool:
        """Return whether something was kept back that is to be told now: the team is no longer of one mind."""
        return self._keeps_back and not self._is_settled(team, placed_by, now_ns)

    def _is_settled(self, team: Team, placed_by: Mapping[str, tuple[bool, int]], now_ns: int) -> bool:
        """Return whether the robot has placed all maps, none has come or was begun anew, and nobody lacks its own.

        What a teammate says of that counts for as long. Who is not met is not waited for: it has what was told until
        then, and says what it lacks when it is met.
        """
        known = frozenset((name, team.maps[name].epoch) for name in team.maps.keys() - team.saved)
        if known != self._known or team.unplaced:
            self._known, self._known_ns = known, now_ns
        if len(known) < TEAM_LEAST or now_ns - self._known_ns < self._settled_ns:
            return False
        said = [placed_by[name] for name, _ in known if name in placed_by]
        return all(is_placed or now_ns - told_ns >= self._settled_ns for is_placed, told_ns in said)

    def _tiles(self, own: TiledMap, elsewhere: Elsewhere, asked: set[TileIndex]) -> tuple[dict[TileIndex, Tile], bool]:
        """Return the tiles to tell, each as it was told before unless it is news or ``asked``, and whether any is."""
        told = {index: self._told[index] for index in own.tiles if index in self._told}
        shown = Shown([{index: tile.cells for index, tile in self._told.items()}], OWN_CELLS)
        first = asked - told.keys()
        changed = [i for i, tile in own.tiles.items() if i not in first and self._judged.get(i) is not tile]
        new = first.union(self._news_among(changed, own, shown, elsewhere))
        news = {index: tile for index, tile in own.tiles.items() if index in new}
        self._judged = dict(own.tiles)
        return {**told, **news}, bool(news) or len(told) < len(self._told)

    def _news_among(
        self, indices: list[TileIndex], own: TiledMap, told: Shown, elsewhere: Elsewhere
    ) -> list[TileIndex]:
        """Return the tiles of the own map that show more than was told, of it or of others."""
        is_wall, is_free = _walls_and_free([own.tiles[i] for i in indices])
        was_wall, was_free = _walls_and_free([self._told.get(i, BLANK) for i in indices])
        is_new = (is_wall & ~was_wall) | (is_free & ~was_free)
        corners = TILE_CELLS * np.array(indices, dtype=np.int64).reshape(-1, 2)

        def count_elsewhere(cells: NDArray[np.int64], is_wall: NDArray[np.bool_]) -> NDArray[np.int16]:
            return elsewhere.count((cells[:, ::-1].astype(np.float64) + 0.5) * own.resolution_m, is_wall)

        for count in (told.count, count_elsewhere):
            is_new &= _has_news(is_new)[:, None, None]
            tile, row, col = np.nonzero(is_new)
            cells = corners[tile] + np.stack([row, col], axis=1)
            is_new[tile, row, col] = count(cells, is_wall[tile, row, col]) == 0
        return [index for index, is_news in zip(indices, _has_news(is_new), strict=True) if is_news]

    def _look_at_scans(self, local: LocalMap, elsewhere: Elsewhere) -> NDArray[np.int64]:
        """Decide of new keyframes whether their scans are told, and return those whose scans are."""
        scans, poses, before = local.key_scans, local.keyframes.T_map_base, len(self._is_kept_back)
        way_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T))])
        is_kept_back = np.concatenate([self._is_kept_back, np.zeros(max(len(scans) - before, 0), dtype=np.bool_)])
        is_told = ~is_kept_back & (np.diff(scans.starts) > 0)
        last_m = way_m[np.flatnonzero(is_told[:before])[-1]] if is_told[:before].any() else -np.inf
        for k in scans.shown[scans.shown >= before].tolist():
            hits = se2.apply(poses[k], scans.of(k).astype(np.float64))
            known = elsewhere.count(hits, np.ones(len(hits), dtype=np.bool_)) >= VIEWS
            if known.mean() >= KNOWN_HITS and way_m[k] - last_m < SCAN_EVERY_M:
                is_kept_back[k] = True
            else:
                last_m = way_m[k]
        self._is_kept_back = is_kept_back
        return scans.shown[(scans.shown >= before) & ~is_kept_back[scans.shown]]


def _around(T_map_key: Transform, own: TiledMap) -> set[TileIndex]:
    """Return the tiles in which keyframes stand: teammates hold a map against the places of its scans."""
    x_y = np.floor(T_map_key[:, :2] / (TILE_CELLS * own.resolution_m)).astype(np.int64)
    return {(row, col) for col, row in x_y.tolist() if (row, col) in own.tiles}


def _walls_and_free(tiles: list[Tile]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which cells ``(N, 64, 64)`` of some tiles are walls, and which are free."""
    cells = np.array([tile.cells for tile in tiles], dtype=np.int8).reshape(-1, TILE_CELLS, TILE_CELLS)
    return cells >= OCCUPIED_MIN, (cells >= 0) & (cells <= FREE_MAX)


def _has_news(is_new: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which tiles ``(N,)`` have enough cells that are new ``(N, 64, 64)``."""
    return np.count_nonzero(is_new, axis=(1, 2)) >= NEWS_CELLS


def _without(scans: KeyScans, is_left_out: NDArray[np.bool_]) -> KeyScans:
    """Return scans of the same keyframes, of which some are blank."""
    counts = np.diff(scans.starts)
    polar = scans.polar[np.repeat(~is_left_out, counts)]
    starts = np.concatenate([[0], np.cumsum(np.where(is_left_out, 0, counts))]).astype(np.int32)
    return KeyScans.of_checked(starts, polar, np.where(is_left_out[:, None], np.float32(0.0), scans.origins))
