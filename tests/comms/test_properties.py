"""Whatever the network does: knowledge only grows, nothing wrong is taken, and in the end all know the same.

``MRSLAM_CASES=3000 pytest tests/comms/test_properties.py`` runs more histories.
"""

from __future__ import annotations

import os

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrslam.comms import ExchangeDone, ExchangeFailed, LinkConditions, MapUpdated
from tests.comms.team import Team

CASES = int(os.environ.get("MRSLAM_CASES", "50"))
IDS = ["a", "b", "c", "d"]


def some_link(rng: np.random.Generator) -> LinkConditions:
    return LinkConditions(
        loss=float(rng.choice([0.0, 0.1, 0.3, 0.6])),
        delay_s=float(rng.choice([0.0, 0.1, 0.6])),
        jitter_s=float(rng.choice([0.0, 0.3, 3.0])),
        duplicate=float(rng.choice([0.0, 0.2, 0.9])),
        rate_bps=float(rng.choice([5e3, 5e4, 1e9])),
    )


def live(team: Team, rng: np.random.Generator) -> None:
    """Let one thing happen to the team, then some time pass."""
    robot = str(rng.choice(IDS))
    kind = rng.random()
    if kind < 0.45:
        if robot in team.nodes:
            team.publish(robot)
    elif kind < 0.65:
        team.groups = {name: int(rng.integers(0, 2)) for name in IDS}
    elif kind < 0.75:
        team.link = some_link(rng)
    elif kind < 0.9 or robot not in team.nodes:
        if robot in team.nodes:
            team.crash(robot)
        # Boot ids may be random: then a restarted robot must outrank its own past by itself.
        team.start(robot, int(rng.integers(1, 2**40)) if rng.random() < 0.5 else None)
    else:
        team.crash(robot)
    team.run(float(rng.choice([0.25, 0.5, 1.0, 3.0, 8.0])))


def history(seed: int, reliable: bool, corrupt: float) -> Team:
    rng = np.random.default_rng(seed)
    team = Team(IDS, seed=seed, link=some_link(rng), reliable=reliable, corrupt=corrupt)
    for robot in IDS:
        team.publish(robot)
    for _ in range(int(rng.integers(5, 30))):
        live(team, rng)
    team.groups, team.corrupt = {}, 0.0
    team.link = LinkConditions(delay_s=0.01)
    for robot in list(team.nodes):  # a robot that started anew has no map of its own yet, and takes none from others
        team.publish(robot)
    return team


@given(seed=st.integers(0, 2**32 - 1), reliable=st.booleans(), corrupt=st.sampled_from([0.0, 0.05]))
@settings(max_examples=CASES, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
def test_any_history_ends_in_equal_knowledge(seed, reliable, corrupt):
    team = history(seed, reliable, corrupt)
    assert team.run_until_agreed(120.0), team.digests()


def test_the_histories_are_eventful():
    teams = [history(seed, seed % 2 == 0, 0.0) for seed in range(4)]
    updates = [event for team in teams for event in team.of(MapUpdated)]
    assert sum(event.source != event.robot_id for event in updates) > 3  # through third robots
    assert sum(len(team.of(ExchangeFailed)) for team in teams) > 8
    assert sum(len(team.of(ExchangeDone)) for team in teams) > 20
