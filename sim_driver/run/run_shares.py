"""A mission in virtual time whose robots take their turns in several processes: the bytes of one process, sooner."""

from __future__ import annotations

import contextlib
import multiprocessing as mp
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from mrslam.sim_driver.kernels import load_kernels
from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.run.run_virtual import VirtualTeam, play, run_in_virtual_time
from mrslam.sim_driver.run.shares import Hub, Spoke, received

FEWEST = 4
"""Robots a process for which another one is worth its start, some four seconds of CPU, and its memory."""
CLOSE_S = 60.0
"""Longest wait for a process that has written its files, seconds."""


def processes_for(mission: Mission, asked: int = 0) -> int:
    """Return the number of processes a mission in virtual time is played in; ``asked``: as many at most, 0 = as fit.

    One where something goes wrong on purpose, which concerns all robots at once, or somebody looks on.
    """
    if mission.faults or mission.view:
        return 1
    cores, robots = len(os.sched_getaffinity(0)), len(mission.robots)
    return max(1, min(asked or min(cores, robots // FEWEST), robots))


def run_in_shares(
    mission: Mission, out: Path, progress: Any, stop: Callable[[], bool] = lambda: False, processes: int = 1
) -> dict[str, Any]:
    """Run the mission and return what the metrics need beside the robots' own files.

    ``processes`` : the number of them, this one included; the outcome is the same to the byte with any.
    """
    if processes == 1:
        return run_in_virtual_time(mission, out, progress, stop=stop)
    # Neighbours in the list may have been put near each other: they are dealt out.
    shares = [[robot.id for robot in mission.robots[k::processes]] for k in range(processes)]
    threads = max(1, len(os.sched_getaffinity(0)) // processes)
    with _others(mission, out, shares[1:], threads) as pipes:
        hub = Hub(pipes, stop)
        team = VirtualTeam(mission, out, shares[0])
        outcome = play(mission, team, progress, stop=lambda: hub.is_over, meeting=hub, threads=threads)
        for pipe in pipes:
            received(pipe)  # its files are written
    if team.simulation is not None:
        team.simulation.write_truth(out)
    return outcome


@contextmanager
def _others(mission: Mission, out: Path, shares: Sequence[Sequence[str]], threads: int) -> Iterator[list[Connection]]:
    """Start a process for each share; yield the pipes to them. At the end they are gone."""
    context = mp.get_context("spawn")
    pipes, started = [], []
    try:
        for share in shares:
            ours, theirs = context.Pipe()
            process = context.Process(target=_play_share, args=(mission, out, share, theirs, threads))
            process.start()
            theirs.close()
            pipes.append(ours)
            started.append(process)
        yield pipes
    finally:
        for pipe in pipes:
            pipe.close()  # who still waits for us ends
        for process in started:
            process.join(CLOSE_S)
            process.kill()


def _silent(now_s: float, total_s: float | None, words: str) -> None:
    """Say nothing: the process that started this one does."""


def _play_share(mission: Mission, out: Path, share: Sequence[str], pipe: Connection, threads: int) -> None:
    """Play some robots of a mission; what runs in a process that was started for it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who started it hears Ctrl-C, and says when to end
    try:
        load_kernels()
        spoke = Spoke(pipe)
        team = VirtualTeam(mission, out, share)
        play(mission, team, _silent, stop=lambda: spoke.is_over, meeting=spoke, threads=threads)
        pipe.send({})
    except (EOFError, BrokenPipeError):  # the process that started this one is gone, or gave up
        return
    except Exception as error:  # noqa: BLE001 - raised where the mission was started
        with contextlib.suppress(OSError):
            pipe.send(error)
