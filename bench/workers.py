"""Missions side by side in processes of their own, so that one which dies takes no other with it; here or elsewhere."""

from __future__ import annotations

import importlib
import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any, Generic, TypeVar

from mrslam.sim_driver.sweep.workers import DaskWorkers

Outcome = TypeVar("Outcome")
MISSIONS_A_PROCESS = 20
"""A process is replaced after this many missions, so that what it keeps cannot add up over a thousand."""


class Worker(Generic[Outcome]):
    """One process that plays one mission at a time, and is replaced when it has died."""

    def __init__(self, play: Callable[[int], Outcome], died: Callable[[int], Outcome]) -> None:
        """Take what plays the mission of a seed, and what to return where its process died; the first starts it."""
        self._play, self._died = play, died
        self._process: ProcessPoolExecutor | None = None
        self._played = 0

    def __call__(self, seed: int) -> Outcome:
        """Return the outcome of the mission; a process that died is one."""
        if self._process is None or self._played % MISSIONS_A_PROCESS == 0:
            self.close()
            ctrl_c_is_for_the_parent = (signal.SIGINT, signal.SIG_IGN)
            spawn = multiprocessing.get_context("spawn")
            self._process = ProcessPoolExecutor(1, spawn, signal.signal, ctrl_c_is_for_the_parent)
        self._played += 1
        try:
            return self._process.submit(self._play, seed).result()
        except BrokenProcessPool:
            self.close()
            return self._died(seed)

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.shutdown()
            self._process = None


def play_all(
    play: Callable[[int], Outcome], seeds: Sequence[int], workers: int, died: Callable[[int], Outcome]
) -> Iterator[Outcome]:
    """Yield the outcome of every seed's mission as it comes, from so many processes at a time.

    ``died`` : returns that of a mission whose process died.
    """
    idle = [Worker(play, died) for _ in range(workers)]

    def turn(seed: int) -> Outcome:
        worker = idle.pop()  # there are as many workers as threads
        try:
            return worker(seed)
        finally:
            idle.append(worker)

    with ThreadPoolExecutor(workers) as threads:
        futures = [threads.submit(turn, seed) for seed in seeds]
        try:
            for future in as_completed(futures):
                yield future.result()
        finally:
            for future in futures:
                future.cancel()
    for worker in idle:
        worker.close()


def play_on_cluster(
    scheduler: str, play: Callable[[int], Outcome], seeds: Sequence[int], died: Callable[[int], Outcome]
) -> Iterator[Outcome]:
    """Yield the outcome of every seed's mission as it comes, from the workers of a Dask cluster.

    What a lost worker was playing, others play again. It is blamed on all missions that waited for it, so those with
    which one worker after another was lost are played once more at the end, each alone. ``died`` : returns that of a
    mission that loses workers then, too. Raises ``InputError`` where no scheduler answers, or Dask is not installed.
    """
    workers = DaskWorkers(scheduler)
    killed: type[Exception] = importlib.import_module("distributed.scheduler").KilledWorker
    blamed: list[int] = []
    try:
        pending: dict[Any, int] = {workers.submit(play, seed): seed for seed in seeds}
        while pending:
            for future in workers.next_done(set(pending)):
                seed = pending.pop(future)
                try:
                    outcome = future.result()
                except killed:
                    blamed.append(seed)
                    continue
                yield outcome
        for seed in blamed:
            try:
                outcome = workers.submit(play, seed).result()
            except killed:
                outcome = died(seed)
            yield outcome
    finally:
        workers.close()
