"""Whatever the network does: knowledge only grows, nothing wrong is taken, and in the end all know the same."""

from __future__ import annotations

import os

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from comms import LinkConditions
from tests.comms.team import Team

CASES = int(os.environ.get("MRSLAM_CASES", "150"))
IDS = ["a", "b", "c", "d"]

links = st.builds(
    LinkConditions,
    loss=st.sampled_from([0.0, 0.1, 0.3, 0.6]),
    delay_s=st.sampled_from([0.0, 0.05, 0.4]),
    jitter_s=st.sampled_from([0.0, 0.3, 3.0]),
    duplicate=st.sampled_from([0.0, 0.2, 0.9]),
    rate_bps=st.sampled_from([1e4, 1e5, 1e9]),
)
robots = st.sampled_from(IDS)
steps = st.one_of(
    st.tuples(st.just("publish"), robots),
    st.tuples(st.just("run"), st.sampled_from([0.25, 1.0, 4.0, 9.0])),
    st.tuples(st.just("partition"), st.tuples(*[st.integers(0, 2)] * len(IDS))),
    st.tuples(st.just("restart"), robots),
    st.tuples(st.just("crash"), robots),
)


@given(
    link=links,
    reliable=st.booleans(),
    corrupt=st.sampled_from([0.0, 0.1]),
    script=st.lists(steps, max_size=25),
    seed=st.integers(0, 2**16),
    boots_rise=st.booleans(),
)
@settings(max_examples=CASES, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
def test_any_history_ends_in_equal_knowledge(link, reliable, corrupt, script, seed, boots_rise):
    team = Team(IDS, seed=seed, link=link, reliable=reliable, corrupt=corrupt)
    for action, argument in script:
        if action == "publish" and argument in team.nodes:
            team.publish(argument)
        elif action == "run":
            team.run(argument)
        elif action == "partition":
            team.groups = dict(zip(IDS, argument, strict=True))
        elif action in ("crash", "restart"):
            if argument in team.nodes:
                team.crash(argument)
            if action == "restart":
                # Boot ids may be random: then a restarted robot must outrank its own past by itself.
                random_boot = 10_000 + (seed * 7919 + team.boots * 104_729) % 1_000_003
                team.start(argument, None if boots_rise else random_boot)
    team.groups, team.corrupt = {}, 0.0
    team.link = LinkConditions(delay_s=0.01)
    for robot in list(team.nodes):
        team.publish(robot)
    assert team.run_until_agreed(90.0), team.digests()
