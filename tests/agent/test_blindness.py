from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrslam.agent import Agent, Event, Settings
from mrslam.rbpf import MapperConfig
from tests.rbpf.rooms import drive, make_scan

S = 1_000_000_000


def test_a_robot_says_when_its_laser_is_of_no_use_and_goes_on_by_its_wheels() -> None:
    agent = Agent("r1", Settings(rbpf=MapperConfig(particles=6, threads=1)))
    rng, told = np.random.default_rng(1), []
    poses = drive(100)
    for k, pose in enumerate(poses):
        t_ns = k * S // 10
        scan = make_scan(pose, t_ns, rng=rng)
        if 40 <= k < 70:
            scan = replace(scan, ranges_m=rng.uniform(0.0, 40.0, 180).astype(np.float32))
        told += [e for e in agent.on_scan(scan, pose, t_ns) if isinstance(e, Event) and e.kind in ("blind", "sees")]
        assert np.hypot(*(agent.mapper.T_map_base - pose)[:2]) < 0.15
    blind, sees = told
    assert (blind.kind, blind.t_ns) == ("blind", 49 * S // 10) and "no surfaces" in blind.fields["reason"]
    assert (sees.kind, sees.t_ns, sees.fields) == ("sees", 7 * S, {"blind_s": 3.1})
    assert not agent.self_doubt.doubtful


def test_a_few_bad_scans_are_not_worth_a_word() -> None:
    agent = Agent("r1", Settings(rbpf=MapperConfig(particles=6, threads=1)))
    rng = np.random.default_rng(1)
    for k in range(40):
        scan = make_scan(np.zeros(3), k * S // 10, rng=rng)
        if k % 5:
            scan = replace(scan, ranges_m=np.full(180, np.inf, dtype=np.float32))
        events = agent.on_scan(scan, np.zeros(3), k * S // 10)
        assert not [e for e in events if isinstance(e, Event) and e.kind in ("blind", "sees")]
