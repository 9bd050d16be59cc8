"""Freed memory goes back to the system: maps come and go, and the allocator keeps what lies between blocks in use."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable


def _trimmer() -> Callable[[int], int] | None:
    """Return glibc's ``malloc_trim``, None on systems that have none."""
    if not sys.platform.startswith("linux"):
        return None
    return getattr(ctypes.CDLL(None), "malloc_trim", None)


_TRIM = _trimmer()


def give_back() -> bool:
    """Return free pages to the system; False where nothing could be. Milliseconds; call it after large work."""
    return _TRIM is not None and bool(_TRIM(0))
