"""Nothing is left to be compiled once a robot maps: that would hold up its scans for seconds."""

from __future__ import annotations

import subprocess
import sys

CHECK = """
import sys
import numpy as np
from mrslam import rbpf
from mrslam.rbpf.front_end.health import Health
from mrslam.sim_driver import robots
from mrslam.sim_driver.robots import LASERS, SimulatedRobot
from mrslam.sim_driver.worlds import load_world

rbpf.warm_up()
robots.warm_up()
world = load_world("office")
robot = SimulatedRobot(world, world.free_start(np.random.default_rng(1)), LASERS["lidar-360"], np.random.default_rng(2))
mapper = rbpf.Mapper(rbpf.MapperConfig(particles=5, threads=1), seed=0)


def compiled():
    rooms = [module for name, module in sys.modules.items() if name.startswith(("mrslam.rbpf", "mrslam.spatial"))]
    things = [thing for module in rooms for thing in vars(module).values()]
    kernels = [thing for thing in things if hasattr(thing, "py_func") and hasattr(thing, "signatures")]
    return {(kernel.__module__, kernel.__name__): len(kernel.signatures) for kernel in kernels}


before, is_adrift, most = compiled(), Health.is_adrift, 0
for k in range(80):
    Health.is_adrift = property(lambda health: True) if k < 60 else is_adrift  # several particles
    if k == 60:  # carried off
        robot.T_world_base = world.free_start(np.random.default_rng(5))
    if k != 60:
        robot.step((0.5, 0.3 if k % 20 < 10 else -0.3), 0.2)
    mapper.update(robot.scan(k * 200_000_000), robot.T_odom_base)
    most = max(most, mapper._back.filter.count)
assert most == 5
mapper.snapshot()
print(*[name for (room, name), count in compiled().items() if count > before[room, name]])
"""


def test_a_robot_that_maps_compiles_nothing_after_warming_up() -> None:
    done = subprocess.run([sys.executable, "-c", CHECK], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == []
