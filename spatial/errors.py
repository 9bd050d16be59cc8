"""The one exception for what a user gave us and we cannot use."""

from __future__ import annotations


class InputError(ValueError):
    """A file, value or setting from outside that cannot be used.

    The message is one line: what, the value with its unit, and what to do. The command prints it and exits with 1.
    """

    def __str__(self) -> str:
        """Return the message; what it cites of a file may have lines of its own."""
        return " ".join(super().__str__().splitlines())


def first_line(error: BaseException) -> str:
    """Return the first line of what another's error says, or its kind where it says nothing."""
    return (str(error).splitlines() or [""])[0] or type(error).__name__


def require(condition: bool, name: str, rule: str, value: object) -> None:
    """Raise :class:`InputError` "<name> must be <rule>, got <value>" unless ``condition`` holds."""
    if not condition:
        raise InputError(f"{name} must be {rule}, got {value!r}")
