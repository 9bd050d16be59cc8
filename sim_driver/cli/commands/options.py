"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Out = Annotated[Path, typer.Option("--out", help="Folder for everything the command leaves.")]
Seed = Annotated[int | None, typer.Option("--seed", help="Everything random follows from it.", min=0)]
Set = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="SECTION.KEY=VALUE", help="A setting (mrslam config); may be given often."),
]
Team = Annotated[str, typer.Option("--team", help="The team's name.")]
Listen = Annotated[
    list[str] | None, typer.Option("--listen", metavar="ENDPOINT", help="tcp/0.0.0.0:7447; several are fine.")
]
Connect = Annotated[
    list[str] | None, typer.Option("--connect", metavar="ENDPOINT", help="A teammate's or router's address.")
]
RobotOut = Annotated[Path | None, typer.Option("--out", help="The robot's folder; out/ROBOT unless given.")]
Fresh = Annotated[bool, typer.Option("--fresh", help="Begin a new map; a checkpoint is kept as checkpoint.old.")]
Rrd = Annotated[Path | None, typer.Option("--rrd", help="Also write a recording for the viewer (mrslam view).")]
View = Annotated[bool, typer.Option("--view", help="Open a viewer and watch.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Salvage = Annotated[
    bool,
    typer.Option("--salvage", help="Use the scans before the place where a CARMEN log or ROS1 bag was cut off."),
]
