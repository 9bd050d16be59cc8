"""One chaos mission: run it, and say what broke."""

from __future__ import annotations

import tempfile
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bench.chaos.invariants import Invariants
from bench.chaos.scene import REST
from bench.chaos.schedule import chaos_tables
from mrslam.sim_driver.evaluate.truth import Judge
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.run.run_virtual import VirtualTeam, run_in_virtual_time
from mrslam.sim_driver.simulation.simulation import make_world


@dataclass(frozen=True)
class Outcome:
    """What came of one chaos mission."""

    seed: int
    violations: list[str]
    faults: Counter[str]
    """How often each kind was played."""
    figures: dict[str, Any] = field(default_factory=dict)
    """What was measured, plain JSON values by name."""


def died(seed: int) -> Outcome:
    """Return the outcome of a mission whose process died."""
    return Outcome(seed, ["the process that played it died"], Counter())


def run_chaos(seed: int, folder: Path, world: str | None = None) -> Outcome:
    """Play the mission of this seed in the folder and check it at every step."""
    mission = make_mission(chaos_tables(seed, world), folder / "chaos.toml")
    built = make_world(mission)
    invariants = Invariants(mission, Judge(built.grid, built.reachable))

    def watch(team: VirtualTeam, now_ns: int) -> None:
        invariants(team, now_ns)
        if now_ns / 1e9 >= (mission.mission.duration_s or 0.0) - 0.15:
            invariants.at_end(team, now_ns)

    try:
        run_in_virtual_time(mission, folder, lambda mission_s, total_s, text: None, watch)
    except Exception as error:  # noqa: BLE001 - whatever it is, it is a violation, and the seed shows it again
        invariants.violations.append(f"{type(error).__name__}: {error}")
    played = Counter(fault.kind for fault in mission.faults if fault.kind != REST)
    figures = {"world": built.name, **invariants.report.figures}
    return Outcome(seed, invariants.violations, played, figures)


def play_chaos(seed: int, world: str | None = None) -> Outcome:
    """Play the mission of this seed in a folder that is gone afterwards."""
    with tempfile.TemporaryDirectory() as folder:
        return run_chaos(seed, Path(folder), world)
