"""Memory that is not needed any more goes back to the system.

Maps come and go, and the allocator keeps what lies between blocks in use. And numba's compiler, once the kernels are
loaded, has nothing left to do, but its code stays where it was read: a fifth of a robot's resident memory.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

COMPILER = "libllvmlite"
"""The library that loads kernels."""
MAPS = Path("/proc/self/maps")
DONTNEED = 4
"""Linux's ``MADV_DONTNEED``: pages of a file are read again from there when they are needed after all."""


def _libc(name: str) -> Callable[..., int] | None:
    """Return a function of the C library, None on systems that have none of that name."""
    return getattr(ctypes.CDLL(None), name, None) if sys.platform.startswith("linux") else None


_TRIM, _ADVISE = _libc("malloc_trim"), _libc("madvise")


def give_back() -> bool:
    """Return free pages, and the compiler's code, to the system; False where no free page could be.

    Takes milliseconds; call it after large work.
    """
    if _ADVISE is not None:
        for begin, end in _code_of(COMPILER):
            _ADVISE(ctypes.c_void_p(begin), ctypes.c_size_t(end - begin), DONTNEED)
    return _TRIM is not None and bool(_TRIM(0))


def _code_of(library: str) -> Iterator[tuple[int, int]]:
    """Yield where a library's code lies in memory: executable and never written, as it is in its file."""
    for line in MAPS.read_text().splitlines():
        where, rights, *_, path = line.split(maxsplit=5)
        if rights == "r-xp" and library in path:
            begin, end = (int(one, 16) for one in where.split("-"))
            yield begin, end
