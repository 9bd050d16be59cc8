"""Where a sweep's jobs run: processes of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import importlib
import multiprocessing as mp
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from typing import Any, Protocol

from mrslam.spatial import InputError

WATCH_S = 1.0
"""How often a worker looks whether its parent is still there, seconds."""


class Workers(Protocol):
    """Runs functions elsewhere; a function's bytes argument may be the handle of one already given."""

    def submit(self, function: Callable[..., Any], *args: Any) -> Any:
        """Begin and return a future."""

    def share(self, value: bytes) -> Any:
        """Return a handle of a large value that many jobs need."""

    def next_done(self, pending: set[Any]) -> set[Any]:
        """Wait until at least one of the futures is done; return those that are."""


class LocalWorkers:
    """A pool of processes."""

    def __init__(self, count: int) -> None:
        """Start ``count`` processes as they are needed."""
        context = mp.get_context("spawn")  # numba's threads do not survive a fork
        self._pool = ProcessPoolExecutor(
            count, mp_context=context, initializer=_end_with_parent, initargs=(os.getpid(),)
        )

    def submit(self, function: Callable[..., Any], *args: Any) -> Future[Any]:
        """Begin and return a future."""
        return self._pool.submit(function, *args)

    def share(self, value: bytes) -> bytes:
        """Return the value: it travels with every job, over a pipe."""
        return value

    def next_done(self, pending: set[Future[Any]]) -> set[Future[Any]]:
        """Wait until at least one of the futures is done; return those that are."""
        return wait(pending, return_when=FIRST_COMPLETED).done

    def close(self) -> None:
        """Stop at once; what runs is lost."""
        for process in (self._pool._processes or {}).values():
            process.terminate()
        self._pool.shutdown(wait=True, cancel_futures=True)


def _end_with_parent(parent: int) -> None:
    """Leave Ctrl-C to the parent, and end when it is gone, however it went."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(WATCH_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


class DaskWorkers:
    """The workers of a Dask cluster."""

    def __init__(self, address: str) -> None:
        """Connect to a scheduler; raise ``InputError`` where there is none, or Dask is not installed."""
        try:
            self._dask: Any = importlib.import_module("distributed")
        except ImportError as error:
            raise InputError("--scheduler needs Dask: pip install 'mrslam[cluster]'") from error
        try:
            self._client = self._dask.Client(address, timeout="10s")
        except (OSError, ValueError, TimeoutError) as error:
            raise InputError(f"--scheduler {address}: no Dask scheduler answers there ({error})") from error

    def submit(self, function: Callable[..., Any], *args: Any) -> Any:
        """Begin and return a future."""
        return self._client.submit(function, *args, pure=False)

    def share(self, value: bytes) -> Any:
        """Bring the value to the workers that need it, each once.

        As the result of a task, which is done again where the worker that had it is lost; scattered data would be gone.
        """
        return self._client.submit(bytes, value, pure=False)

    def next_done(self, pending: set[Any]) -> set[Any]:
        """Wait until at least one of the futures is done; return those that are."""
        return set(self._dask.wait(list(pending), return_when="FIRST_COMPLETED").done)

    def close(self) -> None:
        """Disconnect; the cluster stays up."""
        self._client.close()


@contextmanager
def workers_at(scheduler: str | None, count: int) -> Iterator[Workers]:
    """Yield the workers of a Dask scheduler, or ``count`` processes of this machine."""
    workers = LocalWorkers(count) if scheduler is None else DaskWorkers(scheduler)
    try:
        yield workers
    finally:
        workers.close()
