"""``mrslam align``: two map files, one answer."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from mrslam.agent.shells.saved_files import one_map_file
from mrslam.alignment import ALIGNERS, Alignment, AlignmentConfig, Rejection, align
from mrslam.merge.fit_picture import draw_fit
from mrslam.merge.grids.upright import read_upright
from mrslam.sim_driver.cli.console import say
from mrslam.sim_driver.kernels import ensure_compiled
from mrslam.sim_driver.missions.settings import build_section
from mrslam.spatial import InputError, OccupancyGrid
from mrslam.spatial.files.archives import arrays_in
from mrslam.spatial.files.atomic import make_folder
from mrslam.spatial.files.images import write_image


def align_files(
    a: Path,
    b: Path | None,
    method: str,
    resolution: float | None,
    assignments: list[str],
    as_json: bool,
    picture: Path | None = None,
) -> None:
    """Align two maps, print the outcome, and draw it where a ``picture`` is asked for."""
    if picture is not None and picture.suffix != ".png":
        raise InputError(f"{picture}: the picture is a .png file")
    config = build_section(AlignmentConfig, "alignment", assignments)
    check_method(method)
    if b is None and a.suffix != ".npz":
        raise InputError(f"{a} is one map; name the other one too (only an .npz holds both)")
    one, other = one_map_file(a), None if b is None else one_map_file(b)
    grid_a = read_upright(one, "a", resolution)
    grid_b = read_upright(other or one, "b" if other is None or other == one else _key(other), resolution)
    ensure_compiled(say, ("alignment",))
    start = time.perf_counter()
    outcome = align(grid_a, grid_b, method=method, config=config)
    seconds = time.perf_counter() - start
    if picture is not None:
        write_fit(picture, grid_a, grid_b, outcome, config)
    if as_json:
        print(json.dumps({**as_row(outcome), "seconds": round(seconds, 4)}, allow_nan=False))
        return
    if isinstance(outcome, Alignment):
        x, y, theta = outcome.T_a_b
        text = f"accepted: b lies in a at x {x:.3f} m, y {y:.3f} m, turned by {np.degrees(theta):.2f} deg"
        if outcome.evidence.bent_m:
            text += f", bent by {outcome.evidence.bent_m:.2f} m in the mean ({outcome.evidence.strain:.1%})"
    elif outcome.ambiguous:
        where = (f"x {x:.1f} m, y {y:.1f} m, {np.degrees(theta):.0f} deg" for x, y, theta in as_row(outcome)["places"])
        text = f"ambiguous: b may lie at {'; or at '.join(where)}: {outcome.reason}"
    else:
        text = f"rejected: {outcome.reason}"
    say(f"{text} (confidence {outcome.confidence:.2f}, {outcome.method}, {seconds:.2f} s)")


def write_fit(
    path: Path, a: OccupancyGrid, b: OccupancyGrid, outcome: Alignment | Rejection, config: AlignmentConfig | None
) -> None:
    """Write how two maps fit as a picture, or say that no place was found to draw."""
    drawn = draw_fit(a, b, outcome, config)
    if drawn is None:
        say(f"{path} is not written: there is no place to draw")
        return
    make_folder(path.parent)
    write_image(path, drawn)


def _key(path: Path) -> str:
    """Return which array of an .npz is meant: a pair's second map is "b", a file of one map has "a"."""
    if path.suffix != ".npz":
        return "a"
    return "b" if "b" in arrays_in(path) else "a"


def check_method(method: str) -> None:
    """Raise ``InputError`` for a method that there is not."""
    if method not in ALIGNERS:
        raise InputError(f"no alignment method {method!r}; there are {', '.join(ALIGNERS)}")


def as_row(outcome: Alignment | Rejection) -> dict[str, Any]:
    """Return an outcome as plain JSON values."""
    accepted, evidence = isinstance(outcome, Alignment), outcome.evidence
    rivals = outcome.rivals if isinstance(outcome, Rejection) else ()
    best = [outcome.T_a_b] if rivals and outcome.T_a_b is not None else []
    return {
        "status": "accepted" if accepted else "ambiguous" if rivals else "rejected",
        "T_a_b": [float(value) for value in outcome.T_a_b] if isinstance(outcome, Alignment) else None,
        "places": [[float(value) for value in T] for T in (*best, *rivals)],
        "confidence": float(outcome.confidence),
        "reason": "accepted" if isinstance(outcome, Alignment) else outcome.reason,
        "evidence": {} if evidence is None else evidence.as_row(),
        "method": outcome.method,
    }
