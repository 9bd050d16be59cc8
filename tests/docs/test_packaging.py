"""What the wheel promises."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES = PROJECT["tool"]["mypy"]["packages"]


@pytest.mark.parametrize("package", PACKAGES)
def test_package_is_shipped_and_typed(package: str) -> None:
    assert f"{package}*" in PROJECT["tool"]["setuptools"]["packages"]["find"]["include"]
    assert (ROOT / package / "py.typed").is_file()


def test_the_diagram_shows_every_package() -> None:
    drawing = (ROOT / "docs" / "images" / "architecture.svg").read_text(encoding="utf-8")
    for package in PACKAGES:
        assert f">{package}</text>" in drawing
