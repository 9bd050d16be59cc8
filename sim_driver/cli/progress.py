"""Work that takes a while: a bar in a terminal, elsewhere (a log file, CI) a line every few seconds."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from mrslam.sim_driver.cli.console import console, say

LINE_EVERY_S = 10.0
"""How often a line is printed where no bar can be shown, seconds."""


class Lines:
    """Says now and then how far the work is, where there is no terminal."""

    def __init__(
        self,
        say: Callable[[str], None],
        every_s: float = LINE_EVERY_S,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Begin now: work that is done within ``every_s`` seconds says nothing."""
        self._say, self._every_s, self._clock = say, every_s, clock
        self._start_s = self._said_s = clock()

    def tell(self, words: str) -> None:
        """Say it if it is time to."""
        now_s = self._clock()
        if now_s - self._said_s >= self._every_s:
            self._said_s = now_s
            self._say(f"{words}, {now_s - self._start_s:.0f} s")


@contextmanager
def progress_bar(title: str, total: int) -> Iterator[Callable[[], None]]:
    """Show how far the body is and how long it will take; call what it yields after every piece of work."""
    lines, done = Lines(say), 0
    with _bar(MofNCompleteColumn()) as bar:
        task = bar.add_task(title, total=total)

        def advance() -> None:
            nonlocal done
            done += 1
            bar.advance(task)
            if not console.is_terminal:
                lines.tell(f"{title}: {done} of {total}")

        yield advance


@contextmanager
def mission_progress(name: str) -> Iterator[Callable[[float, float | None, str], None]]:
    """Show mission time against the whole, and a few words on what the robots do."""
    lines, is_terminal = Lines(say), console.is_terminal  # asked once: it looks at the environment, and ticks are many
    with _bar(TextColumn("{task.fields[words]}")) as bar:
        task = bar.add_task(name, total=None, words="starting")

        def show(mission_s: float, total_s: float | None, text: str) -> None:
            if is_terminal:
                bar.update(task, completed=mission_s, total=total_s, words=f"{mission_s:.0f} s of mission  {text}")
            else:
                whole = "" if total_s is None else f" of {total_s:.0f}"
                lines.tell(f"{name}: {mission_s:.0f}{whole} s of mission  {text}".rstrip())

        yield show


def _bar(middle: ProgressColumn) -> Progress:
    title = TextColumn("{task.description}")
    columns = (title, BarColumn(), middle, TimeElapsedColumn(), TimeRemainingColumn())
    return Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
