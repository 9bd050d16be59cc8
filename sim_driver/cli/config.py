"""``mrslam config``: the reference of all settings, made from the code."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

from mrslam.agent import Settings
from mrslam.sim_driver.drivers import DriverConfig
from mrslam.sim_driver.faults import FaultConfig
from mrslam.sim_driver.missions import sections as mission_config
from mrslam.sim_driver.missions.described import EXPERT, Setting, settings_of
from mrslam.sim_driver.worlds.radio import RadioConfig

LISTS = ("robots", "maps", "faults")
"""Sections of which there may be several."""


def print_reference(expert: bool) -> None:
    """Print every section and key with its default and what it does; expert settings only with ``expert``."""
    hidden = 0
    for section, cls in sections():
        shown = [setting for setting in settings_of(cls) if expert or not setting.is_expert]
        hidden += len(dataclasses.fields(cls)) - len(shown)
        if not shown:
            continue
        print(f"[{section}]")
        for setting in shown:
            mark = EXPERT if setting.is_expert else ""
            print(f"  {setting.name} = {setting.default}\n      {mark}{setting.text}")
        print()
    if hidden:
        print(f"{hidden} more settings, whose defaults hardly anyone should change: mrslam config --expert")


def as_markdown() -> str:
    """Return the reference as a page of the documentation; expert settings are in tables of their own at its end."""
    known = {section: (cls, list(settings_of(cls))) for section, cls in sections()}
    lines = [
        "# Settings",
        "",
        "Sections of a mission file. Every key outside of `[[...]]` can also be given as `--set section.key=value`. "
        "The same list: `mrslam config`. This page is made from the code.",
    ]
    for section, (cls, settings) in known.items():
        title = f"[[{section}]]" if section in LISTS else f"[{section}]"
        lines += ["", f"## `{title}`", "", (cls.__doc__ or "").strip().splitlines()[0], ""]
        lines += _rows([setting for setting in settings if not setting.is_expert])
    expert = {section: [one for one in settings if one.is_expert] for section, (_, settings) in known.items()}
    if any(expert.values()):
        lines += [
            "",
            "## Expert settings",
            "",
            "Their defaults hardly anyone should change (`mrslam config --expert`).",
        ]
        for section, settings in expert.items():
            lines += ["", f"### `[{section}]`", "", *_rows(settings)] if settings else []
    return "\n".join(lines) + "\n"


def _rows(settings: Sequence[Setting]) -> list[str]:
    rows = [
        f"| `{one.name}` | `{one.default}` | {one.text.replace('``', '`').replace('|', chr(92) + '|')} |"
        for one in settings
    ]
    return ["| key | default | what it does |", "|---|---|---|", *rows]


def sections() -> Iterator[tuple[str, type]]:
    """Yield every section of a mission file with its dataclass."""
    yield "mission", mission_config.MissionConfig
    yield "robots", mission_config.RobotConfig
    yield "maps", mission_config.SavedMapConfig
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
