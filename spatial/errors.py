"""The one exception for what a user gave us and we cannot use."""

from __future__ import annotations

from collections.abc import Mapping


class InputError(ValueError):
    """A file, value or setting from outside that cannot be used.

    The message is one line: what, the value with its unit, and what to do. The command prints it and exits with 1.
    """

    def __str__(self) -> str:
        """Return the message in one line, even where it quotes several lines of a file."""
        return " ".join(super().__str__().splitlines())


def first_line(error: BaseException) -> str:
    """Return the first line of an error's message, or the name of its class where the message is empty."""
    return (str(error).splitlines() or [""])[0] or type(error).__name__


def require(condition: bool, name: str, rule: str, value: object) -> None:
    """Raise :class:`InputError` "<name> must be <rule>, got <value>" unless ``condition`` holds."""
    if not condition:
        raise InputError(f"{name} must be {rule}, got {value!r}")


def _short(value: float) -> str:
    return str(value) if isinstance(value, int) else f"{value:g}"


UNITS = {
    "_rad_s2": "rad/s^2", "_m_s2": "m/s^2", "_rad_s": "rad/s", "_m_s": "m/s", "_bit_s": "bit/s", "_bytes": "bytes",
    "_dbm": "dBm", "_db": "dB", "_rad": "rad", "_hz": "Hz", "_m": "m", "_s": "s",
}  # fmt: skip
"""Ending of a setting's name -> its unit; the first that fits, so longer endings stand before shorter ones."""
SEEDS = (0, 2**63 - 1)
"""Bounds of seeds: whole numbers of 64 bits, as TOML has them."""


def require_bounds(section: str, config: object, bounds: Mapping[str, tuple[float, float]]) -> None:
    """Raise :class:`InputError` "<section>.<name> must be in <low>..<high> <unit>, got <value>" for values outside.

    ``bounds`` : name -> (low, high), both included; two ``int`` stand for whole numbers. None is always within.
    """
    for name, (low, high) in bounds.items():
        value = getattr(config, name)
        if value is None:
            continue
        unit = next((f" {unit}" for ending, unit in UNITS.items() if name.endswith(ending)), "")
        is_whole = isinstance(low, int) and isinstance(high, int)
        rule = f"{'a whole number ' if is_whole else ''}in {_short(low)}..{_short(high)}{unit}"
        require(low <= value <= high and (not is_whole or isinstance(value, int)), f"{section}.{name}", rule, value)
