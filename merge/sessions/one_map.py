"""Sessions of one building made into one saved map, or a saved map continued by more of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from mrslam.merge.batch.merge_maps import MergeResult, merge_maps
from mrslam.merge.batch.pair_aligner import Progress
from mrslam.merge.config import MergeConfig
from mrslam.merge.grids.warp import warp
from mrslam.merge.joint.trail import Trail
from mrslam.merge.sessions.changes import later_wins, on_one_lattice
from mrslam.merge.sessions.repeated import check_sessions
from mrslam.merge.sessions.thinning import needed
from mrslam.spatial import Keyframes, KeyScans, se2
from mrslam.spatial.files.saved_map import SavedMap
from mrslam.spatial.se2 import Transform


@dataclass(frozen=True, eq=False)
class OneMap:
    """A saved map made of several, and how they fit together."""

    saved: SavedMap
    """In the frame of the first one."""
    result: MergeResult | None
    """None where there was one map only."""


def one_map(
    given: Mapping[str, SavedMap],
    method: str = "auto",
    progress: Progress | None = None,
    config: MergeConfig | None = None,
    workers: int | None = None,
) -> OneMap:
    """Return one saved map of all those, the oldest first, that find their place in the first one's frame.

    They are bent until what was seen agrees, and where they contradict each other the later one is right. Of keyframes
    those are kept that walls need (:func:`needed`). Raises ``InputError`` where two of them hold the same session.
    """
    check_sessions(given)
    grids = {name: saved.grid for name, saved in given.items()}
    trails = {name: trail for name, saved in given.items() if len(trail := trail_of(saved))}
    if len(given) < 2:
        return OneMap(thinned(next(iter(given.values()))), None)
    first = next(iter(given))
    result = merge_maps(grids, None, method, progress, config, first, workers, trails)
    placed = [placed_in_one_frame(saved, name, result) for name, saved in given.items() if _is_placed(name, result)]
    return OneMap(thinned(reduce(_continued, placed)), result)


def _is_placed(name: str, result: MergeResult) -> bool:
    return name in result.team_map.T_team_map


def trail_of(saved: SavedMap) -> Trail:
    """Return a saved map's keyframes as a way that can be bent."""
    return Trail(saved.keyframes.T_map_base, saved.scans, saved.keyframes.stamps_ns)


def placed_in_one_frame(saved: SavedMap, name: str, result: MergeResult) -> SavedMap:
    """Return a map that was merged under a name in the frame of the merged map, bent as it is there.

    One that is bent by less than a cell where it lies is not drawn again: a saved map is continued many times, and each
    drawing may thicken a wall by a cell.
    """
    team, resolution_m = result.team_map, result.team_map.grid.resolution_m
    bend = team.bends.get(name)
    if bend is None:
        T_team_map: Transform = team.T_team_map[name]
        grid, T_team_key = saved.grid, se2.compose(T_team_map, saved.keyframes.T_map_base)
    else:
        T_team_map, T_team_key = bend.T_team_map, bend.T_team_key
        stays = not T_team_map.any() and bend.most_m < resolution_m
        grid = saved.grid if stays else bend.bent(saved.grid)
    keyframes = Keyframes(saved.keyframes.stamps_ns, T_team_key)
    return replace(saved, grid=warp(grid, T_team_map, resolution_m), keyframes=keyframes)


def _continued(before: SavedMap, after: SavedMap) -> SavedMap:
    """Return an earlier map brought up to date by a later one in the same frame."""
    one, two = on_one_lattice(before.grid, after.grid)
    grid = later_wins(one, two)
    keyframes = Keyframes(
        np.concatenate([before.keyframes.stamps_ns, after.keyframes.stamps_ns]),
        np.concatenate([before.keyframes.T_map_base, after.keyframes.T_map_base]),
    )
    return SavedMap(grid, keyframes, before.scans.append(after.scans), before.sessions + after.sessions)


def thinned(saved: SavedMap) -> SavedMap:
    """Return a saved map with the keyframes that its walls need (:func:`needed`)."""
    numbers = np.repeat(np.arange(len(saved.sessions)), [session.keyframes for session in saved.sessions])
    kept = np.flatnonzero(needed(saved.keyframes.T_map_base, saved.scans))
    counts = np.bincount(numbers[kept], minlength=len(saved.sessions))
    sessions = tuple(replace(one, keyframes=int(count)) for one, count in zip(saved.sessions, counts, strict=True))
    keyframes = Keyframes(saved.keyframes.stamps_ns[kept], saved.keyframes.T_map_base[kept])
    scans = KeyScans.concatenate(saved.scans.part(int(k), int(k) + 1) for k in kept)
    return replace(saved, keyframes=keyframes, scans=scans, sessions=sessions)
