"""Two robots drive towards each other in a corridor, knowing nothing of where the other began."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.agent import Agent
from mrslam.agent.effects import AlignJob, JoinJob
from mrslam.alignment import Rejection
from mrslam.merge import join
from mrslam.mutual_detection import MutualDetectionConfig
from mrslam.spatial import Scan, se2
from tests.agent.duo import SETTINGS, S, deliver, talk
from tests.mutual_detection.sights import sweep, way
from tests.mutual_detection.test_encounters import CORRIDOR_Y

SCANS = 90
ONE = way((3.0, CORRIDOR_Y), (6.0, CORRIDOR_Y), SCANS, 0.3)
TWO = [se2.compose(T, se2.transform(0.0, 0.0, np.pi)) for T in way((10.0, CORRIDOR_Y), (7.0, CORRIDOR_Y), SCANS, 0.4)]


def meeting(*, encounters: bool = True, bodies: bool = True) -> tuple[Agent, Agent]:
    """Return r1 and r2 after they met; alignment by maps finds nothing. ``bodies`` : whether lasers see robots."""
    settings = replace(SETTINGS, mutual_detection=MutualDetectionConfig(encounters=encounters))
    agents = [Agent(name, settings, boot_id=1) for name in ("r1", "r2")]
    for k in range(SCANS):
        ways = (ONE, TWO)
        for i, agent in enumerate(agents):
            own, other = ways[i][k], ways[1 - i][k]
            seen = sweep(own, [other[:2]] if bodies else [], seed=2 * k + i)
            scan = Scan(
                **{**{name: getattr(seen, name) for name in seen.__dataclass_fields__}, "stamp_ns": k * S // 10}
            )
            deliver(agents, agent, agent.on_scan(scan, se2.between(ways[i][0], own), k * S // 10), k)
        talk(agents, k)
        for agent in agents:
            work(agents, agent, k)
    return agents[0], agents[1]


def work(agents: list[Agent], agent: Agent, k: int) -> None:
    """Do a robot's next job: maps alone say nothing."""
    job = agent.next_job(k * S // 10)
    if isinstance(job, AlignJob):
        deliver(agents, agent, agent.on_done(job, Rejection("too little", 0.1, None, "auto"), k * S // 10), k)
    elif isinstance(job, JoinJob):
        deliver(agents, agent, agent.on_done(job, join(job.trails, job.T_team_map), k * S // 10), k)


def test_robots_that_see_each_other_merge_without_any_help_of_their_maps() -> None:
    one, two = meeting()
    T_r1_r2 = se2.between(ONE[0], TWO[0])
    for agent, T in ((one, T_r1_r2), (two, se2.inverse(T_r1_r2))):
        found = agent.T_team_map["r2" if agent is one else "r1"]
        off_m, off_rad = se2.difference(found, T)
        assert off_m < 0.3 and off_rad < 0.05
        belief = agent.team.beliefs["r1", "r2"]
        assert belief.alignment is not None and belief.alignment.method == "sight"
        (place,) = belief.places
        told_by = "r2" if agent is one else "r1"
        assert place.own is not None and place.own.seen >= 2 and place.told[told_by] >= 2.0
    assert 0 < one.node.sightings_bytes < 400


@pytest.mark.parametrize("options", [{"encounters": False}, {"bodies": False}])
def test_robots_that_do_not_look_or_do_not_see_do_not(options: dict[str, bool]) -> None:
    one, two = meeting(**options)
    assert "r2" not in one.T_team_map and "r1" not in two.T_team_map
    assert one.node.sightings_bytes < (100 if "bodies" in options else 1)
