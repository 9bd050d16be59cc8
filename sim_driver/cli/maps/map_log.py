"""``mrslam map``: one log, one mapper."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from mrslam import rbpf
from mrslam.sim_driver.cli.console import say
from mrslam.sim_driver.cli.maps.map_results import Mapped, Way, results_of
from mrslam.sim_driver.cli.progress import progress_bar
from mrslam.sim_driver.evaluate.relations import read_relations
from mrslam.sim_driver.feeds import Feed, Reading, open_feed
from mrslam.sim_driver.kernels import ensure_compiled
from mrslam.sim_driver.missions.locate import locate
from mrslam.sim_driver.missions.settings import build_section
from mrslam.sim_driver.view import watch_mapper
from mrslam.sim_driver.view.files import start_viewer
from mrslam.spatial.files.atomic import make_folder

if TYPE_CHECKING:
    from mrslam.sim_driver.view.watch import MapperWatcher


REFUSED_SAID = 0.05
"""Where a larger share of the scans was of no use, that is said."""


@dataclass(frozen=True, kw_only=True)
class MapOptions:
    """What the command line says."""

    log: Path
    particles: int
    seed: int
    out: Path
    no_odometry: bool
    relations: Path | None
    salvage: bool
    assignments: list[str]
    rrd: Path | None
    view: bool
    as_json: bool


def map_log(options: MapOptions) -> None:
    """Map the log and write its map with keyframes, the trajectories and ``metrics.json``.

    Interrupted, it writes the results so far.
    """
    config = _config(options)
    truth = None if options.relations is None else read_relations(locate(str(options.relations)))
    feed = _open(options)
    make_folder(options.out)
    compile_s = ensure_compiled(say, ("rbpf",))
    rbpf.hand_over_quickly()
    wall, cpu = time.monotonic(), time.process_time()
    mapper = rbpf.Mapper(config, seed=options.seed)
    way = _feed_all(mapper, feed.readings, options.log.name, _viewer(options, mapper))
    mapped = Mapped.by(mapper)
    known = {
        "log": options.log.name,
        "seed": options.seed,
        "particles": config.particles,
        "wall_s": round(time.monotonic() - wall, 3),
        "cpu_s": round(time.process_time() - cpu, 3),
        "compile_s": round(compile_s, 3),
    }
    results = results_of(mapped, feed.readings, way, truth, known)
    results.write(options.out)
    _report(results.metrics, options.out, options.as_json)
    if sum(way.refused.values()) > REFUSED_SAID * way.fed:
        say(_refused(way))
    if results.doubts.scans:
        say(results.doubts.text)
    if way.fed < len(feed.readings):
        say(f"interrupted after {way.fed} of {len(feed.readings)} scans: these are the results so far")
        raise typer.Exit(130)


def _refused(way: Way) -> str:
    """Return a line on the scans that were of no use."""
    count = sum(way.refused.values())
    reason, times = way.refused.most_common(1)[0]
    return f"{count} of {way.fed} scans were of no use, {times} of them: {reason}"


def _config(options: MapOptions) -> rbpf.MapperConfig:
    table = {"particles": options.particles, **({"use_odometry": False} if options.no_odometry else {})}
    return build_section(rbpf.MapperConfig, "rbpf", options.assignments, **table)


def _open(options: MapOptions) -> Feed:
    """Return the log's reader, after its notes have been printed."""
    feed = open_feed(locate(str(options.log)), salvage=options.salvage)
    for note in feed.notes:
        say(f"{options.log.name}: {note}")
    return feed


def _viewer(options: MapOptions, mapper: rbpf.Mapper) -> MapperWatcher | None:
    """Return what shows or records the mapper, None where nobody asked for it."""
    if options.rrd is None and not options.view:
        return None
    return watch_mapper(mapper, options.rrd, start_viewer() if options.view else None, options.log.stem)


def _feed_all(mapper: rbpf.Mapper, readings: Sequence[Reading], name: str, show: MapperWatcher | None) -> Way:
    """Map all readings, or those until Ctrl-C."""
    way = Way()
    with suppress(KeyboardInterrupt), progress_bar(f"mapping {name}", len(readings)) as advance:
        for index, reading in enumerate(readings):
            start = time.perf_counter()
            info = mapper.update(reading.scan, reading.T_odom_base)
            way.fed = index + 1
            if info.processed:
                way.processed_ms.append((time.perf_counter() - start) * 1e3)
            if info.reason is None:
                way.accepted.append(index)
                way.health.append(info.health)
            else:
                way.refused[info.reason] += 1
            if show is not None:
                show.on_scan(reading.scan)
            advance()
    if show is not None:
        show.close()
    return way


def _report(metrics: dict[str, Any], out: Path, as_json: bool) -> None:
    if as_json:
        print(json.dumps(metrics))
        return
    say(
        f"{metrics['scans']} scans, {metrics['scans_processed']} filter updates, {metrics['known_area_m2']:g} m2 in "
        f"{metrics['wall_s']:.1f} s ({metrics['cpu_s']:.1f} s of CPU, {metrics['peak_rss_mb']:.0f} MB)"
    )
    for name, found in metrics.get("relations", {}).items():
        used, given = found["relations"], found["relations_given"]
        text = f"none of {given} relations lies within it"
        if used:
            text = f"{found['mean_m']:.4f} m, {found['mean_deg']:.3f} deg over {used} of {given} relations"
        say(f"{name}: {text}")
    say(f"{out}/map.png, map.yaml, trajectory.tum, metrics.json")
