"""All parameters of a node: its options, and every setting of mrslam under its dotted name."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from mrslam.agent import Settings
from mrslam.sim_driver.missions.described import settings_of
from mrslam.sim_driver.missions.mission import make_settings
from mrslam.sim_driver.missions.settings import build, check_keys, parse_assignment, read_toml
from mrslam.sim_driver.ros.options import RosOptions
from mrslam.spatial import InputError

OF_ROS = ("use_sim_time", "start_type_description_service", "qos_overrides")
"""Parameters, or first parts of them, that rclpy itself declares."""
LISTS = ("listen", "connect", "maps", "scan_topics")
"""Options that are lists; one text with blanks between its words does as well."""


OTHERWISE_NAMED = {"map": "maps", "frame": "agent.frame", "localise": "agent.localise", "no-multicast": "multicast"}
"""By option of ``mrslam agent``: the parameter that says the same, where its name is another."""


@dataclass(frozen=True)
class Parameter:
    """One parameter as it is declared."""

    name: str
    default: Any
    """A number, text or bool, as ROS has them; None where it may be not set."""
    text: str
    """What it does."""


def parameters() -> list[Parameter]:
    """Return all parameters in the order of declaration."""
    texts = {one.name: one.text for one in settings_of(RosOptions)}
    options = RosOptions()
    found = [Parameter(one.name, _plain(getattr(options, one.name)), texts[one.name]) for one in fields(RosOptions)]
    settings = Settings()
    for section in fields(Settings):
        config = getattr(settings, section.name)
        for one in settings_of(type(config)):
            found.append(Parameter(f"{section.name}.{one.name}", _plain(getattr(config, one.name)), one.text))
    return found


def resolve(values: Mapping[str, Any], namespace: str) -> tuple[RosOptions, Settings]:
    """Return options and settings from the parameters' values; those of the TOML file count where one is the default.

    Raises ``InputError`` with the parameter's name where a value makes no sense.
    """
    table = {one.name: values[one.name] for one in fields(RosOptions) if values.get(one.name) is not None}
    for name in LISTS:
        words = table[name].split() if isinstance(table[name], str) else table[name]
        table[name] = [word for word in words if word]
    table["robot"] = table["robot"] or namespace.rstrip("/").rpartition("/")[2]
    options = build(RosOptions, table, "parameters")
    if not options.robot:
        raise InputError("the robot needs a name: the parameter robot, or a namespace (--ros-args -r __ns:=/r1)")
    tables = read_toml(Path(options.config)) if options.config else {}
    check_keys(tables, [section.name for section in fields(Settings)], options.config)
    for one in parameters():
        section, dot, name = one.name.partition(".")
        value = values.get(one.name)
        if dot and value is not None and value != one.default:
            is_table = not isinstance(getattr(getattr(Settings(), section), name), float | int | str | None)
            tables.setdefault(section, {})[name] = _from_text(one.name, value) if is_table else value
    return options, make_settings(tables, "parameters")


def parameter_of(option: str) -> str | None:
    """Return the parameter that says what an option of ``mrslam agent`` says, None where a node knows no such thing."""
    name = option.lstrip("-").partition("=")[0]
    name = OTHERWISE_NAMED.get(name, name)
    return name if name in {one.name for one in parameters()} else None


def check_known(names: Iterable[str]) -> None:
    """Raise ``InputError`` for the first parameter given that does not exist, with the nearest that does."""
    known = [one.name for one in parameters()]
    for name in names:
        if name not in known and name.partition(".")[0] not in OF_ROS:
            near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
            raise InputError(f"unknown parameter {name!r}" + (f"; did you mean {near[0]!r}?" if near else ""))


def _plain(value: Any) -> Any:
    """Return a default as ROS can declare it: lists as words, tables as text; those of settings are empty."""
    if isinstance(value, tuple):
        return " ".join(value)
    return value if isinstance(value, float | int | str | None) else ""


def _from_text(name: str, text: object) -> Any:
    """Return the table that a parameter's text is in TOML, for ROS has no tables: "{r1 = [0.0, 0.0, 0.0]}"."""
    return parse_assignment(f"{name}={text}")[1]
