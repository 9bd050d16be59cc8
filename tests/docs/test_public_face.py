"""The names of ``mrslam`` itself: there, typed, documented, and quick to import."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import mrslam

ROOT = Path(__file__).parents[2]


def typed_names() -> dict[str, str]:
    """Return name -> package of what type checkers are shown."""
    tree = ast.parse(Path(mrslam.__file__).read_text(encoding="utf-8"))
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    imports = [node for node in block.body if isinstance(node, ast.ImportFrom)]
    return {alias.asname or alias.name: str(node.module) for node in imports for alias in node.names}


@pytest.mark.parametrize("name", mrslam.__all__)
def test_a_public_name_is_what_type_checkers_are_told(name: str) -> None:
    assert getattr(mrslam, name) is getattr(import_module(typed_names()[name]), name)


def test_type_checkers_are_told_of_no_other_names() -> None:
    assert sorted(typed_names()) == mrslam.__all__


@pytest.mark.parametrize("name", mrslam.__all__)
def test_a_public_name_is_documented(name: str) -> None:
    page = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")
    rows = [line.split("|")[1] for line in page.splitlines() if line.startswith("| `")]
    assert any(f"`{name}`" in row for row in rows)


def test_the_page_documents_nothing_that_is_not_there() -> None:
    page = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")
    rows = [line.split("|")[1] for line in page.splitlines() if line.startswith("| `")]
    assert {name for row in rows for name in re.findall(r"`(\w+)`", row)} == set(mrslam.__all__)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'Maper'"):
        mrslam.Maper  # noqa: B018


@pytest.mark.parametrize(
    ("statement", "absent"),
    [
        ("import mrslam", ("numpy", "numba", "cv2", "zenoh", "scipy")),
        ("from mrslam import Mapper, Scan, OccupancyGrid", ("cv2", "zenoh", "msgspec", "rerun", "typer")),
        ("from mrslam import align, merge_maps", ("cv2", "zenoh", "msgspec", "rerun", "typer")),
        ("from mrslam import Agent", ("cv2", "zenoh", "rerun", "typer")),
    ],
)
def test_importing_loads_no_more_than_it_needs(statement: str, absent: tuple[str, ...]) -> None:
    code = f"import sys; {statement}; print([name for name in {absent!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
