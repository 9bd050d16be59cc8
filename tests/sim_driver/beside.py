"""What goes on beside a test, until it ends."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def beside(live: Callable[[threading.Event], None]) -> Iterator[None]:
    """Run ``live`` in a thread; it ends where the event that it is given is set."""
    over = threading.Event()
    thread = threading.Thread(target=live, args=(over,))
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
