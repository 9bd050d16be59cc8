"""Two robots that turn in the same room, over a link as good as a test wants it."""

from __future__ import annotations

import numpy as np

from mrslam.agent import Agent, AgentConfig, Settings
from mrslam.agent.effects import Effect
from mrslam.alignment import Alignment, Evidence
from mrslam.comms import CommsConfig, Send
from mrslam.merge import MergeConfig
from mrslam.rbpf import MapperConfig
from mrslam.spatial import Scan

S = 1_000_000_000
SETTINGS = Settings(
    rbpf=MapperConfig(particles=3),
    comms=CommsConfig(link_source="model", exchange_timeout_s=1.0),
    agent=AgentConfig(give_up_s=3.0),
    merge=MergeConfig(contradiction_min_m=1e3),  # any transform will do
)
TURN_RAD = 0.02
"""By which the robots turn from scan to scan."""


def scan(k: int) -> Scan:
    """What a robot sees that stands in a corner of a room and turns a little with every scan."""
    angles = np.linspace(-2.0, 2.0, 181) + TURN_RAD * k
    walls = np.stack([4.0 / np.abs(np.cos(angles)), 3.0 / np.abs(np.sin(angles) + 1e-9)]).min(axis=0)
    return Scan(
        stamp_ns=k * S // 10, ranges_m=walls.astype(np.float32), angle_min_rad=-2.0, angle_increment_rad=4.0 / 180,
        range_max_m=30.0,
    )  # fmt: skip


def odometry(k: int) -> np.ndarray:
    """What the wheels say at that scan."""
    return np.array([0.0, 0.0, TURN_RAD * k])


def robot(name: str, boot_id: int, settings: Settings = SETTINGS) -> Agent:
    return Agent(name, settings, boot_id=boot_id)


def live(agents: list[Agent], first: int, last: int, quality: float = 1.0) -> None:
    """Let the agents map and talk; beacons get through at any quality."""
    for k in range(first, last):
        for agent in agents:
            deliver(agents, agent, agent.on_scan(scan(k), odometry(k), k * S // 10), k)
        talk(agents, k, quality)


def talk(agents: list[Agent], k: int, quality: float = 1.0) -> None:
    """Let the agents talk at the time of a scan."""
    for agent in agents:
        for other in agents:
            agent.set_link_quality(other.robot_id, quality, k * S // 10)
        deliver(agents, agent, agent.on_tick(k * S // 10), k)


def deliver(agents: list[Agent], sender: Agent, effects: list[Effect], k: int) -> None:
    """Hand on what an agent sends, and all that follows from it."""
    post = [(sender, effect) for effect in effects]
    while post:
        source, effect = post.pop(0)
        if isinstance(effect, Send):
            for other in agents:
                if other is not source and effect.to in (None, other.robot_id):
                    back = other.on_message(effect.payload, source.robot_id, k * S // 10)
                    post += [(other, one) for one in back]


def merge(one: Agent, T_r1_r2: list[float]) -> None:
    """Let r1 find twice how r2's map lies."""
    found = Alignment(np.array(T_r1_r2), 0.8, Evidence(walls=9), np.eye(3) * 1e-4, "auto")
    for t_ns in (0, 20 * S):
        job = one.next_job(t_ns)
        assert job is not None
        one.on_done(job, found, t_ns)
    assert "r2" in one.T_team_map
