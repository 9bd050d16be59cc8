"""Commands on logs and maps. What they do is in the file of their name, loaded when one runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mrslam.sim_driver.cli.commands.options import Json, Out, Rrd, Salvage, Set, View

METHODS = (
    "auto, orb, surf, hough, random-walk, plain-walk, multi-point-hill-climb, hill-climb, simulated-annealing, "
    "annealing or brute-force."
)
"""Help on ``--method``: the keys of ``mrslam.alignment.ALIGNERS``, which must not be imported for a help text."""


def map_(
    log: Annotated[Path, typer.Argument(help="Recorded log; its format is guessed from its name.")],
    particles: Annotated[int, typer.Option("--particles", help="Particles of the filter.", min=1, max=1000)] = 30,
    seed: Annotated[int, typer.Option("--seed", help="One seed gives the same bytes.", min=0)] = 0,
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
    """Map one recorded log.

    Writes map, trajectory and metrics; interrupted, it writes what it has.

    mrslam map slam/intel.clf.gz --particles 30 --seed 1 --out out/intel
    mrslam map monday.bag --no-odometry --out out/monday
    """
    from mrslam.sim_driver.cli.maps.map_log import MapOptions, map_log

    options = MapOptions(
        log=log, particles=particles, seed=seed, out=out, no_odometry=no_odometry, relations=relations, salvage=salvage,
        assignments=set_ or [], rrd=rrd, view=view, as_json=json,
    )  # fmt: skip
    map_log(options)


def feed(
    log: Annotated[Path, typer.Argument(help="Recorded log.")], salvage: Salvage = False, json: Json = False
) -> None:
    """Say what is in a recorded log, and what is missing.

    mrslam feed slam/intel.clf.gz
    mrslam feed monday.bag --json
    """
    from mrslam.sim_driver.cli.live.feed import inspect_file

    inspect_file(log, json, salvage)


def align(
    a: Annotated[Path, typer.Argument(help="Map: .yaml with its image, .mrslam, a bare image, .npz, or a folder.")],
    b: Annotated[Path | None, typer.Argument(help="The other map; left out for an .npz that holds both.")] = None,
    method: Annotated[str, typer.Option("--method", help=METHODS)] = "auto",
    resolution: Annotated[
        float | None, typer.Option("--resolution", help="Metres a cell, for images without YAML.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option("--picture", help="PNG of the fit, of its rival, and of what contradicts.")
    ] = None,
    set_: Set = None,
    json: Json = False,
) -> None:
    """Find how two maps fit together, or say why they do not.

    All are answers, "ambiguous" with the places that look alike too: the exit code is 0 either way.

    mrslam align a/map.yaml b/map.yaml --json
    mrslam align a.png b.png --resolution 0.05 --method surf --picture fit.png
    """
    from mrslam.sim_driver.cli.maps.align import align_files

    align_files(a, b, method, resolution, set_ or [], json, picture)


def merge(
    maps: Annotated[
        list[Path], typer.Argument(help="Two or more maps: .yaml, images, .npz, or folders of robots or runs.")
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="Merged map: a .yaml file, or a folder.")] = Path(
        "out/merged"
    ),
    known_poses: Annotated[
        Path | None, typer.Option("--known-poses", help="CSV: map, x_m, y_m, theta_rad a line.")
    ] = None,
    method: Annotated[str, typer.Option("--method", help=METHODS)] = "auto",
    resolution: Annotated[
        float | None, typer.Option("--resolution", help="Metres a cell, for images without YAML.")
    ] = None,
    pictures: Annotated[
        bool, typer.Option("--pictures", help="Also write a picture of how each pair of maps fits, or why not.")
    ] = False,
    set_: Set = None,
    json: Json = False,
) -> None:
    """Merge map files of any SLAM system.

    Maps of this one bring what was seen on the way (keyframes.npz beside the map) and are bent until that agrees;
    others are laid over each other as they are; how far that is off is said.

    Maps that do not fit are named with the reason (the exit code stays 0).

    mrslam merge a/map.yaml b/map.yaml c/map.yaml -o out/merged
    mrslam merge out/monday out/tuesday/r1 -o out/both
    mrslam merge a/map.yaml b/map.yaml --known-poses poses.csv -o out/merged
    mrslam merge office.mrslam out/tuesday -o office.mrslam    a saved map; as mrslam save
    """
    if out.suffix == ".mrslam":
        if known_poses is not None or resolution is not None or pictures:
            raise typer.BadParameter(
                "a saved map is made of maps that find each other: no known poses, resolution or pictures"
            )
        save(maps, out, method, set_, json)
        return
    from mrslam.sim_driver.cli.maps.merge import merge_files

    merge_files(maps, out, known_poses, method, resolution, set_ or [], json, pictures)


def save(
    maps: Annotated[
        list[Path], typer.Argument(help="Maps, oldest first: .mrslam, .yaml, or folders of robots or runs.")
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="Saved map: a .mrslam file, or a folder for map servers.")],
    method: Annotated[str, typer.Option("--method", help=METHODS)] = "auto",
    set_: Set = None,
    json: Json = False,
) -> None:
    """Save one session, or several of one building, as one map to come back to.

    Several are bent until what was seen agrees; where they contradict each other what was seen later wins, so the
    oldest comes first. The map keeps the first one's frame. Written over that one, it is its next version.

    mrslam save out/monday -o office.mrslam
    mrslam save office.mrslam out/tuesday -o office.mrslam    continue it
    mrslam save office.mrslam -o out/office                   map.yaml and map.pgm, as map servers read them
    """
    from mrslam.sim_driver.cli.maps.save import SaveOptions, save_maps

    save_maps(SaveOptions(maps=maps, out=out, method=method, assignments=set_ or [], as_json=json))


def diff(
    before: Annotated[Path, typer.Argument(help="The earlier map: .mrslam, .yaml, or a robot's folder.")],
    after: Annotated[Path, typer.Argument(help="The later map.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder for diff.png and diff.json.")] = Path("out/diff"),
    same_frame: Annotated[
        bool, typer.Option("--same-frame", help="The maps lie over each other already: do not align them.")
    ] = False,
    near: Annotated[
        float, typer.Option("--near", help="Walls this near are the same wall, metres.", min=0.0, max=1.0)
    ] = 0.1,
    least: Annotated[
        float, typer.Option("--least", help="Smaller pieces are left out, square metres.", min=0.0)
    ] = 0.02,
    method: Annotated[str, typer.Option("--method", help=METHODS)] = "auto",
    set_: Set = None,
    json: Json = False,
) -> None:
    """Show what appeared and what vanished between two maps of one building.

    The maps are aligned first, and bent where both have keyframes. A picture (vanished red, appeared green) and a table
    in metres and square metres, in the earlier map's frame; only what both maps have seen can change.

    mrslam diff out/monday/r1 out/tuesday/r1
    mrslam diff office.mrslam out/tuesday/r1 -o out/changes --least 0.1
    """
    from mrslam.sim_driver.cli.maps.diff import DiffOptions, diff_files

    options = DiffOptions(
        before=before, after=after, out=out, same_frame=same_frame, near_m=near, least_m2=least, method=method,
        assignments=set_ or [], as_json=json,
    )  # fmt: skip
    diff_files(options)
