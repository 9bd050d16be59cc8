from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from mrslam.sim_driver.missions.settings import (
    build,
    build_section,
    check_keys,
    made_with,
    parse_assignment,
    read_toml,
    with_overrides,
)
from mrslam.spatial import InputError
from mrslam.spatial.errors import require


@dataclass(frozen=True, kw_only=True)
class Knobs:
    timeout_s: float = 30.0
    name: str = "x"
    count: int | None = None
    is_on: bool = False

    def __post_init__(self) -> None:
        require(self.timeout_s > 0, "knobs.timeout_s", "> 0 s", self.timeout_s)


def test_values_are_converted_and_defaults_stay() -> None:
    assert build(Knobs, {"timeout_s": 5}, "knobs") == Knobs(timeout_s=5.0)


def test_a_misspelt_key_suggests_the_nearest() -> None:
    with pytest.raises(InputError, match="unknown key 'timeout'; did you mean 'timeout_s'"):
        build(Knobs, {"timeout": 5}, "knobs")


def test_where_no_key_is_like_it_all_are_named() -> None:
    with pytest.raises(InputError, match="unknown key 'zzz'; known are count, is_on, name, timeout_s"):
        build(Knobs, {"zzz": 5}, "knobs")


def test_a_wrong_type_names_key_and_value() -> None:
    with pytest.raises(InputError, match=r"knobs\.count = 'many': Expected `int \| null`"):
        build(Knobs, {"count": "many"}, "knobs")


@pytest.mark.parametrize("raw", [1, 1.0, 0])
def test_a_number_is_no_switch(raw: float) -> None:
    with pytest.raises(InputError, match=r"knobs\.is_on = .*: Expected `bool`"):
        build(Knobs, {"is_on": raw}, "knobs")


def test_text_is_read_as_what_the_setting_is() -> None:
    """As ``--set knobs.is_on=True`` gives it, which is no TOML."""
    (_, key), raw = parse_assignment("knobs.is_on=True")
    assert raw == "True"
    assert build(Knobs, {key: raw}, "knobs") == Knobs(is_on=True)


def test_a_value_out_of_range_says_the_bound() -> None:
    with pytest.raises(InputError, match=r"knobs\.timeout_s must be > 0 s, got -1"):
        build(Knobs, {"timeout_s": -1}, "knobs")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("comms.exchange_timeout_s=10", (["comms", "exchange_timeout_s"], 10)),
        ("mission.shell=virtual", (["mission", "shell"], "virtual")),
        ("mission.shell= virtual ", (["mission", "shell"], "virtual")),
        ("a.b=[1, 2]", (["a", "b"], [1, 2])),
        ("a.b=x=y", (["a", "b"], "x=y")),
    ],
)
def test_assignments(text: str, expected: object) -> None:
    assert parse_assignment(text) == expected


@pytest.mark.parametrize("text", ["nonsense", "a=1", "a.b.c=1", ".b=1", "a.=1"])
def test_broken_assignments_show_how_it_is_done(text: str) -> None:
    with pytest.raises(InputError, match=r"section\.key=value"):
        parse_assignment(text)


def test_overrides_leave_the_original_alone() -> None:
    tables = {"comms": {"a": 1}}
    assert with_overrides(tables, ["comms.a=2", "rbpf.b=3"]) == {"comms": {"a": 2}, "rbpf": {"b": 3}}
    assert tables == {"comms": {"a": 1}}


def test_broken_toml_names_file_and_place(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text("[mission\n")
    with pytest.raises(InputError, match=r"m\.toml: not valid TOML .*line 1"):
        read_toml(path)
    with pytest.raises(InputError, match="no such file"):
        read_toml(tmp_path / "none.toml")


ENDLESS = ["[" * 100_000, "9" * 5000]
"""Values that Python's reader of TOML has no error of its own for."""


@pytest.mark.parametrize("value", ENDLESS)
def test_brackets_and_numbers_without_end_are_no_toml_and_plain_text_behind_set(tmp_path: Path, value: str) -> None:
    (tmp_path / "m.toml").write_text(f"[mission]\nseed = {value}\n")
    with pytest.raises(InputError, match=r"m\.toml: not valid TOML"):
        read_toml(tmp_path / "m.toml")
    assert parse_assignment(f"mission.seed={value}") == (["mission", "seed"], value)


def test_a_command_takes_settings_of_its_one_section_and_refuses_those_of_others() -> None:
    assert build_section(Knobs, "knobs", ["knobs.name=y"], count=3) == Knobs(name="y", count=3)
    with pytest.raises(InputError, match="--set: unknown key 'knob'; did you mean 'knobs'"):
        build_section(Knobs, "knobs", ["knobs.name=y", "knob.timeout_s=3"])


def test_what_the_tables_alone_are_not_blamed_for_the_option_is() -> None:
    def make(tables: dict[str, Any]) -> Knobs:
        check_keys(tables, ["knobs"], "m.toml")
        return build(Knobs, tables.get("knobs", {}), "m.toml: knobs")

    table = {"knobs": {"count": 3}}
    assert made_with(make, table, ["knobs.name=y"], "m.toml") == Knobs(name="y", count=3)
    for assignment, words in (("foo.bar=1", "unknown key 'foo'"), ("knobs.cuont=1", "knobs: unknown key 'cuont'")):
        with pytest.raises(InputError, match=f"^--set: {re.escape(words)}"):
            made_with(make, table, [assignment], "m.toml")
        with pytest.raises(InputError, match=f"^--vary: {words}"):
            made_with(make, table, [assignment], "m.toml", "--vary")
    with pytest.raises(InputError, match=r"^m\.toml: unknown key 'wrong'"):
        made_with(make, {"wrong": {}}, ["foo.bar=1"], "m.toml")
    with pytest.raises(InputError, match=r"^--set wants section\.key=value"):
        made_with(make, table, ["foo"], "m.toml")

    def refuse(tables: dict[str, Any]) -> None:
        if tables["knobs"].get("name") == "y":
            raise InputError("knobs.name must be another")

    with pytest.raises(InputError, match=r"^knobs\.name must be another"):  # says itself what is wrong
        made_with(refuse, table, ["knobs.name=y"], "m.toml")
