"""Commands that run until they are stopped, and keep their results when they are."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

STDERR = 2
STOPPING = b"\nmrslam: stopping with what there is; Ctrl-C again breaks off, and leaves nothing\n"


def signals_heard(*numbers: int) -> list[int]:
    """Return a list to which these signals are added as they come; for the rest of the process they do nothing else.

    An exception instead, as Ctrl-C's own, may be raised where nobody hears it: in a callback or a finaliser; and a
    second signal must not break off what the first one began to finish.
    """
    told: list[int] = []
    for number in numbers:
        signal.signal(number, lambda number, frame: told.append(number))
    return told


@contextmanager
def interrupts_noted() -> Iterator[Callable[[], bool]]:
    """Yield what says whether Ctrl-C was pressed meanwhile; it raises nothing until this is over.

    Work in turns can so end between two of them, with all that it has. A second Ctrl-C breaks off at once, as the
    first one says, past what may just be printed.
    """
    told: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        if told:
            raise KeyboardInterrupt
        told.append(number)
        os.write(STDERR, STOPPING)

    before = signal.signal(signal.SIGINT, note)
    try:
        yield lambda: bool(told)
    finally:
        signal.signal(signal.SIGINT, before)
