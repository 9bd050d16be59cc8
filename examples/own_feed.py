"""Feed agents from a laser of your own, in virtual time: python examples/own_feed.py [SECONDS] [OUT].

With ``ProcessShell`` and ``WallClock`` of ``mrslam.agent`` and ``mrslam.comms.zenoh.ZenohTransport`` in place of the
last lines the same body runs on a real robot.
"""

import sys
from pathlib import Path

import numpy as np

from mrslam.agent import Agent, Runner, Sensed, Settings, VirtualRobot, run_virtual
from mrslam.comms import MemoryNetwork
from mrslam.sim_driver.robots import LASERS, SimulatedRobot
from mrslam.sim_driver.worlds import load_world
from mrslam.spatial import se2


class MyRobot:
    """A body: gives scans with odometry when they are due. Ask your laser's driver where this asks a simulation."""

    next_ns = 0
    finished = False

    def __init__(self, x_m, y_m, seed):
        start = se2.transform(x_m, y_m, 0.0)
        rng = np.random.default_rng(seed)
        self.robot = SimulatedRobot(load_world("arena2"), start, LASERS["lidar-360"], rng)

    def sense(self, now_ns):
        """Return the next scan that is due, or None; the shell asks until there is none."""
        if now_ns < self.next_ns:
            return None
        self.robot.step((0.2, 0.3), dt_s=0.2)  # metres and radians a second
        sensed = Sensed(self.next_ns, self.robot.scan(self.next_ns), self.robot.T_odom_base)
        self.next_ns += 200_000_000
        return sensed

    def act(self, agent, now_ns):
        """Drive by what the agent knows (agent.planning_grid(), agent.mapper.T_map_base): here nothing to do."""


duration_s, out = float((*sys.argv, "40")[1]), Path((*sys.argv, "", "out/example")[2] or "out/example")
network, robots = MemoryNetwork(seed=1), []
for name, x_m, y_m in (("r1", 7.2, 4.2), ("r2", 9.5, 4.0)):
    agent = Agent(name, Settings(), team="arena", seed=1)
    robots.append(VirtualRobot(Runner(agent, MyRobot(x_m, y_m, len(robots)), network.attach(name), out / name)))
run_virtual(robots, network, step_ns=100_000_000, duration_ns=round(duration_s * 1e9), linger_ns=0)
for robot in robots:
    agent = robot.runner.agent
    placed = {name: np.round(T, 2).tolist() for name, T in agent.T_team_map.items() if name != agent.robot_id}
    print(f"{agent.robot_id}: {agent.known_area_m2():.0f} m2; teammates' maps in its own: {placed or 'none'}")
