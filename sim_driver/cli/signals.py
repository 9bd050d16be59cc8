"""Commands that run until they are told to stop."""

from __future__ import annotations

import signal


def signals_heard(*numbers: int) -> list[int]:
    """Return a list to which these signals are added as they come; for the rest of the process they do nothing else.

    An exception instead, as Ctrl-C's own, may be raised where nobody hears it: in a callback or a finaliser; and a
    second signal must not break off what the first one began to finish.
    """
    told: list[int] = []
    for number in numbers:
        signal.signal(number, lambda number, frame: told.append(number))
    return told
