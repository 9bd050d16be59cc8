"""Commands on real robots and their network. What they do is in the file of their name, loaded when one runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mrslam.sim_driver.cli.commands.options import Connect, Fresh, Json, Listen, RobotOut, Set, Team


def agent(
    robot: Annotated[str, typer.Argument(help="The robot's name, unique in its team.")],
    team: Team = "team",
    listen: Listen = None,
    connect: Connect = None,
    multicast: Annotated[
        bool | None, typer.Option("--multicast/--no-multicast", help="Find teammates on the local network.")
    ] = None,
    keys: Annotated[Path | None, typer.Option("--keys", help="The robot's folder of the team's keys.")] = None,
    log: Annotated[
        Path | None, typer.Option("--log", help="Play a recorded log instead of listening to drivers.")
    ] = None,
    map_: Annotated[
        list[Path] | None,
        typer.Option(
            "--map", metavar="PATH", help="Saved map: .mrslam, folder of a robot or run, or YAML; repeatable."
        ),
    ] = None,
    near: Annotated[
        str | None,
        typer.Option("--near", metavar="X,Y[,THETA]", help="Where it begins in the saved map, in metres and radians."),
    ] = None,
    localise: Annotated[
        bool, typer.Option("--localise", help="Map only until it knows its place in the saved map; then track that.")
    ] = False,
    frame: Annotated[
        str | None,
        typer.Option(
            "--frame", metavar="MAP", help="Saved map in whose frame pose and team map are told: office@monday."
        ),
    ] = None,
    save: Annotated[
        Path | None,
        typer.Option("--save", metavar="FILE", help="At the end: saved maps and this session as one (.mrslam)."),
    ] = None,
    sensors: Annotated[
        str, typer.Option("--sensors", help="Where the robot's drivers send scans and odometry to.")
    ] = "tcp/127.0.0.1:7448",
    mode: Annotated[
        str, typer.Option("--mode", help="distributed, mapper (merges nothing) or central.")
    ] = "distributed",
    config: Annotated[Path | None, typer.Option("--config", help="TOML file of settings; see mrslam config.")] = None,
    out: RobotOut = None,
    fresh: Fresh = False,
    duration: Annotated[float | None, typer.Option("--duration", help="Stop after this many seconds.", min=0.0)] = None,
    seed: Annotated[int, typer.Option("--seed", help="Of the particle filter.", min=0)] = 0,
    set_: Set = None,
) -> None:
    """Run one robot's agent, on the robot, until Ctrl-C.

    It maps, meets teammates and merges; started again, it resumes from its checkpoint.

    mrslam agent r1 --team depot --listen tcp/0.0.0.0:7447 --connect tcp/10.0.0.2:7447
    mrslam agent r1 --team desk --log slam/intel.clf.gz    play a log as if it were the laser
    mrslam agent r1 --map office.mrslam --near 2,1.5        find its place in a map saved before
    mrslam agent r1 --map office@monday.mrslam --frame office@monday    ... and say where it is in that map's frame
    mrslam agent r1 --map office.mrslam --localise    ... and, once it knows that, track its pose and map no more
    mrslam agent r1 --map office.mrslam --save office.mrslam    ... and continue that map
    """
    if localise and not map_:
        raise typer.BadParameter("--localise needs a saved map: name it with --map")
    if save is not None:
        from mrslam.sim_driver.cli.maps.save import check_target

        check_target([*(map_ or [])], save)
    from mrslam.sim_driver.cli.live.agent import AgentOptions, run_agent

    framed = [] if frame is None else [f"agent.frame={frame}"]
    if localise:
        framed.append("agent.localise=true")
    options = AgentOptions(
        robot=robot, team=team, mode=mode, listen=listen or [], connect=connect or [],
        multicast=not connect if multicast is None else multicast, keys=keys, log=log, maps=map_ or [], near=near,
        sensors=sensors, config=config, assignments=[*(set_ or []), *framed],
        out=out or Path("out") / robot, fresh=fresh, duration_s=duration, seed=seed,
    )  # fmt: skip
    run_agent(options)
    if save is not None:
        from mrslam.sim_driver.cli.maps.save import SaveOptions, save_maps

        save_maps(SaveOptions(maps=[*options.maps, options.out], out=save))


def ros(
    context: typer.Context,
    robot: Annotated[str | None, typer.Argument(help="The robot's name, unique in its team.")] = None,
    team: Annotated[str | None, typer.Option("--team", help="The team's name.")] = None,
    listen: Listen = None,
    connect: Connect = None,
    out: RobotOut = None,
    fresh: Fresh = False,
    set_: Set = None,
) -> None:
    """Run one robot's agent as a ROS 2 node.

    Scans, odometry and tf in; maps, the transform map -> odom, teammates and services out. Every setting is a
    parameter, and so are keys, mode, maps, topics and frames: docs/robots.md. What follows --ros-args is ROS's:
    namespace, remappings, parameters.

    mrslam ros r1 --team depot --connect tcp/10.0.0.2:7447 --ros-args -r __ns:=/r1
    mrslam ros r1 --ros-args -p base_frame:=base_footprint -p rbpf.particles:=60 -p keys:=/etc/mrslam/r1
    """
    from mrslam.sim_driver.cli.live.ros import run_ros
    from mrslam.sim_driver.missions.settings import parse_assignment
    from mrslam.sim_driver.ros.parameters import parameter_of

    if robot is not None and robot.startswith(
        "-"
    ):  # mrslam ros --ros-args ...: the name is a parameter, or the namespace
        context.args.insert(0, robot)
        robot = None
    if context.args and context.args[0] != "--ros-args":
        word = context.args[0]
        name = parameter_of(word)
        does = "nor a parameter" if name is None else f"but a parameter, after --ros-args (-p {name}:=...)"
        raise typer.BadParameter(f"{word} is no option of this command, {does}: docs/robots.md")
    given = {
        "robot": robot, "team": team, "listen": listen or None, "connect": connect or None,
        "out": None if out is None else str(out), "fresh": fresh or None,
    }  # fmt: skip
    for path, value in map(parse_assignment, set_ or []):
        given[".".join(path)] = value
    run_ros({name: value for name, value in given.items() if value is not None}, context.args)


def top(
    team: Annotated[str | None, typer.Option("--team", help="Show this team only (mission.name).")] = None,
    listen: Annotated[
        list[str] | None, typer.Option("--listen", metavar="ENDPOINT", help="Endpoint to be reached at; none unasked.")
    ] = None,
    connect: Annotated[
        list[str] | None,
        typer.Option("--connect", metavar="ENDPOINT", help="Endpoint of a robot or router, tcp/192.168.1.5:7447."),
    ] = None,
    keys: Annotated[Path | None, typer.Option("--keys", help="A robot's key folder, to see a closed team.")] = None,
    multicast: Annotated[bool, typer.Option("--multicast/--no-multicast", help="Look around by multicast.")] = True,
    once: Annotated[bool, typer.Option("--once", help="Show one snapshot and stop.")] = False,
    wait: Annotated[float, typer.Option("--wait", help="Longest wait for somebody, seconds.", min=0.0)] = 5.0,
    json: Json = False,
) -> None:
    """Show who is here, how good links are, and what is exchanged.

    mrslam top                   in a second terminal, while mrslam demo runs
    mrslam top --once --json     for scripts; exit code 1 where nobody is here
    """
    from mrslam.sim_driver.cli.live.top import TopOptions
    from mrslam.sim_driver.cli.live.top import top as show_top

    options = TopOptions(
        team=team, listen=listen or [], connect=connect or [], keys=keys, multicast=multicast, once=once, wait_s=wait,
        as_json=json,
    )  # fmt: skip
    show_top(options)


def doctor(
    listen: Annotated[
        list[str] | None, typer.Option("--listen", metavar="ENDPOINT", help="Endpoint to listen on, tcp/0.0.0.0:7447.")
    ] = None,
    connect: Annotated[
        list[str] | None, typer.Option("--connect", metavar="ENDPOINT", help="Endpoint of a teammate to reach.")
    ] = None,
    multicast: Annotated[bool, typer.Option("--multicast/--no-multicast", help="Try multicast discovery.")] = True,
    json: Json = False,
) -> None:
    """Look at this machine's network as robots will use it.

    Says plainly what is wrong. Takes up to half a minute.

    mrslam doctor --listen tcp/0.0.0.0:7447 --connect tcp/192.168.1.5:7447
    """
    from mrslam.sim_driver.cli.live.network import diagnose

    diagnose(listen or [], connect or [], multicast, json)


def keys(
    team: Annotated[str, typer.Argument(help="The team's name, as in mission.name.")],
    robots: Annotated[list[str] | None, typer.Argument(help="Robots to make keys for.")] = None,
    router: Annotated[
        list[str] | None, typer.Option("--router", metavar="NAME", help="A router; may be given often.")
    ] = None,
    out: Annotated[Path, typer.Option("--out", help="Folder for the keys; one folder a robot in it.")] = Path("keys"),
    days: Annotated[float, typer.Option("--days", help="Lifetime of new certificates, days.")] = 3650.0,
    renew: Annotated[
        bool, typer.Option("--renew", help="Sign the certificates of robots that have one again; their keys stay.")
    ] = False,
    revoke: Annotated[
        list[str] | None,
        typer.Option("--revoke", metavar="NAME", help="A robot that is of the team no more; may be given often."),
    ] = None,
) -> None:
    """Make, renew and revoke a team's certificates.

    With them only the team's own robots are heard, each under its own name.

    mrslam keys demo r1 r2 r3 --out keys
    mrslam agent r1 --team demo --keys keys/r1
    """
    from mrslam.sim_driver.cli.live.network import make_keys, revoke_keys

    if revoke:
        revoke_keys(team, revoke, out)
    if robots or router or not revoke:
        make_keys(team, robots or [], router or [], out, days=days, renew=renew)


def config(
    expert: Annotated[
        bool, typer.Option("--expert", help="Also those whose defaults hardly anyone should change.")
    ] = False,
) -> None:
    """Print the settings with their defaults and what they do.

    mrslam config | grep -A 1 timeout
    """
    from mrslam.sim_driver.cli.config import print_reference

    print_reference(expert)
