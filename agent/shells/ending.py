"""How a robot ends: in steps, none of which keeps those after it from being taken."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable

log = logging.getLogger(__name__)


def take_all(steps: Iterable[Callable[[], object]]) -> None:
    """Take every step, though others fail; raise the first failure once all are taken, after the others are logged.

    What ends the program at once, as a second Ctrl-C does, ends this too.
    """
    failures: list[Exception] = []
    for step in steps:
        try:
            step()
        except Exception as error:  # noqa: BLE001 - whatever it was, the files must be written; it is raised below
            failures.append(error)
    for failure in failures[1:]:
        log.error("another step of the end failed", exc_info=failure)
    if failures:
        raise failures[0]
