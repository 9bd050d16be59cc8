"""``mrslam save``: sessions of one building as one saved map, in one file; and saved maps as files of map servers."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from mrslam.agent.shells.saved_files import map_files, saved_id, saved_map_of
from mrslam.merge import MergeConfig
from mrslam.merge.sessions.one_map import OneMap, one_map
from mrslam.sim_driver.cli.console import say
from mrslam.sim_driver.cli.maps.align import check_method
from mrslam.sim_driver.cli.maps.merge import short_names
from mrslam.sim_driver.cli.progress import progress_bar
from mrslam.sim_driver.kernels import ensure_compiled
from mrslam.sim_driver.missions.run_files import KEYFRAMES_FILE, MAP_FILE
from mrslam.sim_driver.missions.settings import build_section
from mrslam.spatial import InputError, write_map
from mrslam.spatial.files.atomic import is_file, make_folder
from mrslam.spatial.files.images import write_image
from mrslam.spatial.files.keyframes import write_keyframes
from mrslam.spatial.files.saved_map import SUFFIX, SavedMap, write_saved_map
from mrslam.spatial.files.trinary import pixels


@dataclass(frozen=True, kw_only=True)
class SaveOptions:
    """What the command line says."""

    maps: Sequence[Path]
    """The oldest first."""
    out: Path
    method: str = "auto"
    assignments: Sequence[str] = ()
    as_json: bool = False


def save_maps(options: SaveOptions) -> None:
    """Write one saved map of all those given; or, where the target is no ``.mrslam``, its map as map servers read it.

    Raises ``InputError`` where none of several fits the first: then nothing is written.
    """
    config = build_section(MergeConfig, "merge", options.assignments)
    check_method(options.method)
    files = [file for path in options.maps for file in map_files(path)]
    names = _names(files)
    check_target(files, options.out)
    given = {name: saved_map_of(file) for name, file in zip(names, files, strict=True)}
    start = time.perf_counter()
    made = _made(given, options.method, config)
    left_out = _left_out(made)
    if len(given) > 1 and len(left_out) == len(given) - 1:
        whys = (f"{file}: {left_out[name]}" for name, file in zip(names, files, strict=True) if name in left_out)
        raise InputError(f"{options.out}: not written, for nothing fits {files[0]}: {'; '.join(whys)}")
    _write(options.out, made.saved)
    row = {**_row(given, made, options.out), "left_out": left_out, "seconds": round(time.perf_counter() - start, 3)}
    if options.as_json:
        print(json.dumps(row, allow_nan=False))
        return
    for words in _told(made):
        say(words)
    say(_summary(given, made.saved, options.out))


def _names(files: Sequence[Path]) -> list[str]:
    """Return a name for each map: that of its session, or a longer one where two have the same."""
    longer, names = short_names(list(files)), [saved_id(file) for file in files]
    return [name if names.count(name) == 1 else other for name, other in zip(names, longer, strict=True)]


def _made(given: Mapping[str, SavedMap], method: str, config: MergeConfig) -> OneMap:
    if len(given) < 2:
        return one_map(given)
    ensure_compiled(say, ("alignment", "merge"))
    with progress_bar("aligning pairs", len(given) * (len(given) - 1) // 2) as advance:
        return one_map(given, method, lambda *_: advance(), config, os.cpu_count())


def _left_out(made: OneMap) -> dict[str, str]:
    """Return why maps are no part of the saved one, by name."""
    return {} if made.result is None else dict(made.result.team_map.unplaced)


def _told(made: OneMap) -> list[str]:
    """Return a line on each map: bent by how much, laid as it is, or left out and why."""
    if made.result is None:
        return []
    team = made.result.team_map
    lines = []
    for name in team.T_team_map:
        bend = team.bends.get(name)
        lines.append(f"{name} is laid as it is" if bend is None else f"{name} is bent by up to {bend.most_m:.2f} m")
    return lines + [f"{name} is left out: {reason}" for name, reason in team.unplaced.items()]


def _summary(given: Mapping[str, SavedMap], saved: SavedMap, out: Path) -> str:
    held, had = len(saved.scans), sum(len(one.scans) for one in given.values())
    sessions = "1 session" if saved.version == 1 else f"{saved.version} sessions"
    size = f", {out.stat().st_size / 1000:.0f} kB" if is_file(out) else ""
    return f"{out}: {sessions}, {saved.grid.known_area_m2():.0f} m2, {held} of {had} keyframes{size}"


def _row(given: Mapping[str, SavedMap], made: OneMap, out: Path) -> dict[str, Any]:
    saved = made.saved
    return {
        "out": str(out),
        "version": saved.version,
        "sessions": [asdict(session) for session in saved.sessions],
        "known_area_m2": round(saved.grid.known_area_m2(), 2),
        "keyframes": len(saved.scans),
        "keyframes_given": sum(len(one.scans) for one in given.values()),
        "bytes": out.stat().st_size if is_file(out) else None,
    }


def check_target(files: Sequence[Path], out: Path) -> None:
    """Raise where a map that is read would be replaced, but for the first by its next version, or no map is named."""
    written = {out.resolve()} if out.suffix == SUFFIX else {(out / MAP_FILE).resolve()}
    for file in files if out.suffix != SUFFIX else files[1:]:
        if file.resolve() in written:
            raise InputError(f"{file}: would be replaced; name another place with -o")
    if out.suffix and out.suffix != SUFFIX and not out.is_dir():
        raise InputError(
            f"{out}: name a saved map ({out.with_suffix(SUFFIX)}), or a folder for a map as map servers read"
        )


def _write(out: Path, saved: SavedMap) -> None:
    """Write the saved map in one file, or as a folder of files."""
    if out.suffix == SUFFIX:
        make_folder(out.parent)
        write_saved_map(out, saved)
        return
    make_folder(out)
    write_map(out / MAP_FILE, saved.grid)
    write_image(out / "map.png", pixels(saved.grid))
    write_keyframes(out / KEYFRAMES_FILE, saved.keyframes, saved.scans)
