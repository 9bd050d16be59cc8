"""Compiling kernels once, in the parent, before agents start: they find them on disk."""

from __future__ import annotations

import time
from collections.abc import Callable
from importlib import import_module

from spatial.jit_cache import forget_old, is_warm

ROOMS = ("rbpf", "alignment", "mutual_detection", "merge", "comms", "sim_driver.robots", "sim_driver.drivers")
"""Packages with kernels; each offers ``warm_up()``, which calls every kernel once."""


def load_kernels(rooms: tuple[str, ...] = ROOMS) -> None:
    """Call every kernel of these packages once: each is loaded from disk, or compiled where it is not there."""
    for room in rooms:
        import_module(room).warm_up()


def ensure_compiled(say: Callable[[str], None], rooms: tuple[str, ...] = ROOMS) -> float:
    """Load the kernels of these packages, saying so where that means compiling; return the seconds it took."""
    start = time.monotonic()
    cold = [room for room in rooms if not is_warm(room)]
    if cold:
        say("First run: compiling kernels, which takes up to a minute in all; later runs find them on disk.")
    for room in rooms:
        if room in cold:
            say(f"  compiling {room} ...")
        load_kernels((room,))
    if cold:
        forget_old()
    return time.monotonic() - start
