"""Compiling all kernels once, in the parent, before agents start: they find them on disk."""

from __future__ import annotations

import time
from collections.abc import Callable

import alignment
import merge
import mutual_detection
import rbpf
import sim_driver.drivers
import sim_driver.robots
from spatial.jit_cache import is_warm

ROOMS = (rbpf, alignment, mutual_detection, merge, sim_driver.robots, sim_driver.drivers)


def load_kernels() -> None:
    """Call every kernel once: each is loaded from disk, or compiled where it is not there."""
    for room in ROOMS:
        room.warm_up()


def ensure_compiled(say: Callable[[str], None]) -> float:
    """Call every kernel once, saying so where that means compiling; return the seconds it took."""
    start = time.monotonic()
    cold = not is_warm()
    if cold:
        say("First run: compiling kernels, about a minute; later runs find them on disk.")
    for room in ROOMS:
        if cold:
            say(f"  compiling {room.__name__} ...")
        room.warm_up()
    return time.monotonic() - start
