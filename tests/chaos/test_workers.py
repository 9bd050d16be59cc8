"""Missions are played side by side, and one whose process dies is one broken mission."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections import Counter

from bench.chaos.mission import Outcome, died
from bench.workers import play_all


def dies_at_three(seed: int) -> Outcome:
    if seed == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return Outcome(seed, [], Counter(crash=1))


def test_a_process_that_dies_is_a_broken_mission_and_the_others_are_played() -> None:
    outcomes = {outcome.seed: outcome for outcome in play_all(dies_at_three, range(8), 2, died)}
    assert sorted(outcomes) == list(range(8))
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
