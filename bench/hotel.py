"""Buildings that repeat themselves: wrong places believed, and merges of robots that met face to face.

    python -m bench.hotel --missions 20 --seed 0

Each mission is 2 to 6 robots (``--robots`` : fewer at most) in ``hotel:SEED``. One JSON line at the end:

* ``wrong_s`` : robot seconds for which a teammate's map was placed wrongly (0.5 m, 5 degrees); ``wrong_met_s`` : the
  longest time that one robot believed a wrong place after the two robots had stood in free sight of each other;
* ``wrong_at_end`` : placements wrong when the missions ended, of ``placed_at_end``;
* ``met``, ``met_merged`` : robots that had a teammate in free sight within ``SIGHT_M``, and those of them that had
  merged its map, rightly, at the end; ``merge_s`` : median and 95th percentile from first sight to merge, 0 where it
  was merged before (never merged counts as never);
* ``bytes`` : all that was sent, and ``sightings_share`` of it for what robots told each other of what they saw;
* ``died_seeds`` : missions whose process died; the figures are of the others.

With ``--liar`` the first robot says in hints that it found others' maps where they are not. Ctrl-C prints the line of
what was played until then.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from collections import defaultdict
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track

from bench.chaos.scene import Frames
from bench.workers import play_all
from mrslam.agent import Agent, VirtualRobot
from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.pairs.hints import NOTHING_TRACKED, Hints
from mrslam.merge import Pair
from mrslam.sim_driver.evaluate.truth import is_false_merge, pair_error
from mrslam.sim_driver.kernels import ensure_compiled
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.run.run_virtual import VirtualTeam, run_in_virtual_time
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

SIGHT_M = 5.0
"""Robots nearer than this with no wall between them are face to face, metres: half of a small laser's reach."""
LIE_NS = 3_000_000_000
"""Time between two lies, nanoseconds."""
EVERY_NS = 500_000_000
"""Time between two looks at the robots, nanoseconds."""


@dataclass(frozen=True)
class Plan:
    """What all missions of a run share."""

    kind: str
    """Of world: "hotel" or "office"."""
    most_robots: int
    seconds: float
    walkers: int
    """People who walk about, and are as large as robots."""
    liar: bool
    """Whether the first robot lies in hints."""
    settings: dict[str, Any]
    """Sections of the mission's file that differ from the usual ones."""


def tables(seed: int, plan: Plan) -> dict[str, Any]:
    """Return the mission of a seed, as tables."""
    rng = np.random.default_rng([seed, 0x407E1])
    return {
        "mission": {"name": plan.kind, "shell": "virtual", "seed": seed, "duration_s": plan.seconds},
        "world": {"name": f"{plan.kind}:{seed}", "walkers": plan.walkers},
        "robots": [
            {"id": f"r{i + 1}", "laser": "lidar-360"} for i in range(int(rng.integers(2, plan.most_robots + 1)))
        ],
        "rbpf": {"particles": 4, "threads": 1},
        "comms": {"exchange_timeout_s": 5.0, "link_threshold": 0.5},
        "agent": {"align_interval_s": 5.0},
        **plan.settings,
    }


class Lies(Hints):
    """Tells of every teammate's map that it was found elsewhere, and somewhere else every few seconds."""

    def news(
        self, beliefs: Mapping[Pair, PairBelief], now_ns: int, tracked: Mapping[str, Transform] = NOTHING_TRACKED
    ) -> list[tuple[str, Transform]]:
        """Return a place for each, away from the right one where that is known."""
        if now_ns % LIE_NS:
            return []
        rng, lies = np.random.default_rng(now_ns), []
        right = dict(self._found(beliefs))
        for robot in sorted({name for pair in beliefs if self.own_id in pair for name in pair} - {self.own_id}):
            away = np.append(rng.uniform(-4.0, 4.0, 2), rng.choice([0.0, np.pi]))
            lies.append((robot, se2.compose(right.get(robot, rng.uniform(-20.0, 20.0, 3)), away)))
        return lies


class Watch:
    """Follows what every robot believes of every other in one mission."""

    def __init__(self) -> None:
        self.frames = Frames()
        self.first_sight_s: dict[tuple[str, str], float] = {}
        self.merged_s: dict[tuple[str, str], float] = {}
        self.wrong_s = 0.0
        self.wrong_since_s: dict[tuple[str, str], float] = {}
        self.longest_s: defaultdict[tuple[str, str], float] = defaultdict(float)
        self.right: dict[tuple[str, str], bool] = {}

    def __call__(self, team: VirtualTeam, now_ns: int) -> None:
        """Look at all robots."""
        assert team.simulation is not None
        poses = team.simulation.fleet.T_world_base()
        agents = {r.runner.agent.robot_id: r.runner.agent for r in team.robots if isinstance(r, VirtualRobot)}
        for robot_id, agent in agents.items():
            self.frames.look(robot_id, agent, poses[robot_id], now_ns)
        if now_ns % EVERY_NS:
            return
        self.right.clear()
        for one, agent in agents.items():
            for other in agents.keys() - {one}:
                a, b = poses[one][:2], poses[other][:2]
                if np.hypot(*(a - b)) <= SIGHT_M and team.simulation.radio.walls(a, b) == 0:
                    self.first_sight_s.setdefault((one, other), now_ns / 1e9)
                self._judge(agent, (one, other), now_ns / 1e9)

    def _judge(self, agent: Agent, pair: tuple[str, str], now_s: float) -> None:
        own, there = (self.frames.of(x, agent.node.store.version(x)[0]) for x in pair)
        T_own_other = agent.T_team_map.get(pair[1])
        if T_own_other is None or own is None or there is None:
            self.wrong_since_s.pop(pair, None)
            return
        off_m, off_deg = pair_error(T_own_other, own, there)
        self.right[pair] = not is_false_merge(off_m, off_deg)
        if self.right[pair]:
            self.merged_s.setdefault(pair, now_s)
            self.wrong_since_s.pop(pair, None)
            return
        self.wrong_s += EVERY_NS / 1e9
        begin_s = self.wrong_since_s.setdefault(pair, now_s)
        if pair in self.first_sight_s:
            held_s = now_s - max(begin_s, self.first_sight_s[pair])
            self.longest_s[pair] = max(self.longest_s[pair], held_s)


def play(seed: int, plan: Plan) -> dict[str, Any]:
    """Play one mission and return its figures."""
    with tempfile.TemporaryDirectory() as folder:
        mission, watch = make_mission(tables(seed, plan), Path(folder) / "hotel.toml"), Watch()
        sent: dict[str, int] = defaultdict(int)

        def look(team: VirtualTeam, now_ns: int) -> None:
            first = team.robots[0]
            if plan.liar and isinstance(first, VirtualRobot) and not isinstance(first.runner.agent.team.hints, Lies):
                first.runner.agent.team.hints = Lies(first.runner.agent.robot_id)
            watch(team, now_ns)
            if now_ns / 1e9 >= plan.seconds - 0.15:
                for robot in team.robots:
                    if isinstance(robot, VirtualRobot):
                        for lane, count in robot.runner.agent.node.bytes_sent.items():
                            sent[lane] += count
                        sent["of_beacons_sightings"] += robot.runner.agent.node.sightings_bytes

        run_in_virtual_time(mission, Path(folder), lambda mission_s, total_s, text: None, look)
    met = sorted(watch.first_sight_s)
    first = {pair: min(watch.merged_s.get(way, np.inf) for way in (pair, pair[::-1])) for pair in met}
    return {
        "seed": seed,
        "robots": len(mission.robots),
        "wrong_s": watch.wrong_s,
        "wrong_met_s": max(watch.longest_s.values(), default=0.0),
        "wrong_at_end": [f"{a}-{b}" for (a, b), right in sorted(watch.right.items()) if not right],
        "placed_at_end": len(watch.right),
        "met": len(met),
        "met_merged": sum(watch.right.get(pair, False) for pair in met),
        "merge_s": [max(watch.merged_s.get(pair, np.inf) - watch.first_sight_s[pair], 0.0) for pair in met],
        "first_merge_s": min(first.values(), default=np.inf),
        "bytes": dict(sent),
    }


def died(seed: int) -> dict[str, Any]:
    """Return the row of a mission whose process died."""
    return {"seed": seed, "died": True}


def summary(rows: list[dict[str, Any]], kind: str) -> dict[str, Any]:
    """Return the figures of all missions as one line."""
    died_seeds = [row["seed"] for row in rows if row.get("died")]
    rows = [row for row in rows if not row.get("died")]
    waits = np.array([wait for row in rows for wait in row["merge_s"]])
    sightings = sum(row["bytes"].pop("of_beacons_sightings", 0) for row in rows)
    total = sum(sum(row["bytes"].values()) for row in rows)
    return {
        "what": kind,
        "missions": len(rows),
        "died_seeds": died_seeds,
        "robots": sum(row["robots"] for row in rows),
        "wrong_s": round(sum(row["wrong_s"] for row in rows), 1),
        "wrong_met_s": max((row["wrong_met_s"] for row in rows), default=0.0),
        "wrong_at_end": sum(len(row["wrong_at_end"]) for row in rows),
        "wrong_seeds": [row["seed"] for row in rows if row["wrong_at_end"]],
        "placed_at_end": sum(row["placed_at_end"] for row in rows),
        "met": sum(row["met"] for row in rows),
        "met_merged": sum(row["met_merged"] for row in rows),
        "merge_s": [_or_never(np.quantile(waits, q, method="higher")) for q in (0.5, 0.95)] if waits.size else None,
        "first_merge_s": _or_never(np.median([row["first_merge_s"] for row in rows] or [np.inf])),
        "bytes": total,
        "sightings_share": round(sightings / max(total, 1), 4),
    }


def _or_never(seconds: float) -> float | None:
    return round(float(seconds), 1) if np.isfinite(seconds) else None


def main() -> int:
    """Play the missions."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--missions", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0, help="of the first mission; the others follow")
    parser.add_argument("--kind", choices=("hotel", "office"), default="hotel", help="of world")
    parser.add_argument("--robots", type=int, default=6, help="most of a mission")
    parser.add_argument("--seconds", type=float, default=180.0, help="of mission time")
    parser.add_argument("--walkers", type=int, default=0, help="people who walk about")
    parser.add_argument("--without", action="store_true", help="encounters say nothing")
    parser.add_argument("--liar", action="store_true", help="the first robot lies in hints")
    parser.add_argument("--rows", type=Path, help="file for a JSON line a mission")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="missions side by side")
    options = parser.parse_args()
    settings = {"mutual_detection": {"encounters": False}} if options.without else {}
    plan = Plan(options.kind, options.robots, options.seconds, options.walkers, options.liar, settings)
    rows: list[dict[str, Any]] = []
    seeds, console = range(options.seed, options.seed + options.missions), Console(stderr=True)
    ensure_compiled(console.print)
    with suppress(KeyboardInterrupt):
        played = play_all(partial(play, plan=plan), seeds, options.workers, died)
        for row in track(played, plan.kind, total=len(seeds), console=console):
            rows.append(row)
            if row.get("died") or row["wrong_at_end"]:
                console.print(f"seed {row['seed']}: {row.get('wrong_at_end', 'the process that played it died')}")
            if options.rows:
                with options.rows.open("a") as file:
                    print(json.dumps(row), file=file)
    line = summary(sorted(rows, key=lambda row: int(row["seed"])), options.kind)
    print(json.dumps(line))
    return 1 if line["died_seeds"] or len(rows) < len(seeds) else 0


if __name__ == "__main__":
    sys.exit(main())
