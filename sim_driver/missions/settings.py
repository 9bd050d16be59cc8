"""Settings from TOML tables and ``--set`` options: typed, checked, and helpful about what is misspelt."""

from __future__ import annotations

import dataclasses
import difflib
import math
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

import msgspec

from mrslam.spatial import InputError

T = TypeVar("T")


def read_toml(path: Path) -> dict[str, Any]:
    """Return the file's tables; raise ``InputError`` naming the file and the line where it is broken."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file") from error
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({error})") from error
    except (ValueError, RecursionError) as error:  # also numbers and brackets without end
        raise InputError(f"{path}: not valid TOML ({error})") from error


def check_keys(table: Iterable[str], known: Iterable[str], where: str) -> None:
    """Raise ``InputError`` for the first key that is not known, with the nearest name that is."""
    names = list(known)
    for key in table:
        if key not in names:
            near = difflib.get_close_matches(key, names, n=1, cutoff=0.5)
            hint = f"; did you mean {near[0]!r}?" if near else f"; known are {', '.join(names)}"
            raise InputError(f"{where}: unknown key {key!r}{hint}")


def build(cls: type[T], table: Mapping[str, Any], where: str) -> T:
    """Return the dataclass ``cls`` made of the table; every wrong key or value is an ``InputError`` that names it."""
    fields = {field.name for field in dataclasses.fields(cls)}  # type: ignore[arg-type]
    check_keys(table, sorted(fields), where)
    unset = (dataclasses.MISSING, dataclasses.MISSING)
    for field in dataclasses.fields(cls):  # type: ignore[arg-type]
        if field.name not in table and (field.default, field.default_factory) == unset:
            raise InputError(f"{where}: the key {field.name!r} is missing")
    hints = get_type_hints(cls)
    values: dict[str, Any] = {}
    for key, raw in table.items():
        try:
            values[key] = msgspec.convert(raw, hints[key], strict=not isinstance(raw, str))
        except msgspec.ValidationError as error:
            raise InputError(f"{where}.{key} = {raw!r}: {error}") from error
        if isinstance(values[key], float) and not math.isfinite(values[key]):
            raise InputError(f"{where}.{key} must be a finite number, got {raw!r}")
    try:
        return cls(**values)
    except TypeError as error:
        raise InputError(f"{where}: {error}") from error


def parse_assignment(text: str) -> tuple[list[str], Any]:
    """Return the dotted key and the value of ``section.key=value``; the value is read as TOML, else as plain text."""
    key, equals, raw = text.partition("=")
    path = key.strip().split(".")
    if not equals or len(path) != 2 or not all(path):
        raise InputError(f"--set wants section.key=value (for example comms.exchange_timeout_s=10), got {text!r}")
    try:
        return path, tomllib.loads(f"value = {raw}")["value"]
    except (ValueError, RecursionError):
        return path, raw.strip()


def with_overrides(tables: dict[str, Any], assignments: Iterable[str]) -> dict[str, Any]:
    """Return the tables with ``section.key=value`` options laid over them."""
    result = {name: dict(table) if isinstance(table, dict) else table for name, table in tables.items()}
    for text in assignments:
        (section, key), value = parse_assignment(text)
        table = result.setdefault(section, {})
        if not isinstance(table, dict):
            raise InputError(f"--set {text}: {section!r} is a list; only single sections can be set")
        table[key] = value
    return result


def made_with(
    make: Callable[[dict[str, Any]], T],
    tables: dict[str, Any],
    assignments: Sequence[str],
    where: str,
    by: str = "--set",
) -> T:
    """Return what ``make`` makes of the tables with assignments laid over them.

    ``where`` : what its errors call the tables. What the tables alone are not blamed for, the option ``by`` is.
    """
    chosen = with_overrides(tables, assignments)
    try:
        return make(chosen)
    except InputError as error:
        make(tables)
        blamed, said = f"{where}: ", str(error)
        raise InputError(said.replace(blamed, f"{by}: ", 1) if said.startswith(blamed) else said) from error


def build_section(cls: type[T], section: str, assignments: Iterable[str], **table: Any) -> T:
    """Return the one section that a command has settings of, with ``--set`` options laid over ``table``."""
    tables = with_overrides({section: table}, assignments)
    check_keys(tables, [section], "--set")
    return build(cls, tables[section], section)


def as_table(config: Any) -> dict[str, Any]:
    """Return a config dataclass as plain TOML/JSON values."""
    table: dict[str, Any] = msgspec.to_builtins(config)
    return table
