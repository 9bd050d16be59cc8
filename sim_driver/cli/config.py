"""``mrslam config``: the reference of all settings, made from the code."""

from __future__ import annotations

import ast
import dataclasses
import inspect
from collections.abc import Iterator

from mrslam.agent import Settings
from mrslam.sim_driver.drivers import DriverConfig
from mrslam.sim_driver.faults import FaultConfig
from mrslam.sim_driver.missions import sections as mission_config
from mrslam.sim_driver.worlds.radio import RadioConfig

LISTS = ("robots", "faults")
"""Sections of which there may be several."""


def print_reference() -> None:
    """Print every section and key with its default and what it does."""
    for section, cls in sections():
        print(f"[{section}]")
        for name, default, text in settings_of(cls):
            print(f"  {name} = {default}\n      {text}")
        print()


def as_markdown() -> str:
    """Return the reference as a page of the documentation."""
    lines = [
        "# Settings",
        "",
        "Sections of a mission file. Every key outside of `[[...]]` can also be given as `--set section.key=value`. "
        "The same list: `mrslam config`. This page is made from the code.",
    ]
    for section, cls in sections():
        title = f"[[{section}]]" if section in LISTS else f"[{section}]"
        lines += ["", f"## `{title}`", "", (cls.__doc__ or "").strip().splitlines()[0], ""]
        lines += ["| key | default | what it does |", "|---|---|---|"]
        lines += [
            f"| `{name}` | `{default}` | {text.replace('``', '`').replace('|', chr(92) + '|')} |"
            for name, default, text in settings_of(cls)
        ]
    return "\n".join(lines) + "\n"


def sections() -> Iterator[tuple[str, type]]:
    """Yield every section of a mission file with its dataclass."""
    yield "mission", mission_config.MissionConfig
    yield "robots", mission_config.RobotConfig
    yield "links", mission_config.LinksConfig
    yield "truth", mission_config.TruthConfig
    yield "world", mission_config.WorldConfig
    yield "driver", DriverConfig
    yield "radio", RadioConfig
    yield "faults", FaultConfig
    yield "sweep", mission_config.SweepConfig
    default = Settings()
    for field in dataclasses.fields(Settings):
        yield field.name, type(getattr(default, field.name))


def settings_of(cls: type) -> Iterator[tuple[str, str, str]]:
    """Yield name, default and description of every field: the text that stands below it in the source."""
    texts = _field_texts(cls)
    for field in dataclasses.fields(cls):
        if field.default is not dataclasses.MISSING:
            default = repr(field.default)
        elif field.default_factory is not dataclasses.MISSING:
            default = repr(field.default_factory())
        else:
            default = "(required)"
        yield field.name, default, texts.get(field.name, "")


def _field_texts(cls: type) -> dict[str, str]:
    body = ast.parse(inspect.getsource(cls)).body[0]
    assert isinstance(body, ast.ClassDef)
    texts = {}
    for node, after in zip(body.body, body.body[1:], strict=False):
        is_text = (
            isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant) and isinstance(after.value.value, str)
        )
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and is_text:
            texts[node.target.id] = " ".join(after.value.value.split())  # type: ignore[attr-defined]
    return texts
