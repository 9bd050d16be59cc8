"""Damaged run folders and saved maps: ``python -m bench.damaged_runs [--every 1] [--out out/damage]``.

Damages every file of a small real run in every way of ``tests/sim_driver/damage.py``, and gives the folder to each
command that reads one: ``eval``, ``report``, ``bag``, ``view``, ``run --from``, and ``gather`` for agents' folders; and
every file of two saved maps, one in one file and one as map servers have it, to ``save``, ``align``, ``merge``,
``diff`` and ``agent --map``.
Each command runs in its own process, which is killed after 60 s of CPU, or 300 s of wall time. It must succeed, or end
with exit code 1 and a line that begins with ``mrslam:``; a traceback or a warning of numpy's is a failure either way.
One JSON line at the end: how many commands ran and succeeded, the longest CPU and wall time of those that refused and
of those that did their work (beside it what each takes on the whole folder), which refusals took more than 5 s of CPU,
the largest memory, and all failures. Times are judged by CPU seconds, which other jobs on the machine hardly change.
Compile first (a shipped mission played once does), and change no source meanwhile: kernels are compiled again by the
first command that needs them.

``--every N`` takes every Nth case of each command. ``run --from`` maps the whole run again, so it takes one in eight.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import track

from tests.sim_driver.damage import Case, cases, make_run

SLOW_S = 5.0
"""No refusal may take longer, seconds of CPU."""
LIMIT_CPU_S, LIMIT_S = 60, 300.0
"""A command that takes longer hangs, seconds of CPU and of wall time; a replay of the small run takes a few."""
REPLAYS_EVERY = 8
"""Share of the cases that ``run --from`` gets: one in so many."""
MAPS = ["--map", "{maps}/office.mrslam", "--map", "{maps}/plain.yaml"]
COMMANDS = {
    "eval": ["eval", "{run}"],
    "report": ["report", "{run}"],
    "bag": ["bag", "{run}", "--out", "{out}/run.mcap"],
    "view": ["view", "{run}"],
    "run --from": ["run", "--from", "{run}", "--out", "{out}/again"],
    "gather": ["gather", "{agents}", "--out", "{out}/gathered"],
    "save": ["save", "{maps}/office.mrslam", "{maps}/plain.yaml", "-o", "{out}/next.mrslam"],
    "align": ["align", "{maps}/office.mrslam", "{maps}/plain.yaml"],
    "merge": ["merge", "{maps}/office.mrslam", "{maps}/plain.yaml", "-o", "{out}/merged"],
    "diff": ["diff", "{maps}/office.mrslam", "{maps}/plain.yaml", "-o", "{out}/changes"],
    "agent --map": ["agent", "r9", *MAPS, "--duration", "1", "--out", "{out}/r9"],
}
"""Command -> its words."""
READ = {"gather": "agents"} | dict.fromkeys(["save", "align", "merge", "diff", "agent --map"], "maps")
"""Command -> the folder that it reads, where that is not ``run``."""


@dataclass(frozen=True)
class Outcome:
    """One command on one damaged folder."""

    name: str
    code: int | None
    """None where it was killed."""
    said: str
    cpu_s: float
    """Of the process and those it waited for."""
    wall_s: float
    peak_mb: float

    @property
    def failure(self) -> str | None:
        """What is wrong with it, None where nothing is."""
        if self.code is None:
            return f"hangs: killed after {self.cpu_s:.0f} s of CPU, {self.wall_s:.0f} s of wall time"
        if "Traceback" in self.said or "RuntimeWarning" in self.said:
            return self.said[-1500:]
        lines = [line for line in self.said.splitlines() if line.startswith("mrslam:")]
        if self.code not in (0, 1) or (self.code == 1 and len(lines) != 1):
            return f"exit code {self.code}: {self.said[-500:]}"
        if self.is_slow:
            return f"refused after {self.cpu_s:.1f} s of CPU"
        return None

    @property
    def is_slow(self) -> bool:
        """Whether it took too long to say no."""
        return self.code == 1 and self.cpu_s > SLOW_S


def run(words: list[str], name: str) -> Outcome:
    """Run a command to its end, or until it hangs."""
    with tempfile.TemporaryFile("w+") as said:
        start = time.monotonic()
        process = subprocess.Popen(
            [sys.executable, "-m", "mrslam", *words], stdout=said, stderr=said, text=True, preexec_fn=_bound_cpu
        )
        while time.monotonic() - start < LIMIT_S:
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            if pid:
                break
            time.sleep(0.01)
        else:
            process.kill()
            pid, status, usage = os.wait4(process.pid, 0)
        wall_s, cpu_s = time.monotonic() - start, usage.ru_utime + usage.ru_stime
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        code = None if wall_s >= LIMIT_S or cpu_s >= LIMIT_CPU_S else process.returncode
        return Outcome(name, code, said.read(), cpu_s, wall_s, usage.ru_maxrss / 1024)


def _bound_cpu() -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (LIMIT_CPU_S, LIMIT_CPU_S))


def chosen(whole: Path, every: int) -> Iterator[tuple[str, Case]]:
    """Yield commands with the cases they get."""
    for command in COMMANDS:
        step = every * (REPLAYS_EVERY if command == "run --from" else 1)
        found = list(cases(whole, READ.get(command, "run")))
        yield from ((command, case) for case in found[::step])


def attempt(whole: Path, command: str, case: Case | None) -> Outcome:
    """Run a command on a damaged copy, or on a whole one where there is no case."""
    with tempfile.TemporaryDirectory() as scratch:
        copy = Path(scratch) / "copy"
        if case is None:
            shutil.copytree(whole, copy)
        else:
            case.prepare(whole, copy)
        places = {"run": copy / "run", "agents": copy / "agents", "maps": copy / "maps", "out": scratch}
        name = command if case is None else f"{command}: {case.file}, {case.damage}"
        return run([word.format(**places) for word in COMMANDS[command]], name)


def _slowest(outcomes: Iterable[Outcome]) -> list[object] | None:
    """Return CPU and wall time, seconds, of the one that took the most CPU, and its name; None where there is none."""
    slowest = max(outcomes, key=lambda one: one.cpu_s, default=None)
    return None if slowest is None else [round(slowest.cpu_s, 1), round(slowest.wall_s, 1), slowest.name]


def main() -> int:
    """Run all cases and print the JSON line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--every", type=int, default=1, help="run every Nth case of each command")
    parser.add_argument(
        "--only", nargs="*", choices=sorted(COMMANDS), default=list(COMMANDS), help="commands; all unless given"
    )
    parser.add_argument("--out", type=Path, default=Path("out/damage"), help="folder of the whole run")
    options = parser.parse_args()
    whole = options.out if (options.out / "run" / "metrics.json").exists() else make_run(options.out)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    console = Console(stderr=True)
    outcomes = []
    picked = [(command, case) for command, case in chosen(whole, options.every) if command in options.only]
    for command, case in track(picked, "damage", console=console):
        outcomes.append(attempt(whole, command, case))
        if outcomes[-1].failure:
            console.print(f"{outcomes[-1].name}: {outcomes[-1].failure}", markup=False)
    whole_cpu_s = {command: round(attempt(whole, command, None).cpu_s, 1) for command in options.only}
    largest = max(outcomes, key=lambda one: one.peak_mb)
    failures = [one for one in outcomes if one.failure]
    print(
        json.dumps(
            {
                "commands": len(outcomes),
                "succeeded": sum(one.code == 0 for one in outcomes),
                "refused": sum(one.code == 1 for one in outcomes),
                "refused_worst": _slowest(one for one in outcomes if one.code != 0),
                "succeeded_worst": _slowest(one for one in outcomes if one.code == 0),
                "refused_after_5_s_of_cpu": [one.name for one in outcomes if one.is_slow],
                "whole_cpu_s": whole_cpu_s,
                "peak_mb": round(largest.peak_mb),
                "largest": largest.name,
                "tracebacks": sum("Traceback" in one.said for one in outcomes),
                "failures": [one.name for one in failures],
            }
        )
    )
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
