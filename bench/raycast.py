"""Beams a second on one core: ``python bench/raycast.py [WORLD]``."""

import argparse
import time

import numpy as np

from mrslam.sim_driver.robots.raycast import cast, leap_field
from mrslam.sim_driver.worlds import load_world


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("world", nargs="?", default="office", help="built-in world, map YAML or bitmap")
    world = load_world(parser.parse_args().world)
    rng = np.random.default_rng(0)
    leap = leap_field(world.clearance_cells)
    poses = [world.free_start(rng) for _ in range(2000)]
    out = np.empty(360, dtype=np.float32)
    arguments = [(p[0] / world.resolution_m, p[1] / world.resolution_m, p[2]) for p in poses]
    step = 2 * np.pi / out.size
    cast(leap, *arguments[0], -np.pi, step, 80.0 / world.resolution_m, out)
    start = time.process_time()
    total = 0.0
    for x, y, heading in arguments:
        cast(leap, x, y, heading, -np.pi, step, 80.0 / world.resolution_m, out)
        total += float(out.sum())
    spent = time.process_time() - start
    beams = len(arguments) * out.size
    mean_m = total / beams * world.resolution_m
    print(f"{world.name}: {beams / spent / 1e6:.2f} million beams/s, mean range {mean_m:.2f} m")


if __name__ == "__main__":
    main()
