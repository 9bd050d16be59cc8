"""Saved maps from disk: of a robot's folder, of a run's robots, or the files of any other system."""

from __future__ import annotations

import re
import zlib
from pathlib import Path

from mrslam.agent.known_map import KnownMap
from mrslam.agent.map_check import contradicts_itself
from mrslam.agent.shells.files import KEYFRAMES_FILE, MAP_FILE, ROBOT_FILE, TEAM_MAP_FILE
from mrslam.alignment.align import MIN_KNOWN_M2
from mrslam.merge.grids.upright import read_upright
from mrslam.spatial import InputError, Keyframes, KeyScans, LocalMap, TiledMap
from mrslam.spatial.files.atomic import is_file, is_folder
from mrslam.spatial.files.keyframes import read_scanned_keyframes
from mrslam.spatial.files.saved_map import SUFFIX, SavedMap, of_one_session, read_saved_map

NAMES_END = 64
"""Most characters of each half of a saved map's name."""


def read_saved_maps(path: Path) -> dict[str, KnownMap]:
    """Return the saved maps at a path by their names (:func:`saved_id`).

    ``path`` : a saved map in one file (``.mrslam``); a map file as :func:`mrslam.spatial.read_map` reads it; a folder
    with ``map.yaml`` (a robot's, or what ``mrslam map`` writes) or ``team_map.yaml``; or a run's folder, whose robots'
    maps are a saved map each. With keyframes in the file, or in ``keyframes.npz`` beside ``map.yaml``, a map can be
    bent; others are rigid. Raises ``InputError`` in one line where a file is missing or damaged, or is not of the map
    that it lies beside.
    """
    return {saved_id(file): known_map(file) for file in map_files(path)}


def map_files(path: Path) -> list[Path]:
    """Return the map files that a path stands for."""
    if not is_folder(path):
        return [path]
    for name in (MAP_FILE, TEAM_MAP_FILE):
        if is_file(path / name):
            return [path / name]
    found = sorted(path.glob(f"*/{MAP_FILE}"))
    if not found:
        raise InputError(f"{path}: holds no {MAP_FILE} or {TEAM_MAP_FILE}, and no robots' folders that do")
    return found


def one_map_file(path: Path) -> Path:
    """Return the only map file that a path stands for; raise ``InputError`` for a folder of several."""
    files = map_files(path)
    if len(files) > 1:
        raise InputError(f"{path}: holds {len(files)} maps; name one of them ({files[0]}), or merge them first")
    return files[0]


def saved_id(file: Path) -> str:
    """Return a map file's name as a saved map: ``r1@monday`` for ``monday/r1/map.yaml``, ``map@office`` for others.

    A folder that has such a name already (``office@2026-11-21``) gives it to its ``map.yaml``, and a saved map in one
    file (``office@2026-11-21.mrslam``) has its own.
    """
    file = file.resolve()
    folder = file.parent
    stem, of = file.stem, folder.name
    if file.suffix == SUFFIX and "@" in stem.strip("@"):
        stem, of = stem.split("@", 1)
    elif file.name in (MAP_FILE, TEAM_MAP_FILE) and "@" in folder.name.strip("@"):
        stem, of = folder.name.split("@", 1)
    elif file.name == MAP_FILE and is_file(folder / ROBOT_FILE):
        stem, of = folder.name, folder.parent.name
    return f"{_clean(stem)}@{_clean(of)}"


def _clean(name: str) -> str:
    """Return a name of a file or folder with what no id may have left out."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "-", name).lstrip(".")[:NAMES_END] or "map"


def known_map(file: Path) -> KnownMap:
    """Return the map of a file as that of a teammate; see :func:`read_saved_maps`."""
    saved = saved_map_of(file)
    local = local_map(saved)
    return KnownMap((_content(local), 1), local)


def saved_map_of(file: Path) -> SavedMap:
    """Return a map file as a saved map: what ``.mrslam`` holds, or a map with the keyframes beside it, if any.

    Raises ``InputError`` where a file is missing or damaged, shows too little, or the keyframes are not of the map.
    """
    if file.suffix == SUFFIX:
        if not is_file(file):
            raise InputError(f"{file}: no such map file")
        saved, where = read_saved_map(file), f"{file}: its keyframes are not of its map"
    else:
        keyframes, scans = Keyframes.empty(), KeyScans.empty()
        grid, beside = read_upright(file), file.parent / KEYFRAMES_FILE
        if file.name == MAP_FILE and is_file(beside):
            keyframes, scans = read_scanned_keyframes(beside)
        saved = of_one_session(saved_id(file), grid, keyframes, scans)
        where = f"{beside}: is not of the map beside it"
    if (shown_m2 := saved.grid.known_area_m2()) < MIN_KNOWN_M2:
        raise InputError(f"{file}: shows {shown_m2:.1f} m2; a map to be found in needs {MIN_KNOWN_M2:g} m2 or more")
    if not saved.grid.is_occupied.any():
        raise InputError(f"{file}: shows no wall to find a place by")
    if reason := contradicts_itself(local_map(saved)):
        raise InputError(f"{where}: {reason}")
    return saved


def local_map(saved: SavedMap) -> LocalMap:
    """Return a saved map as a robot would publish it."""
    return LocalMap(TiledMap.from_grid(saved.grid), saved.keyframes, saved.scans)


def _content(local: LocalMap) -> int:
    """Return a number that differs where maps differ: beliefs of a checkpoint hold for the very same map only."""
    crc = zlib.crc32(repr(local.map.resolution_m).encode())
    for index, tile in sorted(local.map.tiles.items()):
        crc = zlib.crc32(tile.cells.tobytes(), zlib.crc32(repr(index).encode(), crc))
    for array in (local.keyframes.T_map_base, local.key_scans.starts, local.key_scans.polar, local.key_scans.origins):
        crc = zlib.crc32(array.tobytes(), crc)
    return max(crc, 1)
