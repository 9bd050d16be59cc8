"""``mrslam merge``: map files of any SLAM system into one team map."""

from __future__ import annotations

import json
import os
import time
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mrslam.alignment import Alignment, Rejection
from mrslam.merge import MergeConfig, MergeResult, Pair, Trail, merge_maps
from mrslam.merge.draw import draw_team
from mrslam.merge.grids.upright import read_upright
from mrslam.sim_driver.cli.console import say
from mrslam.sim_driver.cli.maps.align import as_row, check_method, write_fit
from mrslam.sim_driver.cli.progress import progress_bar
from mrslam.sim_driver.kernels import ensure_compiled
from mrslam.sim_driver.missions.run_files import KEYFRAMES_FILE, MAP_FILE, TEAM_MAP_FILE, team_file
from mrslam.sim_driver.missions.settings import build_section
from mrslam.sim_driver.missions.traces import csv_rows
from mrslam.spatial import InputError, OccupancyGrid, write_map
from mrslam.spatial.files.archives import arrays_in
from mrslam.spatial.files.atomic import is_file, is_folder, make_folder, write_text
from mrslam.spatial.files.images import write_image
from mrslam.spatial.files.keyframes import read_scanned_keyframes
from mrslam.spatial.files.saved_map import SUFFIX, read_saved_map
from mrslam.spatial.files.tum import write_tum
from mrslam.spatial.se2 import Transform, transform


def merge_files(
    maps: list[Path],
    out: Path,
    known_poses: Path | None,
    method: str,
    resolution: float | None,
    assignments: list[str],
    as_json: bool,
    pictures: bool = False,
) -> None:
    """Merge the maps; write the team map, its picture and ``merge.json``, and of each pair a picture if asked for."""
    target = target_of(out)
    config = build_section(MergeConfig, "merge", assignments)
    check_method(method)
    maps = in_folders(maps)
    grids = read_maps(maps, resolution)
    trails = read_trails(maps)
    if len(grids) < 2:
        raise InputError("merging needs two maps or more")
    poses = None if known_poses is None else read_poses(known_poses, list(grids))
    _spare(maps, target)
    make_folder(target.parent)
    ensure_compiled(say, ("alignment", "merge"))
    start = time.perf_counter()
    pairs = len(grids) * (len(grids) - 1) // 2
    with progress_bar("aligning pairs", pairs) as advance:
        result = merge_maps(grids, poses, method, lambda *_: advance(), config, None, os.cpu_count(), trails)
    row = {**as_json_row(result), "seconds": round(time.perf_counter() - start, 3)}
    write_map(target, result.team_map.grid)
    write_image(target.with_suffix(".png"), draw_team(result.team_map, grids))
    write_text(target.with_suffix(".json"), json.dumps(row, indent=1, allow_nan=False) + "\n")
    _write_ways(result, trails, target.parent)
    if pictures:
        _draw_pairs(result, grids, target.parent / "pairs")
    if as_json:
        print(json.dumps(row, allow_nan=False))
        return
    for name, T_team_map in result.team_map.T_team_map.items():
        x, y, theta = T_team_map
        say(f"{name} placed at x {x:.3f} m, y {y:.3f} m, turned by {np.degrees(theta):.2f} deg")
    _say_bends(result, trails)
    for name, reason in result.team_map.unplaced.items():
        say(f"{name} not placed: {reason}")
    for (a, b), reason in result.team_map.dropped.items():
        say(f"how {a} and {b} fit was found, and not used: {reason}")
    if len(result.team_map.T_team_map) < 2:
        say("nothing was merged: the map written is one of those given")
    say(f"{target.with_suffix('.png')}, {target} ({row['seconds']:.1f} s)")


def _draw_pairs(result: MergeResult, grids: Mapping[str, OccupancyGrid], folder: Path) -> None:
    """Write a picture of how each pair that was looked at fits, or why it does not."""
    outcomes: dict[Pair, Alignment | Rejection] = {**result.edges, **result.rejections}
    for (a, b), outcome in sorted(outcomes.items()):
        name = f"{a}--{b}".replace("/", "_").replace(":", "_")
        write_fit(folder / f"{name}.png", grids[a], grids[b], outcome, None)


def in_folders(paths: list[Path]) -> list[Path]:
    """Return the map files: of a robot's folder its map, of a run's those of its robots, and files as they are."""
    found: list[Path] = []
    for path in paths:
        if not is_folder(path):
            found.append(path)
            continue
        maps = [path / MAP_FILE] if is_file(path / MAP_FILE) else sorted(path.glob(f"*/{MAP_FILE}"))
        if not maps:
            raise InputError(f"{path}: holds no {MAP_FILE}, and no robots' folders that do")
        found += maps
    return found


def read_trails(paths: list[Path]) -> dict[str, Trail]:
    """Return the ways that made the maps, by their short names, where keyframes are in the file or beside the map."""
    trails: dict[str, Trail] = {}
    for path, name in zip(paths, short_names(paths), strict=True):
        beside = path.parent / KEYFRAMES_FILE
        if path.suffix == SUFFIX:
            saved = read_saved_map(path)
            trails[name] = Trail(saved.keyframes.T_map_base, saved.scans, saved.keyframes.stamps_ns)
        elif path.name == MAP_FILE and is_file(beside):
            keyframes, scans = read_scanned_keyframes(beside)
            trails[name] = Trail(keyframes.T_map_base, scans, keyframes.stamps_ns)
    return {name: trail for name, trail in trails.items() if len(trail)}


def _say_bends(result: MergeResult, trails: Mapping[str, Trail]) -> None:
    """Say which maps are bent, by what, and which are laid as they are."""
    tied = Counter((tie.a, tie.b) for tie in result.ties if tie.believed)
    for (a, b), places in sorted(tied.items()):
        say(f"{a} and {b} saw {places} places in common that agree")
    for name, bend in result.team_map.bends.items():
        say(f"{name} is bent by up to {bend.most_m:.2f} m")
    for name in [name for name in result.team_map.T_team_map if name not in result.team_map.bends]:
        why = "nothing ties it to the others" if name in trails else f"there is no {KEYFRAMES_FILE} with its map"
        say(f"{name} is laid as it is: {why}")
    for (a, b), edge in sorted(result.edges.items()):
        if edge.evidence.bent_m:
            say(
                f"{a} and {b} fit only bent: as they are laid walls are off by {edge.evidence.bent_m:.2f} m in the mean"
            )
    for (a, b), rejection in sorted(result.rejections.items()):
        if rejection.ambiguous:
            say(f"how {a} and {b} fit is ambiguous: {len(rejection.rivals) + 1} places look alike")


def _write_ways(result: MergeResult, trails: Mapping[str, Trail], folder: Path) -> None:
    """Write the corrected keyframes of the maps that are bent, in the merged map's frame."""
    for name, bend in result.team_map.bends.items():
        path = folder / team_file(name.replace("/", "_"))
        make_folder(path.parent)
        write_tum(path, trails[name].stamps_ns, bend.T_team_key)


def target_of(out: Path) -> Path:
    """Return the YAML file to write: the one named, or one in the folder named; other files are mistakes."""
    if out.suffix in (".yaml", ".yml"):
        return out.with_suffix(".yaml")
    if out.suffix and not is_folder(out):
        raise InputError(
            f"{out}: name a folder, or a .yaml file ({out.with_suffix('.yaml')}); the picture is written beside it"
        )
    return out / TEAM_MAP_FILE


def _spare(maps: list[Path], target: Path) -> None:
    """Raise where what is written would replace a map that is read, or its image."""
    written = [target.with_suffix(suffix).resolve() for suffix in (".yaml", ".pgm", ".png", ".json")]
    for path in maps:
        if {path.resolve(), path.with_suffix(".pgm").resolve()} & set(written):
            raise InputError(f"{path}: would be replaced by the merged map; name another place with -o")


def read_maps(paths: list[Path], resolution_m: float | None) -> dict[str, OccupancyGrid]:
    """Return the maps by their short names."""
    grids: dict[str, OccupancyGrid] = {}
    for path, name in zip(paths, short_names(paths), strict=True):
        if path.suffix == ".npz" and is_file(path) and "b" in arrays_in(path):
            grids[f"{name}:a"] = read_upright(path, "a")
            grids[f"{name}:b"] = read_upright(path, "b")
        else:
            grids[name] = read_upright(path, "a", resolution_m)
    return grids


def short_names(paths: list[Path]) -> list[str]:
    """Return short distinct names of files: their own, with folders before and the suffix after only where needed.

    Raises ``InputError`` where a file is given twice.
    """
    files = [path.resolve() for path in paths]
    for path, file in zip(paths, files, strict=True):
        if files.count(file) > 1:
            raise InputError(f"{path}: given twice")
    return [_short_name(file, files) for file in files]


def _short_name(file: Path, files: list[Path]) -> str:
    twins = [other for other in files if other.with_suffix("") == file.with_suffix("")]
    ways = [other.with_suffix("").parts[1:] for other in files if other not in twins]
    parts = file.with_suffix("").parts[1:]
    depth = next(d for d in range(1, len(parts) + 2) if all(way[-d:] != parts[-d:] for way in ways))
    return "/".join(parts[-depth:]) + (file.suffix if len(twins) > 1 else "")


def read_poses(path: Path, names: list[str]) -> dict[str, Transform]:
    """Read ``map, x_m, y_m, theta_rad`` lines: where known maps' frames lie in the team frame."""
    poses: dict[str, Transform] = {}
    try:
        text = path.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is no text ({error})") from error
    for number, row in enumerate(csv_rows(text, path), start=1):
        if not row or row[0].lstrip().startswith("#") or row[0].strip() == "map":
            continue
        name = _named(row[0].strip(), names)
        try:
            x, y, theta = (float(word) for word in row[1:4])
        except ValueError as error:
            raise InputError(f"{path}, line {number}: needs map,x_m,y_m,theta_rad, got {','.join(row)}") from error
        if name not in names or not np.isfinite([x, y, theta]).all():
            raise InputError(
                f"{path}, line {number}: needs one of the maps {', '.join(names)} and a finite pose, got {row}"
            )
        poses[name] = transform(x, y, theta)
    if not poses:
        raise InputError(f"{path}: holds no pose")
    return poses


def _named(word: str, names: list[str]) -> str:
    """Return which of the maps is meant: by its name, or by a path that ends with it; the word where it is none."""
    path = Path(word)
    parts = (*path.parts[:-1], path.stem)
    meant = [name for name in names if word == name or parts[-len(Path(name).parts) :] == Path(name).parts]
    return max(meant, key=len, default=word)


def as_json_row(result: MergeResult) -> dict[str, Any]:
    """Return a merge as plain JSON values."""
    team = result.team_map
    outcomes: dict[Pair, Alignment | Rejection] = {**result.edges, **result.rejections}
    return {
        "placed": {name: [float(value) for value in T] for name, T in team.T_team_map.items()},
        "unplaced": team.unplaced,
        "dropped": [{"a": a, "b": b, "reason": reason} for (a, b), reason in team.dropped.items()],
        "pairs": [{"a": a, "b": b, **as_row(outcome)} for (a, b), outcome in sorted(outcomes.items())],
        "bent_m": {name: round(bend.most_m, 3) for name, bend in team.bends.items()},
        "ties": [[tie.a, tie.b, tie.match.i, tie.match.j, tie.believed] for tie in result.ties],
        "known_area_m2": round(team.grid.known_area_m2(), 2),
    }
