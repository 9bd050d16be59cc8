"""Commands on missions and what they leave. What they do is in the file of their name, loaded when one runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mrslam.sim_driver.cli.commands.options import Json, Out, Rrd, Seed, Set, View


def demo(
    out: Out = Path("out/demo"),
    seed: Annotated[int, typer.Option("--seed", help="Another seed, another story.", min=0)] = 1,
    robots: Annotated[int, typer.Option("--robots", help="How many robots.", min=1, max=8)] = 3,
    rrd: Rrd = None,
    view: View = False,
) -> None:
    """Robots explore a small building, meet, and merge their maps.

    Each robot is a process of its own and knows nothing of the others' starts. Takes about two minutes.

    mrslam demo --out out/demo
    mrslam demo --out out/demo7 --seed 7 --robots 2
    """
    from mrslam.sim_driver.cli.runs.demo import demo as run_demo

    run_demo(out, seed, robots, rrd, view)


def run(
    mission: Annotated[Path | None, typer.Argument(help="Mission file (TOML).")] = None,
    out: Out = Path("out/run"),
    from_: Annotated[
        Path | None,
        typer.Option("--from", help="Folder of a run to play again: same drive, same radio, other settings."),
    ] = None,
    shell: Annotated[
        str | None, typer.Option("--shell", help="process (real processes) or virtual (virtual time).")
    ] = None,
    speed: Annotated[float | None, typer.Option("--speed", help="Mission seconds in a second (process shell).")] = None,
    processes: Annotated[
        int | None,
        typer.Option(
            "--processes", help="Processes in virtual time, the same bytes with any; as fit cores and robots.", min=1
        ),
    ] = None,
    seed: Seed = None,
    rrd: Rrd = None,
    view: View = False,
    set_: Set = None,
    json: Json = False,
) -> None:
    """Run a mission of several robots, or play a run again.

    Leaves their maps, merges and metrics. A mission that ships is run by its name, from any folder.

    mrslam run office
    mrslam run missions/intel-two.toml --out out/intel-two --set comms.exchange_timeout_s=10
    mrslam run --from out/intel-two --out out/again --set comms.link_threshold=0.5
    """
    from mrslam.sim_driver.cli.runs.run import RunOptions, run_file

    options = RunOptions(
        mission=mission, recorded=from_, out=out, shell=shell, speed=speed, seed=seed, assignments=set_ or [], rrd=rrd,
        view=view, as_json=json, processes=processes or 0,
    )  # fmt: skip
    run_file(options)


def sweep(
    mission: Annotated[Path, typer.Argument(help="Mission file (TOML).")],
    vary: Annotated[
        list[str] | None,
        typer.Option("--vary", metavar="SECTION.KEY=VALUE,VALUE...", help="What to vary; may be given often."),
    ] = None,
    seeds: Annotated[
        int | None, typer.Option("--seeds", help="Runs of every setting, each with its own seed.", min=1)
    ] = None,
    out: Out = Path("out/sweep"),
    drive: Annotated[
        str,
        typer.Option(
            "--drive",
            help="recorded: all settings of a seed replay one drive; anew: robots drive by what they know; "
            "auto: recorded where the settings varied allow it.",
        ),
    ] = "auto",
    workers: Annotated[
        int | None, typer.Option("--workers", help="Processes; as many as cores unless given.", min=1)
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", help="Dask scheduler to run on, tcp://host:8786.")
    ] = None,
    set_: Set = None,
    json: Json = False,
) -> None:
    """Run a mission under every combination of settings.

    The same command resumes a sweep that was stopped.

    mrslam sweep missions/office-two.toml
    mrslam sweep office --vary comms.link_threshold=0.2,0.5,0.8 --vary comms.exchange_timeout_s=5,30 --seeds 3
    """
    from mrslam.sim_driver.cli.runs.sweep import SweepOptions
    from mrslam.sim_driver.cli.runs.sweep import sweep as run_sweep

    options = SweepOptions(
        mission=mission, vary=vary or [], seeds=seeds, out=out, drive=drive, workers=workers, scheduler=scheduler,
        assignments=set_ or [], as_json=json,
    )  # fmt: skip
    run_sweep(options)


def eval_(
    run: Annotated[Path, typer.Argument(help="Folder of a finished run.")],
    relations: Annotated[
        Path | None, typer.Option("--relations", help="Relations file, instead of the mission's.")
    ] = None,
    reference: Annotated[
        list[str] | None,
        typer.Option("--reference", metavar="[ROBOT=]FILE", help="TUM file of true poses; may be given often."),
    ] = None,
    true_map: Annotated[Path | None, typer.Option("--true-map", help="True map, for runs without a world.")] = None,
    json: Json = False,
) -> None:
    """Judge a run by whatever truth there is.

    Trajectories, maps, merges and traffic; what cannot be judged is said.

    mrslam eval out/demo
    mrslam eval out/run --reference r1=truth_r1.tum --reference r2=truth_r2.tum --true-map plan.yaml
    """
    from mrslam.sim_driver.cli.runs.eval import eval_run

    eval_run(run, relations, reference or [], true_map, json)


def gather(
    folders: Annotated[list[Path], typer.Argument(help="Folders of agents, or one that holds several.")],
    out: Out = Path("out/gathered"),
    json: Json = False,
) -> None:
    """Put folders of agents together as a run.

    Copy what mrslam agent left on each robot to one machine first. The result can be judged and read as any run's.

    mrslam gather from-r1 from-r2 --out out/depot
    mrslam eval out/depot --reference r1=truth_r1.tum --reference r2=truth_r2.tum
    """
    from mrslam.sim_driver.cli.runs.gather import gather_agents

    gather_agents(folders, out, json)


def report(
    run: Annotated[Path, typer.Argument(help="Folder of a finished run.")],
    out: Annotated[Path | None, typer.Option("--out", help="The page; report.html in the folder unless given.")] = None,
) -> None:
    """Make a run's report.html again.

    One page with everything that happened, for any browser, without a network.

    mrslam report out/demo
    """
    from mrslam.sim_driver.cli.runs.report import report_run

    report_run(run, out)


def view_(
    run: Annotated[Path, typer.Argument(help="Folder of a run that was recorded with --rrd, or an .rrd file.")],
) -> None:
    """Open a run's recording in the viewer.

    mrslam demo --out out/demo --rrd out/demo/run.rrd
    mrslam view out/demo
    """
    from mrslam.sim_driver.view.files import open_recording

    open_recording(run)


def bag(
    run: Annotated[Path, typer.Argument(help="Folder of a finished run, or of mrslam map.")],
    out: Annotated[
        Path | None, typer.Option("--out", help="The .mcap file; run.mcap in the folder unless given.")
    ] = None,
) -> None:
    """Write a run as a ROS2 recording (mcap); needs no ROS.

    Maps, ways and (of simulated robots) scans, for the viewers of that world.

    mrslam bag out/demo --out demo.mcap
    """
    from mrslam.sim_driver.cli.runs.bag import bag_run

    bag_run(run, out)
