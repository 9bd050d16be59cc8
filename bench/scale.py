"""What a team costs by robots and minutes, in virtual time: one JSON line a run, then the fitted laws.

    python -m bench.scale [--robots 2 4 8 16] [--minutes 3] [--world office] [--seed 1] [--patrol] [--processes 1]
                          [--rows FILE]
    python bench/scale_laws.py FILE [--plot PICTURE]

CPU seconds are those of all robots together, without compiling, by room: ``simulation`` (lasers, radio, driving),
``mapping``, ``alignment`` (whole maps), ``joint`` (scans matched, poses solved), ``placing`` and ``drawing`` (team
maps), ``exchange`` (beacons, messages, coding), ``rest``. Bytes are those a robot sends in a minute, by lane.
``by_minute`` has what had been spent, sent in beacons and exchanged by the end of each minute of the mission, and how
many robots each had placed then, in the mean. Missions end when all is explored, before their time; with ``--patrol``
the robots drive in rounds for all of it. With ``--processes 2`` robots take their turns in two processes: ``cpu_s`` and
``peak_rss_mb`` are those of all, rooms and minutes those of the first one's robots. ``exchange_kb_by_minute`` is of all
robots, by the exchanges that ended in each minute. ``--rows`` adds the lines to a file, and the laws
(``scale_laws.py``) are fitted to all of it.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import multiprocessing
import resource
import sys
import tempfile
import threading
import time
import weakref
from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from bench.patrol import patrol
from bench.scale_laws import laws
from mrslam.agent import Agent
from mrslam.agent.effects import AlignJob
from mrslam.agent.shells import runner as runner_module
from mrslam.agent.shells.runner import Runner
from mrslam.agent.team import Team
from mrslam.comms import CommsNode
from mrslam.rbpf import Mapper
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.kernels import load_kernels
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.missions.usage import peak_kb
from mrslam.sim_driver.run.metrics import NEVER_MET
from mrslam.sim_driver.run.run import run_mission
from mrslam.sim_driver.simulation.simulated import SimulatedBody

ROOMS: dict[str, list[tuple[Any, str]]] = {
    "simulation": [(SimulatedBody, "sense"), (SimulatedBody, "act")],
    "mapping": [(Mapper, "update"), (Mapper, "snapshot")],
    "alignment": [(Runner, "_align")],
    "joint": [(runner_module, "join")],
    "placing": [(Team, "_place")],
    "drawing": [(Team, "map"), (Agent, "own_map")],
    "exchange": [(CommsNode, name) for name in ("on_message", "on_tick", "publish")],
}
"""By room: the calls whose time is its own, but for that of other rooms' calls in them."""
LANES = "beacon", "control", "bulk"
"""What robots send each other: what they announce, and, in exchanges of maps, questions and maps."""


class Inner(threading.local):
    """CPU seconds of this thread that calls of rooms have taken since the call around them began."""

    spent_s = 0.0


INNER = Inner()


def clocked(
    call: Callable[..., Any], room: str, spent_s: dict[str, float], calls: dict[str, int]
) -> Callable[..., Any]:
    """Return the same function, whose CPU time in its thread is added to a room's, without that of rooms it calls."""

    def timed(*args: Any, **kwargs: Any) -> Any:
        around_s, INNER.spent_s = INNER.spent_s, 0.0
        begin = time.thread_time()
        try:
            return call(*args, **kwargs)
        finally:
            taken_s = time.thread_time() - begin
            spent_s[room] += taken_s - INNER.spent_s
            calls[room] += 1
            INNER.spent_s = around_s + taken_s

    return timed


def by_kind(align: Callable[..., Any], kinds: dict[str, int]) -> Callable[..., Any]:
    """Return the same method of :class:`Runner`, which counts alignments by what made them.

    ``searched`` : everywhere or by a prior; ``examined`` : at a place found before; ``hinted`` : at a teammate's hint,
    of which ``hints_failed`` were not followed by a search for rivals.
    """

    def counted(runner: Runner, job: AlignJob) -> Any:
        outcome = align(runner, job)
        kinds["hinted" if job.hinted_by is not None else "searched" if job.place is None else "examined"] += 1
        kinds["hints_failed"] += job.hinted_by is not None and not outcome.accepted
        return outcome

    return counted


class Meter:
    """What a mission has cost so far, by room, minute by minute."""

    def __init__(self) -> None:
        """Begin to count: every runner and every room's calls from now on."""
        self.spent_s: dict[str, float] = defaultdict(float)
        self.calls: dict[str, int] = defaultdict(int)
        self.kinds: dict[str, int] = dict.fromkeys(("searched", "examined", "hinted", "hints_failed"), 0)
        self.minutes: list[dict[str, Any]] = []
        self._runners: weakref.WeakSet[Runner] = weakref.WeakSet()  # their memory is gone when the run is judged
        self._begin_s = time.process_time()
        Runner._align = by_kind(Runner._align, self.kinds)
        for room, entries in ROOMS.items():
            for owner, name in entries:
                setattr(owner, name, clocked(getattr(owner, name), room, self.spent_s, self.calls))
        begin = Runner.__init__

        def met(runner: Runner, *args: Any, **kwargs: Any) -> None:
            begin(runner, *args, **kwargs)
            self._runners.add(runner)

        Runner.__init__ = met

    @property
    def cpu_s(self) -> float:
        """CPU seconds since the beginning."""
        return time.process_time() - self._begin_s

    def by_room_s(self) -> dict[str, float]:
        """Return CPU seconds by room so far; ``rest`` is what no room counts."""
        rest_s = self.cpu_s - sum(self.spent_s.values())
        return {**{room: round(self.spent_s[room], 2) for room in ROOMS}, "rest": round(rest_s, 2)}

    def look(self, now_s: float, _total_s: float | None, _words: str) -> None:
        """Note what was spent at the end of each minute; called at every step."""
        if round(now_s) < 60 * (len(self.minutes) + 1):  # the last step is just before the end
            return
        beacon, *exchange = (sum(runner.sent_bytes[lane] for runner in self._runners) for lane in LANES)
        placed = [len(runner.agent.T_team_map) for runner in self._runners]
        noted = {"cpu_s": round(self.cpu_s, 1), "cpu_by_room_s": self.by_room_s()}
        noted |= {"beacon_bytes": beacon, "exchange_bytes": sum(exchange)}
        noted |= {"peak_rss_mb": round(peak_kb() / 1024), "alignments": self.calls["alignment"]}
        before = self.minutes[-1] if self.minutes else dict.fromkeys(noted, 0)
        beacons, exchanges = (
            (noted[sent] - before[sent]) / 1e3 / len(placed) for sent in ("beacon_bytes", "exchange_bytes")
        )
        self.minutes.append({**noted, "placed": round(sum(placed) / len(placed), 2)})
        told = f"minute {len(self.minutes)}: {noted['cpu_s']} s of CPU, {noted['peak_rss_mb']} MB, "
        told += (
            f"{self.minutes[-1]['placed']} maps placed; a robot {beacons:.1f} kB of beacons, {exchanges:.1f} exchanged"
        )
        print(told, file=sys.stderr, flush=True)


def run(robots: int, minutes: float, world: str, seed: int, is_patrol: bool, processes: int = 1) -> dict[str, Any]:
    """Play one mission and return its row."""
    load_kernels()
    meter = Meter()
    tables = {
        "mission": {"name": "bench-scale", "seed": seed, "duration_s": 60.0 * minutes, "shell": "virtual"},
        "world": {"name": world},
        "robots": [{"id": f"r{i + 1:02d}"} for i in range(robots)],
    }
    with tempfile.TemporaryDirectory() as scratch:
        wall = time.monotonic()
        mission = patrol(tables, "bench-scale") if is_patrol else make_mission(tables, Path("bench-scale.toml"))
        metrics = run_mission(mission, Path(scratch), meter.look, print, processes=processes)
        wall_s = time.monotonic() - wall
        exchanged_kb = exchanged_by_minute(Path(scratch), minutes)
    merged = [pair for pair in metrics["pairs"] if pair["status"] == "accepted"]
    others = resource.getrusage(resource.RUSAGE_CHILDREN)  # all of them, and the largest one's memory
    peak_mb = (peak_kb() + (processes - 1) * others.ru_maxrss) / 1024
    sent, driven_min = [robot["sent_bytes"] for robot in metrics["robots"]], metrics["mission_s"] / 60.0
    return {
        "robots": robots, "minutes": minutes, "world": world, "seed": seed, "mission_s": metrics["mission_s"],
        "processes": processes, "cpu_s": round(meter.cpu_s + others.ru_utime + others.ru_stime, 1),
        "wall_s": round(wall_s, 1), "cpu_by_room_s": meter.by_room_s(),
        "alignments": meter.calls["alignment"], "by_kind": meter.kinds, "joint_solutions": meter.calls["joint"],
        "peak_rss_mb": round(peak_mb),
        "bytes_a_robot_minute": {
            lane: round(sum(one[lane] for one in sent) / robots / driven_min) for lane in LANES
        },
        "pairs": len(metrics["pairs"]), "pairs_merged": len(merged),
        "pairs_met": sum(pair["reason"] != NEVER_MET for pair in metrics["pairs"]),
        "pairs_placed": sum(bool(pair["placed_together_by"]) for pair in metrics["pairs"]),
        "false_merges": sum(pair["is_false"] for pair in merged),
        "worst_error_m": max((pair["error_m"] for pair in merged), default=0.0),
        "worst_alignment_m": max((pair["alignment_m"] for pair in merged), default=0.0),
        "most_placed": max(len(robot["placed"]) for robot in metrics["robots"]), "exchange_kb_by_minute": exchanged_kb,
        "by_minute": meter.minutes,
    }  # fmt: skip


def exchanged_by_minute(out: Path, minutes: float) -> list[float]:
    """Return what a robot sent in exchanges that ended in each minute, kB, in the mean of all robots of a run."""
    events = RunResults.read(out).events
    sent = np.zeros(math.ceil(minutes) + 1)
    for event in itertools.chain.from_iterable(events.values()):
        if event["event"] in ("exchange_done", "exchange_failed"):
            sent[int(event["t"] // 60.0)] += event["bytes_sent"] / 1e3 / len(events)
    return [round(float(kb), 2) for kb in sent]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", nargs="*", type=int, default=[2, 4, 8, 16])
    parser.add_argument("--minutes", nargs="+", type=float, default=[3.0])
    parser.add_argument("--world", default="office")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--patrol", action="store_true", help="robots drive in rounds for all of the time")
    parser.add_argument("--processes", type=int, default=1, help="in which the robots take their turns")
    parser.add_argument("--rows", type=Path, help="file that rows are added to; laws are fitted to all of it")
    args = parser.parse_args()
    rows = [json.loads(line) for line in args.rows.read_text().splitlines()] if args.rows and args.rows.exists() else []
    context = multiprocessing.get_context("spawn")  # a process a run: peak memory is the run's own
    for minutes in args.minutes:
        for robots in args.robots:
            with ProcessPoolExecutor(1, mp_context=context) as pool:  # its processes may have others
                asked = (robots, minutes, args.world, args.seed, args.patrol, args.processes)
                rows.append(pool.submit(run, *asked).result())
            print(json.dumps(rows[-1]), flush=True)
            if args.rows:
                with args.rows.open("a") as file:
                    file.write(json.dumps(rows[-1]) + "\n")
    print("\n".join(laws(rows)))


if __name__ == "__main__":
    main()
