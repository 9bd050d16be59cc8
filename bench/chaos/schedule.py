"""Random missions full of faults, each from one seed."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from typing import Any

import numpy as np

from mrslam.sim_driver.faults.config import KINDS
from mrslam.sim_driver.worlds import DRAWN

LENGTH_S = 75.0
"""Mission time, seconds."""
HEALED_S = 36.0
"""No fault lasts longer: a robot that then doubts its map in vain has time to give it up and to begin another."""
REST_S = 50.0
"""From here on no laser gives anything, so that maps stand still and knowledge can become equal."""
WORLDS = ("arena2", "arena1", "arena2", "symmetric-house")
AMOUNTS = {"clock": (-8.0, 20.0), "slow": (2.0, 8.0), "odometry_jump": (-3.0, 3.0), "kidnapped": (2.0, 6.0)}
ONE_EACH = ("kidnapped", "liar", "clock")
"""Faults that a mission has at most one robot suffer from."""


def chaos_tables(seed: int, world: str | None = None) -> dict[str, Any]:
    """Return a mission, as tables: two to four robots in a small world, and one to six faults.

    ``world`` : instead of one by chance: "hotel" and "office" are drawn by the seed.
    """
    rng = np.random.default_rng([seed, 0xC4A05])
    robots = [f"r{i + 1}" for i in range(int(rng.choice([2, 3, 3, 4])))]
    kinds = [str(kind) for kind in rng.choice([kind for kind in KINDS if kind != "laser_off"], int(rng.integers(1, 7)))]
    faults = []
    for i, kind in enumerate(kinds):
        if kind in ONE_EACH and kind in kinds[:i]:
            continue
        low, high = AMOUNTS.get(kind, (1.0, 1.0))
        at_s = 0.0 if kind == "liar" else float(rng.uniform(3.0, 28.0))
        for_s = LENGTH_S if kind == "liar" else min(float(rng.uniform(2.0, 14.0)), HEALED_S - at_s)
        faults.append(
            {
                "kind": kind,
                "robot": str(rng.choice(robots)),
                "at_s": round(at_s, 2),
                "for_s": round(for_s, 2),
                "amount": round(float(rng.uniform(low, high)), 2),
            }
        )
    drawn = str(rng.choice(WORLDS))
    if world is not None:
        drawn = f"{world}:{seed}" if world in DRAWN else world
    rest = [{"kind": "laser_off", "robot": robot, "at_s": REST_S, "for_s": LENGTH_S} for robot in robots]
    return {
        "mission": {"name": "chaos", "shell": "virtual", "seed": seed, "duration_s": LENGTH_S},
        "world": {"name": drawn},
        "robots": [{"id": robot, "laser": "lidar-360"} for robot in robots],
        "rbpf": {"particles": 4, "threads": 1},
        "comms": {"exchange_timeout_s": 3.0, "link_threshold": 0.5, "beacon_window": 8},
        "agent": {"checkpoint_interval_s": 4.0, "align_interval_s": 5.0, "give_up_s": 10.0},
        "faults": faults + rest,
    }


def with_fault(kind: str | None, first: int, world: str | None = None) -> Iterator[int]:
    """Yield the seeds from ``first`` on of missions with a fault of this kind; of all without one."""
    for seed in count(first):
        if kind is None or any(fault["kind"] == kind for fault in chaos_tables(seed, world)["faults"]):
            yield seed
