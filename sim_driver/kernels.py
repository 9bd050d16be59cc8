"""Compiling kernels once, before agents start: they find them on disk."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

from mrslam import jit_cache
from mrslam.jit_cache import forget_old, is_warm, mark_warm
from mrslam.spatial.runtime.heap import give_back

ROOMS = (
    "rbpf",
    "alignment",
    "mutual_detection",
    "merge",
    "comms",
    "sim_driver.robots",
    "sim_driver.drivers",
    "sim_driver.feeds",
)
"""Packages with kernels, below ``mrslam``; each offers ``warm_up()``, which calls every kernel once."""


def load_kernels(rooms: Sequence[str] = ROOMS) -> None:
    """Call every kernel of these packages once: each is loaded from disk, or compiled where it is not there.

    What loading them took goes back to the system. The first time in a process, what is there by then is put aside for
    good by the collector of garbage: to look through numba's objects again takes it a tenth of a second each time.
    """
    for room in rooms:
        with _ctrl_c_after():
            import_module(f"mrslam.{room}").warm_up()
        mark_warm(room)
    if gc.get_freeze_count() == 0:  # later on, what is left of an earlier mission must not be kept
        gc.freeze()
    give_back()


@contextmanager
def _ctrl_c_after() -> Iterator[None]:
    """Let Ctrl-C, pressed meanwhile, end the command after this.

    The compiler calls back through C, where an exception is lost, or comes out as another one. Other threads than the
    first never get a signal.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    told: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: told.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if told:
        signal.raise_signal(signal.SIGINT)


def ensure_compiled(say: Callable[[str], None], rooms: Sequence[str] = ROOMS) -> float:
    """Load the kernels of these packages, saying so where that means compiling; return the seconds it took.

    A second process compiles every other package where there is a second core.
    """
    start = time.monotonic()
    cold = [room for room in rooms if not is_warm(room)]
    if cold:
        say("First run: compiling kernels, which takes up to a minute in all; later runs find them on disk.")
    shared = cold[1::2] if len(os.sched_getaffinity(0)) > 1 else []
    with _compiled_beside(shared) as wait:
        for room in cold:
            if room not in shared:
                say(f"  compiling {room} ...")
                load_kernels([room])
        if shared:
            say(f"  compiling {', '.join(shared)} in a second process ...")
        wait()
    load_kernels(rooms)
    if cold:
        forget_old()
    return time.monotonic() - start


@contextmanager
def _compiled_beside(rooms: Sequence[str]) -> Iterator[Callable[[], object]]:
    """Compile these packages in a process of its own; yield what waits for its end. What it fails at is left to do."""
    if not rooms:
        yield lambda: None
        return
    top = str(Path(jit_cache.__file__).parents[1])
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); "
        "from mrslam.sim_driver import kernels; kernels.load_kernels(sys.argv[2:])"
    )
    command = [sys.executable, "-c", code, top, *rooms]
    helper = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield helper.wait
    finally:
        helper.kill()
        helper.wait()
