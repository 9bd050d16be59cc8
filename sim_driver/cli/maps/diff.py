"""``mrslam diff``: what appeared and what vanished between two maps of one building."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mrslam.agent.shells.saved_files import one_map_file, saved_map_of
from mrslam.merge import MergeConfig
from mrslam.merge.sessions.changes import NEAR_M
from mrslam.merge.sessions.diff import LEAST_M2, Diff, diff
from mrslam.merge.sessions.picture import draw_diff
from mrslam.sim_driver.cli.console import say
from mrslam.sim_driver.cli.maps.align import check_method
from mrslam.sim_driver.kernels import ensure_compiled
from mrslam.sim_driver.missions.settings import build_section
from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import make_folder, write_text
from mrslam.spatial.files.images import write_image

SHOWN = 12
"""Pieces that are listed in the terminal; all of them are in ``diff.json``."""


@dataclass(frozen=True, kw_only=True)
class DiffOptions:
    """What the command line says."""

    before: Path
    after: Path
    out: Path
    same_frame: bool = False
    near_m: float = NEAR_M
    least_m2: float = LEAST_M2
    method: str = "auto"
    assignments: Sequence[str] = ()
    as_json: bool = False


def diff_files(options: DiffOptions) -> None:
    """Write ``diff.png`` and ``diff.json``, and list what changed."""
    config = build_section(MergeConfig, "merge", options.assignments)
    check_method(options.method)
    before, after = (saved_map_of(one_map_file(path)) for path in (options.before, options.after))
    if not options.same_frame:
        ensure_compiled(say, ("alignment", "merge"))
    start = time.perf_counter()
    try:
        found = diff(
            before, after, same_frame=options.same_frame, near_m=options.near_m, least_m2=options.least_m2,
            method=options.method, config=config,
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"{options.before} and {options.after}: {error}") from error
    row = {**as_row(found), "seconds": round(time.perf_counter() - start, 3)}
    make_folder(options.out)
    write_image(options.out / "diff.png", draw_diff(found))
    write_text(options.out / "diff.json", json.dumps(row, indent=1, allow_nan=False) + "\n")
    if options.as_json:
        print(json.dumps(row, allow_nan=False))
        return
    for line in as_lines(found):
        say(line)
    say(f"{options.out}/diff.png, diff.json")


def as_row(found: Diff) -> dict[str, Any]:
    """Return what changed as plain JSON values."""
    areas = {what: sum(piece.area_m2 for piece in found.pieces if piece.what == what) for what in found.cells._fields}
    return {
        "both_m2": round(found.both_m2, 2),
        "bent_m": round(found.bent_m, 3),
        **{f"{what}_m2": round(area, 4) for what, area in areas.items()},
        "pieces": [piece.fields() for piece in found.pieces],
    }


def as_lines(found: Diff) -> list[str]:
    """Return a table for the terminal, the largest pieces first."""
    row = as_row(found)
    if not found.pieces:
        return [f"nothing changed on the {row['both_m2']:.0f} m2 that both have seen"]
    lines = [f"{'':10}{'x m':>8}{'y m':>8}{'size m':>14}{'m2':>8}"]
    for piece in found.pieces[:SHOWN]:
        size = f"{piece.width_m:.2f} x {piece.height_m:.2f}"
        lines.append(f"{piece.what:10}{piece.x_m:8.2f}{piece.y_m:8.2f}{size:>14}{piece.area_m2:8.2f}")
    if len(found.pieces) > SHOWN:
        lines.append(f"and {len(found.pieces) - SHOWN} smaller ones")
    counts = [f"{sum(p.what == what for p in found.pieces)} {what} ({row[f'{what}_m2']:.2f} m2)" for what in
              ("appeared", "vanished")]  # fmt: skip
    return [*lines, f"{', '.join(counts)}, on the {row['both_m2']:.0f} m2 that both have seen"]
