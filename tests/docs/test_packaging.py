"""What the wheel promises."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES = [path.name for path in (ROOT / "mrslam").iterdir() if path.is_symlink()]


@pytest.mark.parametrize("package", PACKAGES)
def test_package_is_shipped_and_typed(package: str) -> None:
    assert (ROOT / "mrslam" / package).resolve() == ROOT / package
    assert (ROOT / package / "__init__.py").is_file()
    assert (ROOT / "mrslam" / "py.typed").is_file()


def test_the_diagram_shows_every_package() -> None:
    drawing = (ROOT / "docs" / "images" / "architecture.svg").read_text(encoding="utf-8")
    for package in PACKAGES:
        assert f">{package}</text>" in drawing


def test_readme_begins_with_a_moving_picture_that_is_not_too_large() -> None:
    picture = re.search(r"!\[[^]]+\]\(([^)]+)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert picture
    raw = (ROOT / picture[1]).read_bytes()
    assert raw.startswith(b"GIF89a")
    assert raw.count(b"\x21\xf9\x04") > 20  # a block before every frame
    assert len(raw) < 2_000_000
