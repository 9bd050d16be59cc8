"""A robot that lost its memory meets who knew it: its map gets another label, and what it merged meanwhile stays."""

from __future__ import annotations

import numpy as np

from mrslam.agent import Agent
from mrslam.agent.effects import AlignJob
from mrslam.alignment import Rejection
from tests.agent.duo import S, live, robot
from tests.agent.pairs.floors import found


def merge_with(one: Agent, other: str, t_s: float) -> None:
    """Let a robot find a teammate's map twice, and nothing of other pairs."""
    for k in range(30):
        now_ns = round((t_s + k) * S)
        job = one.next_job(now_ns)
        if isinstance(job, AlignJob):
            is_meant = {job.a, job.b} == {one.robot_id, other}
            one.on_done(job, found(1.0) if is_meant else Rejection("too little", 0.1, None, "auto"), now_ns)
    assert other in one.T_team_map


def test_who_has_to_label_its_map_above_an_earlier_life_in_the_middle_of_this_one_keeps_its_merges() -> None:
    before, two = robot("r1", 50), robot("r2", 1)
    live([before, two], 0, 60)
    assert two.team.maps["r1"].epoch == 50
    one, three = robot("r1", 1), robot("r3", 1)  # the same robot, from nothing, out of reach of r2
    live([one, three], 60, 120)
    assert one.team.maps["r1"].epoch == 1
    merge_with(one, "r3", 12.0)
    T_r1_r3 = one.T_team_map["r3"].copy()
    live([one, two, three], 420, 480)
    assert one.team.maps["r1"].epoch == 51 == two.team.maps["r1"].epoch  # it met r2, and went above what that held
    belief = one.team.beliefs["r1", "r3"]
    assert belief.status == "accepted" and np.array_equal(one.T_team_map["r3"], T_r1_r3)
