"""The command and its sub-commands, in the order of the help. Imports of the heavy packages wait until one runs."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from importlib.metadata import version
from typing import Annotated

import typer

from mrslam.sim_driver.cli.commands import maps, network, runs

app = typer.Typer(
    name="mrslam",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Multi-robot 2-D lidar SLAM: robots map, meet, and their maps find each other.\n\n"
    "\b\n"
    "mrslam demo                robots explore a building and merge their maps\n"
    "mrslam map LOG             map a recorded log\n"
    "mrslam align A B           see how two maps fit together\n"
    "mrslam run office          run a shipped mission, in virtual time\n"
    "mrslam COMMAND --help      says more, with examples",
)

COMMANDS: dict[str, Callable[..., None]] = {
    "demo": runs.demo,
    "map": maps.map_,
    "feed": maps.feed,
    "align": maps.align,
    "merge": maps.merge,
    "save": maps.save,
    "diff": maps.diff,
    "run": runs.run,
    "eval": runs.eval_,
    "report": runs.report,
    "view": runs.view_,
    "bag": runs.bag,
    "sweep": runs.sweep,
    "agent": network.agent,
    "ros": network.ros,
    "gather": runs.gather,
    "top": network.top,
    "doctor": network.doctor,
    "keys": network.keys,
    "config": network.config,
}
"""Sub-command -> its function, in the order of the help."""


CONTEXTS = {"ros": {"allow_extra_args": True, "ignore_unknown_options": True}}
"""Sub-command -> how its arguments are read, where they are not all its own."""


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


def as_help(function: Callable[..., None]) -> str:
    """Return a command's docstring as its help; examples, a paragraph of calls, keep their lines."""
    paragraphs = (inspect.getdoc(function) or "").split("\n\n")
    return "\n\n".join(f"\b\n{text}" if text.startswith("mrslam ") else text for text in paragraphs)


for name, function in COMMANDS.items():
    app.command(name, help=as_help(function), context_settings=CONTEXTS.get(name))(function)
