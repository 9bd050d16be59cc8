"""``mrslam run``: a mission file, from start to metrics."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import typer

from mrslam.sim_driver.cli.console import say
from mrslam.sim_driver.cli.progress import mission_progress
from mrslam.sim_driver.cli.signals import interrupts_noted
from mrslam.sim_driver.evaluate.in_saved_maps import as_words
from mrslam.sim_driver.evaluate.network import compared
from mrslam.sim_driver.evaluate.sides import apart_text, merged_text
from mrslam.sim_driver.missions.mission import Mission, load_mission
from mrslam.sim_driver.missions.run_files import REPORT_FILE
from mrslam.sim_driver.replay.again import replay_mission
from mrslam.sim_driver.report import write_report
from mrslam.sim_driver.run import run as runs
from mrslam.sim_driver.run.run_shares import processes_for
from mrslam.sim_driver.simulation.simulation import make_world
from mrslam.sim_driver.view import ViewOptions
from mrslam.sim_driver.view.files import join_recordings, start_viewer
from mrslam.spatial.files.atomic import make_folder


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """What the command line says; what it does not say is None."""

    mission: Path | None
    recorded: Path | None
    """Folder of a run to replay, in place of a mission."""
    out: Path
    shell: str | None
    speed: float | None
    seed: int | None
    assignments: list[str]
    rrd: Path | None
    view: bool
    as_json: bool
    processes: int = 0
    """In virtual time, at most; 0: as many as fit cores and robots."""

    @property
    def overrides(self) -> list[str]:
        """All settings that the command line lays over the mission's, ``section.key=value``."""
        named = {"shell": self.shell, "speed": self.speed, "seed": self.seed}
        return [f"mission.{key}={json.dumps(value)}" for key, value in named.items() if value is not None] + [
            *self.assignments
        ]


def run_file(options: RunOptions) -> None:
    """Run a mission file, or replay a recorded run."""
    start = time.monotonic()
    mission = _mission(options)
    _say_scale(mission)
    metrics = run_with_progress(mission, options.out, options.rrd, options.view, options.processes)
    if options.as_json:
        print(json.dumps(metrics))
    else:
        report(metrics, options.out, time.monotonic() - start)
    end_as_interrupted(metrics)


def _mission(options: RunOptions) -> Mission:
    """Return the mission; raise ``typer.BadParameter`` for options that contradict each other."""
    if options.mission is not None and options.recorded is None:
        return load_mission(options.mission, options.overrides)
    if options.recorded is None or options.mission is not None:
        raise typer.BadParameter("name either a mission file, or --from the folder of a run to play again")
    if (options.shell, options.speed) != (None, None):
        raise typer.BadParameter("--from plays in virtual time; --shell and --speed have no meaning with it")
    if options.out.resolve() == options.recorded.resolve():
        raise typer.BadParameter("--out must be another folder than --from")
    return replay_mission(options.recorded, options.overrides)


def _say_scale(mission: Mission) -> None:
    """Say how large a bitmap is taken to be where the mission does not."""
    world = mission.world
    if world is None or world.scale_m is not None or Path(world.name).suffix.lower() in ("", ".yaml", ".yml"):
        return
    made = make_world(mission)
    width_m, height_m = made.size_m
    say(f"{world.name}: {made.resolution_m:g} m a pixel, {width_m:.1f} x {height_m:.1f} m; world.scale_m changes it")


def run_with_progress(
    mission: Mission, out: Path, rrd: Path | None = None, view: bool = False, processes: int = 0
) -> dict[str, Any]:
    """Run a mission with a progress bar, and write its report and, if asked for, its recording."""
    if rrd is not None:
        make_folder(rrd.parent)
    if rrd is not None or view:
        options = ViewOptions(
            record=rrd is not None,
            address=start_viewer() if view else None,
            run_id=f"{mission.mission.name}-{mission.mission.seed}",
            robots=tuple(robot.id for robot in mission.robots),
        )
        mission = replace(mission, view=options)
    with mission_progress(mission.mission.name) as progress:
        shares = processes_for(mission, processes)
        metrics = runs.run_mission(mission, out, progress, say, interrupts_noted, shares)
    if len(metrics["robots_lost"]) < len(mission.robots):
        write_report(out)
    if rrd is not None:
        join_recordings([mission.view.file_of(out / robot.id) for robot in mission.robots], rrd)
    return metrics


def report(metrics: dict[str, Any], out: Path, wall_s: float) -> None:
    """Print the outcome of a mission: its pairs, links, and robots that were lost."""
    for pair in metrics["pairs"]:
        if pair["status"] != "accepted":
            say(apart_text(pair))
            continue
        error = "" if pair["error_m"] is None else f", {pair['error_m']:.3f} m / {pair['error_deg']:.2f} deg off"
        say(f"{merged_text(pair)} (confidence {pair['confidence']:.2f}{error})")
    for link in metrics["links"]:
        if link["bytes_full_lz4"]:  # two base stations have nothing to give each other
            say(
                f"{link['a']}-{link['b']}: {link['exchanges']} exchanges, {link['bytes_sent'] / 1e3:.1f} kB "
                f"({compared(link['bytes_sent'], link['bytes_full_lz4'])} than whole maps with LZ4)"
            )
    for row in metrics.get("saved_maps", ()):
        say(as_words(row))
    for robot in metrics["robots_lost"]:
        say(f"{robot} was lost: see {out / robot}")
    if late := {robot: count for robot, count in metrics.get("scans_lost", {}).items() if count}:
        counts = ", ".join(f"{robot} {count}" for robot, count in late.items())
        say(f"scans left out because newer ones were there before they could be taken: {counts}")
    say(f"{metrics['mission_s']:.0f} s of mission in {wall_s:.0f} s; look at {out / REPORT_FILE}")


def end_as_interrupted(metrics: dict[str, Any]) -> None:
    """End the command as Ctrl-C does where the mission was interrupted."""
    if metrics.get("interrupted"):
        say(f"interrupted after {metrics['mission_s']:.0f} s of mission: these are the results so far")
        raise typer.Exit(130)
