"""Which counts of a thing that may happen often are told."""

from __future__ import annotations


def is_milestone(count: int) -> bool:
    """Return whether to tell this count: of the first, the 2nd, 4th, 8th and so on."""
    return count & (count - 1) == 0
