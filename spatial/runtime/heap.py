"""Memory that is not needed any more goes back to the system.

Maps come and go, and the allocator keeps what lies between blocks in use. And most of a library's code is never run
again once it is loaded: numba's compiler when the kernels are there, what scipy and OpenCV do when they are imported.
Its pages stay where they were read, a third of a robot's resident memory, until they are let go.
"""

from __future__ import annotations

import ctypes
import re
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

MAPS = Path("/proc/self/smaps")
UNWRITTEN_CODE = re.compile(
    r"^(\w+)-(\w+) r-xp .* /.*\n(?:[A-Z]\w+:.*\n)*?Anonymous: +0 kB\n(?:[A-Z]\w+:.*\n)*?Swap: +0 kB", re.MULTILINE
)
"""Files mapped to be run of which no page was written: such a page is no longer the file's."""
EVERY_S = 30.0
"""Least time between two releases by :func:`give_back_now_and_then`, seconds: each takes 50 ms of CPU, and more where
a process holds much."""
DONTNEED = 4
"""Linux's ``MADV_DONTNEED``: pages of a file are read again from there when they are needed after all."""


def _libc(name: str) -> Callable[..., int] | None:
    """Return a function of the C library, None on systems that have none of that name."""
    return getattr(ctypes.CDLL(None), name, None) if sys.platform.startswith("linux") else None


_TRIM, _ADVISE = _libc("malloc_trim"), _libc("madvise")


def trim() -> bool:
    """Return free pages to the system; False where none could be. Takes a millisecond; call it now and then."""
    return _TRIM is not None and bool(_TRIM(0))


def give_back() -> bool:
    """Return free pages, and libraries' code, to the system; False where no free page could be.

    Takes some 20 ms; call it after large work. Code that is needed after all is read again as it runs.
    """
    if _ADVISE is not None and MAPS.exists():  # some kernels offer no such file
        for begin, end in _code():
            _ADVISE(ctypes.c_void_p(begin), ctypes.c_size_t(end - begin), DONTNEED)
    return trim()


class _Last:
    """When this process gave back last, in seconds of the system's clock: its robots share its memory."""

    at_s = float("-inf")


def give_back_now_and_then() -> bool:
    """Do :func:`give_back` if this process has not done so for ``EVERY_S``; return whether it was done."""
    if time.monotonic() - _Last.at_s < EVERY_S:
        return False
    _Last.at_s = time.monotonic()
    give_back()
    return True


def _code() -> Iterator[tuple[int, int]]:
    """Yield where code lies in memory that is as it is in its file: executable, and never written."""
    for found in UNWRITTEN_CODE.finditer(MAPS.read_text()):
        yield int(found[1], 16), int(found[2], 16)
