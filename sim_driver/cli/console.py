"""What the command prints for people: to the standard error stream, so that standard output stays clean for scripts."""

from __future__ import annotations

from rich.console import Console

console = Console(stderr=True)
"""Honours NO_COLOR and terminals that are none."""


def say(text: str) -> None:
    """Print a line as it is: brackets are no markup, numbers not coloured, and only a terminal's own edge breaks it."""
    console.print(text, highlight=False, markup=False, soft_wrap=True)
