"""Lists in the documentation that the code has, too, name all of it: events, and the ROS node's own parameters."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import get_args

from mrslam import comms
from mrslam.sim_driver.ros.options import RosOptions

ROOT = Path(__file__).parents[2]
HEARD = {"Send", "TeammatePose", "TeammateClaim", "TeammateHint"}
"""What the network core returns that never becomes an event."""


def rows(page: str, heading: str) -> str:
    """Return the first cells of the tables below a heading."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    section = re.split(r"^#+ ", text.split(f"# {heading}\n", 1)[1], maxsplit=1, flags=re.MULTILINE)[0]
    return "\n".join(line.split("|")[1] for line in section.splitlines() if line.startswith("| "))


def emitted() -> Iterator[str]:
    """Yield the kinds of events that the agent and its shells make, where they are spelt, and the network's."""
    for package in ("agent", "sim_driver"):
        for path in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                match node:
                    case ast.Call(func=ast.Name(id="Event"), args=[_, ast.Constant(value=kind), *_]):
                        yield str(kind)
    for effect in {kind.__name__ for kind in get_args(comms.Effect)} - HEARD:
        yield re.sub(r"(?<!^)(?=[A-Z])", "_", effect).lower()


def test_every_event_is_explained() -> None:
    told, made = set(re.findall(r"`(\w+)`", rows("missions.md", "Events"))), set(emitted())
    assert len(made) > 20
    assert made <= told, made - told
    chosen = {"doubtful", "recovered", "given_up", "overloaded", "relieved"}  # named by the code that decides
    assert told == made | chosen


def test_every_parameter_of_the_node_is_explained() -> None:
    told = set(re.findall(r"`(\w+)`", rows("robots.md", "Parameters of the node")))
    assert told == {option.name for option in fields(RosOptions)}
