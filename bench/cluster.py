"""Sweeps and chaos on a Dask cluster of network namespaces, a worker of which is killed midway. Needs root.

    python -m bench.cluster [--only sweep|chaos] [--mission arena1] [--vary comms.link_threshold=0.2,0.5] [--seeds 4]

Each is run by a process of this machine first. Then a scheduler, two workers and the command get a namespace each,
joined by a bridge, as machines are by a switch. When a quarter of the runs is done a worker is killed (the process gets
SIGKILL: what it was doing is lost) and another one joins. One JSON line each; ``same`` : whether both left the same
``sweep.csv``, or the same figures of the chaos missions, byte by byte. ``cpu_s`` : of each worker; the first is the one
killed, the last the one that joined.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from bench.namespaces import Cluster, Switch, start_in

END_S = 3600.0
"""How long the runs may take on the cluster, seconds."""


@dataclass(frozen=True)
class Sweep:
    """A sweep; its runs leave a folder each."""

    options: argparse.Namespace
    name: str = "sweep"

    def command(self, out: Path, *where: str) -> list[str]:
        """Return the command."""
        knobs = [word for knob in self.options.vary for word in ("--vary", knob)]
        named = (self.options.mission, *knobs, "--seeds", str(self.options.seeds), "--out", str(out))
        return [str(Path(sys.executable).with_name("mrslam")), "sweep", *named, *where]

    def done(self, out: Path) -> int:
        """Return how many runs are done."""
        return len(list((out / "points").glob("*")))

    def left(self, out: Path) -> bytes:
        """Return what the runs left."""
        return (out / "sweep.csv").read_bytes()


@dataclass(frozen=True)
class Chaos:
    """Chaos missions; they leave a line of figures each, in the order in which they end."""

    options: argparse.Namespace
    name: str = "chaos"

    def command(self, out: Path, *where: str) -> list[str]:
        """Return the command."""
        missions = ("--missions", str(self.options.missions), "--figures", str(out))
        return [sys.executable, "-m", "bench.chaos", *missions, *where]

    def done(self, out: Path) -> int:
        """Return how many missions are done."""
        return out.read_text().count("\n") if out.exists() else 0

    def left(self, out: Path) -> bytes:
        """Return what the missions left, in an order that does not depend on which ended first."""
        return b"".join(sorted(out.read_bytes().splitlines(keepends=True)))


def on_cluster(work: Sweep | Chaos, folder: Path, runs: int) -> dict[str, object]:
    """Do the work on a cluster that loses a worker and gets another one; return what came of it."""
    out = folder / "cluster"
    with ExitStack() as stack:
        switch = Switch()
        stack.callback(switch.close)
        cluster = Cluster(switch, folder, stack)
        for _ in range(2):
            cluster.add_worker()
        begun_s, killed_after = time.monotonic(), None
        there = work.command(out, "--scheduler", cluster.address)
        command = start_in(switch.hub, there, stack, stdout=sys.stderr)
        while command.poll() is None:
            cluster.note()
            done = work.done(out)
            if killed_after is None and done >= runs / 4:
                killed_after = done
                cluster.workers[0].kill()
                cluster.add_worker()
            if time.monotonic() - begun_s > END_S:
                raise SystemExit(f"the {work.name} has not ended after {END_S:.0f} s; logs are in {folder}")
            time.sleep(0.2)
        if command.returncode != 0:
            raise SystemExit(f"the {work.name} ended with {command.returncode}")
    wall_s = round(time.monotonic() - begun_s, 1)
    return {"killed_after": killed_after, "wall_s": wall_s, "cpu_s": list(cluster.cpu_s.values())}


def compare(work: Sweep | Chaos, folder: Path) -> None:
    """Do the work twice, and print what came of it."""
    begun_s = time.monotonic()
    subprocess.run(work.command(folder / "local", "--workers", "1"), check=True, stdout=sys.stderr)
    local_s = round(time.monotonic() - begun_s, 1)
    runs = work.done(folder / "local")
    row = on_cluster(work, folder, runs)
    same = work.left(folder / "cluster") == work.left(folder / "local")
    print(json.dumps({"what": f"cluster-{work.name}", "runs": runs, "local_s": local_s, **row, "same": same}))


def main() -> None:
    """Compare sweeps, and chaos missions."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=("sweep", "chaos"))
    parser.add_argument("--mission", default="arena1", help="that the sweep plays")
    parser.add_argument("--vary", action="append", help="a knob, as mrslam sweep takes it")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--missions", type=int, default=12, help="of chaos")
    options = parser.parse_args()
    options.vary = options.vary or ["comms.link_threshold=0.2,0.5"]
    for work in (Sweep(options), Chaos(options)):
        if options.only in (None, work.name):
            with tempfile.TemporaryDirectory() as folder:
                compare(work, Path(folder))


if __name__ == "__main__":
    main()
