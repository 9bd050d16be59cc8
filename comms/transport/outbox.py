"""Messages on their way out, sent by a thread of their own: a link that was cut may block a sender for seconds."""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable

from mrslam.comms.milestones import is_milestone

log = logging.getLogger(__name__)

MAX_BYTES = 16 << 20
"""Bytes queued at most: some 700 map chunks, minutes of a slow link; bounds memory alone."""


class Outbox:
    """A bounded queue and the thread that empties it; what does not fit is lost and will be asked for again."""

    def __init__(self, name: str, put: Callable[[str, bytes], None], max_bytes: int = MAX_BYTES) -> None:
        """Start the thread; ``put(key, payload)`` sends and may wait."""
        self._name, self._put, self._max_bytes = name, put, max_bytes
        self._ready = threading.Condition()
        self._queue: deque[tuple[str, bytes]] = deque()
        self._bytes = 0
        self._closed = False
        self.refused = 0
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def send(self, key: str, payload: bytes) -> None:
        """Queue a message; never waits."""
        with self._ready:
            if self._closed or self._bytes + len(payload) > self._max_bytes:
                self.refused += 1
                if is_milestone(self.refused):
                    log.warning("%s: %d messages were not sent, the last to %s", self._name, self.refused, key)
                return
            self._queue.append((key, payload))
            self._bytes += len(payload)
            self._ready.notify()

    def _run(self) -> None:
        while True:
            with self._ready:
                while not self._queue:
                    if self._closed:
                        return
                    self._ready.wait()
                key, payload = self._queue.popleft()
                self._bytes -= len(payload)
            try:
                self._put(key, payload)
            except Exception as error:  # noqa: BLE001 - one lost message must not end the thread; it is asked for again
                log.warning("a message to %s was not sent: %s", key, error)

    def close(self, timeout_s: float = 1.0) -> None:
        """Send what is queued, for at most ``timeout_s``, and end the thread."""
        with self._ready:
            self._closed = True
            self._ready.notify()
        self._thread.join(timeout_s)
        if self._thread.is_alive():
            with self._ready:
                self._queue.clear()
                self._bytes = 0
