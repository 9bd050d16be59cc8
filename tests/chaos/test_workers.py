"""Missions are played side by side, and one whose process dies is one broken mission."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from collections import Counter

import pytest

from bench.chaos.mission import Outcome, died
from bench.workers import play_all, play_on_cluster


def dies_at_three(seed: int) -> Outcome:
    if seed == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return Outcome(seed, [], Counter(crash=1))


def test_a_process_that_dies_is_a_broken_mission_and_the_others_are_played() -> None:
    outcomes = {outcome.seed: outcome for outcome in play_all(dies_at_three, range(8), 2, died)}
    assert sorted(outcomes) == list(range(8))
    assert outcomes.pop(3).violations == ["the process that played it died"]
    assert all(outcome.violations == [] and outcome.faults["crash"] == 1 for outcome in outcomes.values())


def dies_late_at_three(seed: int) -> Outcome:
    if seed == 3:
        time.sleep(1.0)  # others wait behind it
    return dies_at_three(seed)


@pytest.mark.slow
def test_on_a_cluster_a_mission_that_kills_its_workers_is_broken_and_those_that_waited_with_it_are_played() -> None:
    distributed = pytest.importorskip("distributed")
    blame_at_once = {"allowed-failures": 0, "work-stealing": False, "worker-saturation": math.inf}
    settings = {f"distributed.scheduler.{name}": value for name, value in blame_at_once.items()}
    seeds = [3, 0, 1, 2, *range(4, 12)]
    with (
        pytest.importorskip("dask.config").set(settings),
        distributed.LocalCluster(
            n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1"
        ) as cluster,
    ):  # two die, and one is left though no nanny starts another
        played = list(play_on_cluster(cluster.scheduler_address, dies_late_at_three, seeds, died))
    outcomes = {outcome.seed: outcome for outcome in played}
    assert (len(played), sorted(outcomes)) == (12, list(range(12)))
    assert outcomes.pop(3).violations == ["the process that played it died"]
    assert all(outcome.violations == [] and outcome.faults["crash"] == 1 for outcome in outcomes.values())


def test_a_cluster_that_is_not_there_is_said_in_words() -> None:
    command = [sys.executable, "-m", "bench.chaos", "--missions", "1", "--scheduler", "tcp://127.0.0.1:9"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert "tcp://127.0.0.1:9" in ended.stderr and "Traceback" not in ended.stderr


def test_the_command_plays_missions_in_processes_of_their_own() -> None:
    command = [sys.executable, "-m", "bench.chaos", "--missions", "1", "--seed", "3", "--workers", "1"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=300)
    line = json.loads(ended.stdout)
    assert (ended.returncode, line["missions"], line["broken_seeds"]) == (0, 1, [])
    assert line["faults"]
