"""Warnings that are given once, however often their cause comes, and counted after that."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable


class Complaints:
    """Says each kind of trouble once; thread-safe."""

    def __init__(self, say: Callable[[str], None]) -> None:
        """Take what says a line."""
        self.counts: Counter[str] = Counter()
        """By kind: how often it came."""
        self._say = say
        self._lock = threading.Lock()

    def once(self, kind: str, words: str) -> None:
        """Say the words where this kind has not come before; count it."""
        with self._lock:
            self.counts[kind] += 1
            is_first = self.counts[kind] == 1
        if is_first:
            self._say(words)
