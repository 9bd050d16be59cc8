"""Mutants of the worlds that simulated robots drive in, and of their radio."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "sim_driver/worlds/radio.py",
        "- config.wall_loss_db * walls - shadowing_db",
        "- shadowing_db",
        "walls do not weaken the radio",
    ),
    Mutant(
        "sim_driver/worlds/radio.py",
        "return self.delivery**2",
        "return self.delivery",
        "links seem better than beacons of both sides would measure",
    ),
    Mutant(
        "sim_driver/worlds/campus.py",
        "    _enter(cells)\n",
        "",
        "buildings of a campus are entered from one side only",
    ),
    Mutant(
        "sim_driver/worlds/__init__.py",
        "    cells = is_wall[::-1].astype",
        "    cells = is_wall.astype",
        "worlds of bitmaps are upside down: starts and waypoints are in other rooms than drawn",
    ),
    Mutant(
        "sim_driver/worlds/__init__.py",
        "is_wall = grey < DARK_BELOW if opaque is None else (grey < DARK_BELOW) & opaque",
        "is_wall = grey < DARK_BELOW",
        "a plan drawn on a transparent background is one solid wall",
    ),
    Mutant(
        "sim_driver/worlds/radio.py",
        "        return np.where(is_turned[:, None], b, a), np.where(is_turned[:, None], a, b)",
        "        return a, b",
        "where the line between two robots grazes a corner, one hears the other better than it is heard",
    ),
    Mutant(
        "sim_driver/worlds/world.py",
        "return bool(a == b)",
        "return True",
        "a mission with a waypoint in a closed room never ends",
    ),
    Mutant(
        "sim_driver/worlds/world.py",
        "inside.max() > 0.02 * area.max() else area",
        "inside.max() > 0.02 * area.max() else inside",
        "in a plan that is open to the outside robots start within walls",
    ),
    Mutant(
        "sim_driver/worlds/world.py",
        "np.maximum(cells - 0.5, 0.0) * self.resolution_m",
        "np.maximum(cells, 0.0) * self.resolution_m",
        "robots come half a cell too near to walls",
    ),
    Mutant(
        "sim_driver/worlds/world.py",
        ">= 2.0 * clearance_m\n",
        ">= clearance_m\n",
        "robots start where they touch each other",
    ),
    Mutant(
        "sim_driver/worlds/world.py",
        "reach = int(2.0 * clearance_m",
        "reach = int(1.0 * clearance_m",
        "robots start where they touch each other, on either side",
    ),
    Mutant(
        "sim_driver/worlds/world.py",
        "top, left = max(row - reach, 0), max(col - reach, 0)",
        "top, left = row - reach, col - reach",
        "robots start on one that stands beside the left or lower outer wall",
    ),
    Mutant(
        "sim_driver/worlds/world.py",
        "rng.uniform(-np.pi, np.pi)",
        "0.0",
        "all simulated robots start along +x",
    ),
    Mutant(
        "sim_driver/worlds/world.py",
        "+ 0.5) * self.resolution_m",
        "+ 0.0) * self.resolution_m",
        "robots start at the corners of cells, nearer to walls than asked for",
    ),
    Mutant(
        "sim_driver/worlds/world.py",
        "            cells[:, [0, -1]] = WALL\n",
        "",
        "robots leave a plan without outer walls on the left and on the right",
    ),
    Mutant(
        "sim_driver/worlds/world.py",
        "inside[np.unique(ring)] = 0\n",
        "pass\n",
        "robots start outside of the building",
    ),
    Mutant(
        "sim_driver/worlds/canvas.py",
        "gap <= radius_m",
        "gap <= 2 * radius_m",
        "pillars are twice as wide as drawn",
    ),
    Mutant(
        "sim_driver/worlds/canvas.py",
        "max(self._cell(a), 0), max(self._cell(b), 0)",
        "self._cell(a), self._cell(b)",
        "boxes that reach over a plan's edge vanish",
    ),
    Mutant(
        "sim_driver/worlds/radio.py",
        "(one - np.asarray(grid.origin_m)) / grid",
        "(one) / grid",
        "in worlds of map files the radio passes walls, or is weakened where there are none",
    ),
    Mutant(
        "sim_driver/worlds/radio.py",
        "- config.wall_loss_db * walls - shadowing_db",
        "- config.wall_loss_db * walls + shadowing_db",
        "a link's shadowing is told as a loss and strengthens it",
    ),
    Mutant(
        "sim_driver/worlds/radio.py",
        "np.minimum(np.hypot(*(places_m[j] - places_m[i]).T), 1.0)",
        "1.0",
        "robots side by side may not hear each other",
    ),
    Mutant(
        "sim_driver/worlds/radio.py",
        "max(distance, 0.3)",
        "max(distance, 0.0)",
        "a mission fails where two robots stand at one place",
    ),
    Mutant(
        "sim_driver/run/run_virtual.py",
        "_conditions(self._radios, mission.radio)",
        "_conditions(self._radios, RadioConfig())",
        "radio.bandwidth_bit_s and radio.latency_s have no effect",
    ),
    Mutant(
        "sim_driver/worlds/radio.py",
        "walls += wall and not inside",
        "walls += wall",
        "a thick wall weakens the radio as many walls do",
    ),
    Mutant(
        "sim_driver/worlds/campus.py",
        "sum(depths[:i]) + (i + 1) * yard",
        "sum(depths[:i]) + i * yard",
        "there is no yard in front of a campus",
    ),
    Mutant(
        "sim_driver/worlds/campus.py",
        "is_yard[around].all() and not plan.cells[around].any()",
        "True",
        "trees of a campus stand in buildings and in entrances",
    ),
    Mutant(
        "sim_driver/worlds/radio.py",
        "carries = self.bandwidth_bit_s == 0.0 or self.bandwidth_bit_s >= 1.0",
        "carries = True",
        "a mission whose radio carries next to nothing ends with an overflow",
    ),
)
