"""A robot that sees another drive towards it, and what it knows and claims of where their maps lie."""

from __future__ import annotations

import numpy as np

from mrslam.agent import Agent
from mrslam.agent.effects import AlignJob, Event
from mrslam.agent.witness import Witness
from mrslam.alignment import Alignment, Evidence
from mrslam.alignment.evidence import WallEvidence
from mrslam.comms import TeammateClaim, TeammatePose
from mrslam.comms.effects import EPOCHS
from mrslam.merge.graph.edges import pair_of
from mrslam.mutual_detection import MutualDetectionConfig, find_bodies
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform
from tests.agent.duo import S, live, robot
from tests.mutual_detection.sights import RADIUS_M, sweep
from tests.mutual_detection.test_encounters import FRAMES, MATE, OWN

NEARER = se2.compose(se2.inverse(FRAMES[0]), se2.compose(se2.transform(-1.6, 0.0, 0.0), FRAMES[1]))
"""Where r2's map would have it 1.6 m nearer to r1 than it is: on free floor."""


BEGIN = 100 * S


def met(own: str = "r1") -> Agent:
    """Return a robot that holds the map of r2."""
    one, two = robot(own, 1), robot("r2", 1)
    live([one, two], 0, 60)
    assert pair_of(own, "r2") in one.team.beliefs
    return one


def watch(
    one: Agent, *, mutual: bool = False, encounters: bool = True, epoch: int | None = None, visible: bool = True
) -> tuple[Witness, list[Event]]:
    """Let a robot see r2 drive towards it, every second; return what it concludes.

    ``mutual`` : r2 tells what it sees; ``epoch`` : of the map in which it says where it is; ``visible`` : whether every
    laser meets teammates' bodies.
    """
    config = MutualDetectionConfig(encounters=encounters, teammates_visible=visible)
    witness, effects = Witness(one.robot_id, config), []
    epoch = one.team.maps["r2"].epoch if epoch is None else epoch
    for k, (own, mate) in enumerate(zip(OWN, MATE, strict=True)):
        t_ns = BEGIN + k * S
        witness.on_scan(sweep(own, [mate[:2]], seed=k), se2.between(FRAMES[0], own), t_ns)
        bodies = find_bodies(sweep(mate, [own[:2]], seed=k + 50), RADIUS_M) if mutual else np.empty((0, 2))
        report = TeammatePose("r2", t_ns, se2.between(FRAMES[1], mate), epoch, bodies)
        witness.on_report(report, one.team, t_ns)
        effects += witness.look(one.team, t_ns)
    return witness, effects


def claim(one: Agent, T_r1_r2: Transform, llr: float) -> TeammateClaim:
    """Return what r2 says of the maps that r1 knows now."""
    epochs = (one.team.maps["r2"].epoch, one.team.maps["r1"].epoch)
    return TeammateClaim("r2", epochs[0], "r1", se2.inverse(T_r1_r2), llr, epochs[1] % EPOCHS)


def walls(matched_m: float, contradicted_m: float) -> Evidence:
    one = WallEvidence(matched_m, 0.0, contradicted_m, 0.0)
    return Evidence(a=one, b=one, walls=9, margin=0.1)


def merge_pair(
    one: Agent, pair: tuple[str, str], T_a_b: Transform, confidence: float = 0.8, wall_m: float = 60.0
) -> None:
    """Let a robot find twice how two maps lie."""
    maps = [one.team.maps[name] for name in pair]
    found = Alignment(T_a_b, confidence, walls(wall_m, 0.0), np.eye(3) * 1e-4, "auto")
    for t_ns in (0, 20 * S):
        versions, areas = (maps[0].version, maps[1].version), (maps[0].area_m2, maps[1].area_m2 + t_ns / S)
        one.on_done(AlignJob(*pair, maps[0].grid, maps[1].grid, None, versions, areas, 0), found, t_ns)


def through_r3(one: Agent, T_r1_r2: Transform) -> None:
    """Have r1 merge with r3, and r3 with r2, so that r2 lies at ``T_r1_r2``; the second alignment is the weaker."""
    one.team.take_map("r3", one.team.maps["r2"])
    T_r1_r3 = se2.transform(0.3, 0.1, 0.2)
    merge_pair(one, ("r1", "r3"), T_r1_r3, 0.9)
    merge_pair(one, ("r2", "r3"), se2.between(T_r1_r2, T_r1_r3), 0.7)
    assert {"r2", "r3"} <= one.T_team_map.keys() and one.team.beliefs["r1", "r2"].alignment is None
