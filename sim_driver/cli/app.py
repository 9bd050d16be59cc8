"""The sub-commands and their options. Imports of the heavy packages wait until a command runs."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(
    name="mrslam",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Multi-robot 2-D lidar SLAM: robots map, meet, and their maps find each other.\n\n"
    "mrslam demo                                  three robots explore a building and merge their maps\n\n"
    "mrslam map LOG                               map a recorded log\n\n"
    "mrslam run missions/intel-two.toml           two robots, two processes, real network",
)

Out = Annotated[Path, typer.Option("--out", help="Folder for everything the command leaves.")]
Seed = Annotated[int | None, typer.Option("--seed", help="Everything random follows from it.")]
Set = Annotated[list[str] | None, typer.Option("--set", help="A setting, section.key=value; may be given often.")]
Rrd = Annotated[Path | None, typer.Option("--rrd", help="Also write a recording for the viewer (mrslam view).")]
View = Annotated[bool, typer.Option("--view", help="Open a viewer and watch.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Salvage = Annotated[bool, typer.Option("--salvage", help="Use the scans before the place where a log was cut off.")]


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"mrslam {version('mrslam')}")
        raise typer.Exit


@app.callback()
def mrslam(
    show: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and stop.")
    ] = False,
) -> None:
    """Take the options that belong to no sub-command."""


@app.command()
def map(
    log: Annotated[Path, typer.Argument(help="Recorded log; its format is guessed from its name.")],
    particles: Annotated[int, typer.Option("--particles", help="Particles of the filter.", min=1)] = 30,
    seed: Annotated[int, typer.Option("--seed", help="One seed gives the same bytes.")] = 0,
    out: Out = Path("out/map"),
    no_odometry: Annotated[bool, typer.Option("--no-odometry", help="Do without the log's odometry.")] = False,
    relations: Annotated[
        Path | None, typer.Option("--relations", help="Relations file (t1 t2 x y z roll pitch yaw): print the errors.")
    ] = None,
    salvage: Salvage = False,
    rrd: Rrd = None,
    view: View = False,
    set_: Set = None,
    json: Json = False,
) -> None:
    """Map one recorded log and write map, trajectory and metrics; interrupted, it writes what it has.

    mrslam map intel.clf.gz --particles 30 --seed 1 --out out/intel
    """
    from sim_driver.cli.map_log import map_log

    map_log(log, particles, seed, out, no_odometry, set_ or [], json, rrd, view, relations, salvage)


@app.command()
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
    seed: Seed = None,
    rrd: Rrd = None,
    view: View = False,
    set_: Set = None,
    json: Json = False,
) -> None:
    """Run a mission of several robots and write their maps, merges and metrics.

    mrslam run missions/intel-two.toml --out out/intel-two --set comms.exchange_timeout_s=10

    mrslam run --from out/intel-two --out out/again --set comms.link_threshold=0.5
    """
    from sim_driver.cli.run import run_file

    run_file(mission, from_, out, shell, speed, seed, set_ or [], json, rrd, view)


@app.command()
def align(
    a: Annotated[Path, typer.Argument(help="Map: .yaml with its image, a bare image, or .npz.")],
    b: Annotated[Path | None, typer.Argument(help="The other map; left out for an .npz that holds both.")] = None,
    method: Annotated[str, typer.Option("--method", help="auto, orb, surf, hough, random-walk, ...")] = "auto",
    resolution: Annotated[float | None, typer.Option("--resolution", help="Metres a cell, for bare images.")] = None,
    set_: Set = None,
    json: Json = False,
) -> None:
    """Find how two maps fit together, or say why they do not. Both are answers: the exit code is 0 either way.

    mrslam align a/map.yaml b/map.yaml --json
    """
    from sim_driver.cli.align import align_files

    align_files(a, b, method, resolution, set_ or [], json)


@app.command()
def merge(
    maps: Annotated[list[Path], typer.Argument(help="Two or more maps: .yaml, bare images or .npz.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Merged map: a .yaml file, or a folder.")] = Path(
        "out/merged"
    ),
    known_poses: Annotated[
        Path | None, typer.Option("--known-poses", help="CSV: map, x_m, y_m, theta_rad a line.")
    ] = None,
    method: Annotated[str, typer.Option("--method", help="auto, orb, surf, hough, random-walk, ...")] = "auto",
    resolution: Annotated[float | None, typer.Option("--resolution", help="Metres a cell, for bare images.")] = None,
    set_: Set = None,
    json: Json = False,
) -> None:
    """Merge map files of any SLAM system; maps that do not fit are named with the reason (the exit code stays 0).

    mrslam merge a/map.yaml b/map.yaml -o out/merged
    """
    from sim_driver.cli.merge import merge_files

    merge_files(maps, out, known_poses, method, resolution, set_ or [], json)


@app.command()
def demo(
    out: Out = Path("out/demo"),
    seed: Annotated[int, typer.Option("--seed", help="Another seed, another story.")] = 1,
    robots: Annotated[int, typer.Option("--robots", help="How many robots.", min=1, max=8)] = 3,
    rrd: Rrd = None,
    view: View = False,
) -> None:
    """Robots explore a small building from unknown starts, meet, and merge their maps. Takes about two minutes.

    mrslam demo --out out/demo --seed 7 --robots 2
    """
    from sim_driver.cli.demo import demo as run_demo

    run_demo(out, seed, robots, rrd, view)


@app.command(name="view")
def view_(
    run: Annotated[Path, typer.Argument(help="Folder of a run that was recorded with --rrd, or an .rrd file.")],
) -> None:
    """Open a run's recording in the viewer.

    mrslam demo --out out/demo --rrd out/demo/run.rrd

    mrslam view out/demo
    """
    from sim_driver.view.files import open_recording

    open_recording(run)


@app.command()
def report(
    run: Annotated[Path, typer.Argument(help="Folder of a finished run.")],
    out: Annotated[Path | None, typer.Option("--out", help="The page; report.html in the folder unless given.")] = None,
) -> None:
    """Make a run's report.html anew: one page with everything that happened, for any browser, without a network.

    mrslam report out/demo
    """
    from sim_driver.cli.report import report_run

    report_run(run, out)


@app.command()
def bag(
    run: Annotated[Path, typer.Argument(help="Folder of a finished run, or of mrslam map.")],
    out: Annotated[
        Path | None, typer.Option("--out", help="The .mcap file; run.mcap in the folder unless given.")
    ] = None,
) -> None:
    """Write maps, ways and scans of a run as a ROS2 recording (mcap) for ROS viewers; needs no ROS.

    mrslam bag out/demo --out demo.mcap
    """
    from sim_driver.cli.bag import bag_run

    bag_run(run, out)


@app.command()
def sweep(
    mission: Annotated[Path, typer.Argument(help="Mission file (TOML).")],
    vary: Annotated[
        list[str] | None, typer.Option("--vary", help="section.key=value,value,... ; may be given often.")
    ] = None,
    seeds: Annotated[
        int | None, typer.Option("--seeds", help="Runs of every setting, each with its own seed.", min=1)
    ] = None,
    out: Out = Path("out/sweep"),
    drive: Annotated[
        str,
        typer.Option(
            "--drive",
            help="recorded: all settings of a seed meet one drive; anew: robots drive by what they know; "
            "auto: recorded where the knobs allow it.",
        ),
    ] = "auto",
    workers: Annotated[int | None, typer.Option("--workers", help="Processes; as many as cores unless given.")] = None,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", help="Dask scheduler to run on, tcp://host:8786.")
    ] = None,
    set_: Set = None,
    json: Json = False,
) -> None:
    """Run a mission under every combination of settings; a sweep that was stopped goes on where it was.

    mrslam sweep missions/office-two.toml

    mrslam sweep missions/office.toml --vary comms.link_threshold=0.2,0.5,0.8,0.95
    --vary comms.exchange_timeout_s=5,10,30,60 --seeds 5 --out out/sweep
    """
    from sim_driver.cli.sweep import sweep as run_sweep

    run_sweep(mission, vary or [], seeds, out, drive, workers, scheduler, set_ or [], json)


@app.command(name="eval")
def eval_(
    run: Annotated[Path, typer.Argument(help="Folder of a finished run.")],
    relations: Annotated[
        Path | None, typer.Option("--relations", help="Relations file, instead of the mission's.")
    ] = None,
    reference: Annotated[
        list[str] | None, typer.Option("--reference", help="TUM file of true poses, FILE or ROBOT=FILE.")
    ] = None,
    true_map: Annotated[Path | None, typer.Option("--true-map", help="True map, for runs without a world.")] = None,
    json: Json = False,
) -> None:
    """Judge a run: trajectories, maps, merges and traffic, by whatever truth there is.

    mrslam eval out/demo

    mrslam eval out/run --reference r1=truth_r1.tum --reference r2=truth_r2.tum --true-map plan.yaml
    """
    from sim_driver.cli.eval import eval_run

    eval_run(run, relations, reference or [], true_map, json)


@app.command()
def feed(
    log: Annotated[Path, typer.Argument(help="Recorded log.")], salvage: Salvage = False, json: Json = False
) -> None:
    """Say what is in a recorded log, and what is missing.

    mrslam feed intel.clf.gz
    """
    from sim_driver.cli.feed import inspect_file

    inspect_file(log, json, salvage)


@app.command()
def keys(
    team: Annotated[str, typer.Argument(help="The team's name, as in mission.name.")],
    robots: Annotated[list[str], typer.Argument(help="Robots to make keys for.")],
    router: Annotated[list[str] | None, typer.Option("--router", help="A router; may be given often.")] = None,
    out: Annotated[Path, typer.Option("--out", help="Folder for the keys; one folder a robot in it.")] = Path("keys"),
) -> None:
    """Make a team's certificates: with them only its own robots are heard, each under its own name.

    mrslam keys demo r1 r2 r3 --out keys
    """
    from sim_driver.cli.network import make_keys

    make_keys(team, robots, router or [], out)


@app.command()
def doctor(
    listen: Annotated[
        list[str] | None, typer.Option("--listen", help="Endpoint to listen on, tcp/0.0.0.0:7447.")
    ] = None,
    connect: Annotated[list[str] | None, typer.Option("--connect", help="Endpoint of a teammate to reach.")] = None,
    multicast: Annotated[bool, typer.Option("--multicast/--no-multicast", help="Try multicast discovery.")] = True,
    json: Json = False,
) -> None:
    """Look at this machine's network as robots will use it, and say plainly what is wrong.

    mrslam doctor --listen tcp/0.0.0.0:7447 --connect tcp/192.168.1.5:7447
    """
    from sim_driver.cli.network import diagnose

    diagnose(listen or [], connect or [], multicast, json)


@app.command()
def agent(
    robot: Annotated[str, typer.Argument(help="The robot's name, unique in its team.")],
    team: Annotated[str, typer.Option("--team", help="The team's name.")] = "team",
    listen: Annotated[list[str] | None, typer.Option("--listen", help="tcp/0.0.0.0:7447; several are fine.")] = None,
    connect: Annotated[list[str] | None, typer.Option("--connect", help="A teammate's or router's address.")] = None,
    multicast: Annotated[
        bool | None, typer.Option("--multicast/--no-multicast", help="Find teammates on the local network.")
    ] = None,
    keys: Annotated[Path | None, typer.Option("--keys", help="The robot's folder of the team's keys.")] = None,
    log: Annotated[
        Path | None, typer.Option("--log", help="Play a recorded log instead of listening to drivers.")
    ] = None,
    sensors: Annotated[
        str, typer.Option("--sensors", help="Where the robot's drivers send scans and odometry to.")
    ] = "tcp/127.0.0.1:7448",
    mode: Annotated[
        str, typer.Option("--mode", help="distributed, mapper (merges nothing) or central.")
    ] = "distributed",
    config: Annotated[Path | None, typer.Option("--config", help="TOML file of settings; see mrslam config.")] = None,
    out: Annotated[Path | None, typer.Option("--out", help="The robot's folder; out/ROBOT unless given.")] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Begin a new map though there is a checkpoint.")] = False,
    duration: Annotated[float | None, typer.Option("--duration", help="Stop after so many seconds.")] = None,
    seed: Annotated[int, typer.Option("--seed", help="Of the particle filter.")] = 0,
    set_: Set = None,
) -> None:
    """Run one robot's agent, on the robot: map, meet teammates, merge, until Ctrl-C. It goes on from its checkpoint.

    mrslam agent r1 --team depot --listen tcp/0.0.0.0:7447 --connect tcp/10.0.0.2:7447

    mrslam agent r1 --team desk --log intel.clf.gz           play a log as if it were the laser
    """
    from sim_driver.cli.agent import AgentOptions, run_agent

    options = AgentOptions(
        robot=robot, team=team, mode=mode, listen=listen or [], connect=connect or [],
        multicast=not connect if multicast is None else multicast, keys=keys, log=log, sensors=sensors, config=config,
        assignments=set_ or [], out=out or Path("out") / robot, fresh=fresh, duration_s=duration, seed=seed,
    )  # fmt: skip
    run_agent(options)


@app.command()
def top(
    team: Annotated[str | None, typer.Option("--team", help="Show this team only (mission.name).")] = None,
    listen: Annotated[
        list[str] | None, typer.Option("--listen", help="Endpoint to be reached at; none unasked.")
    ] = None,
    connect: Annotated[
        list[str] | None, typer.Option("--connect", help="Endpoint of a robot or router, tcp/192.168.1.5:7447.")
    ] = None,
    keys: Annotated[Path | None, typer.Option("--keys", help="A robot's key folder, to see a closed team.")] = None,
    multicast: Annotated[bool, typer.Option("--multicast/--no-multicast", help="Look around by multicast.")] = True,
    once: Annotated[bool, typer.Option("--once", help="Show one snapshot and stop.")] = False,
    wait: Annotated[float, typer.Option("--wait", help="Longest wait for somebody, seconds.", min=0.0)] = 5.0,
    json: Json = False,
) -> None:
    """Show who is here, how good their links are, what they exchange, and how their maps fit together.

    mrslam top                                   in a second terminal, while mrslam demo runs

    mrslam top --once --json                     for scripts; exit code 1 where nobody is here
    """
    from sim_driver.cli.top import top as show_top

    show_top(team, listen or [], connect or [], keys, multicast, once, json, wait)


@app.command()
def config() -> None:
    """Print every setting with its default and what it does.

    mrslam config | grep -A 1 timeout
    """
    from sim_driver.cli.config import print_reference

    print_reference()
