"""What every setting does: the docstrings below the fields of the dataclasses that hold them."""

from __future__ import annotations

import ast
import dataclasses
import inspect
from collections.abc import Iterator
from dataclasses import dataclass

EXPERT = "Expert: "
"""Begins the description of a setting whose default hardly anyone should change."""


@dataclass(frozen=True)
class Setting:
    """One field of a section."""

    name: str
    default: str
    """As Python writes it; ``(required)`` without one."""
    text: str
    """What it does: the docstring below the field."""
    is_expert: bool


def settings_of(cls: type) -> Iterator[Setting]:
    """Yield every field of a section's dataclass."""
    texts = _field_texts(cls)
    for field in dataclasses.fields(cls):
        if field.default is not dataclasses.MISSING:
            default = repr(field.default)
        elif field.default_factory is not dataclasses.MISSING:
            default = repr(field.default_factory())
        else:
            default = "(required)"
        text = texts.get(field.name, "")
        yield Setting(field.name, default, text.removeprefix(EXPERT), text.startswith(EXPERT))


def _field_texts(cls: type) -> dict[str, str]:
    """Return field -> the docstring below it in the source."""
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
