"""A sweep on a Dask cluster of network namespaces, a worker of which is killed midway; one JSON line. Needs root.

    python bench/cluster.py [--mission arena1] [--vary comms.link_threshold=0.2,0.5] [--seeds 4]

The sweep is run by a process of this machine first. Then a scheduler, two workers and the sweep's own command each get
a namespace, joined by a bridge, as machines are by a switch. When a quarter of the runs is done a worker is killed (the
process gets SIGKILL: what it was doing is lost) and another one joins. ``same_table`` : whether both left the same
``sweep.csv``, byte by byte. ``cpu_s`` : of each worker; the first is the one killed, the last the one that joined.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

import psutil

HUB, PORT = "10.78.0.1", 8786
START_S, END_S = 60.0, 3600.0
"""How long a process may take to answer, and the sweep to end."""


class Switch:
    """Namespaces joined by a bridge: the first has the bridge, and the address ``HUB``."""

    def __init__(self) -> None:
        self._stem, self._count = f"mrsc{os.getpid()}", 0
        self.hub = self._namespace()
        _ip("-n", self.hub, "link", "add", "hub", "type", "bridge")
        _ip("-n", self.hub, "addr", "add", f"{HUB}/24", "dev", "hub")
        _ip("-n", self.hub, "link", "set", "hub", "up")

    def machine(self) -> tuple[str, str]:
        """Return a new namespace and its address."""
        namespace, k = self._namespace(), self._count
        port, address = f"p{k}", f"10.78.0.{k}"
        _ip("-n", self.hub, "link", "add", port, "type", "veth", "peer", "name", "eth", "netns", namespace)
        _ip("-n", self.hub, "link", "set", port, "master", "hub", "up")
        _ip("-n", namespace, "addr", "add", f"{address}/24", "dev", "eth")
        _ip("-n", namespace, "link", "set", "eth", "up")
        return namespace, address

    def _namespace(self) -> str:
        self._count += 1
        name = f"{self._stem}n{self._count}"
        _ip("netns", "add", name)
        _ip("-n", name, "link", "set", "lo", "up")
        return name

    def close(self) -> None:
        """Take all namespaces away, and with them what joins them."""
        for k in range(self._count):
            subprocess.run(["ip", "netns", "del", f"{self._stem}n{k + 1}"], capture_output=True, check=False)


def _ip(*words: str) -> None:
    done = subprocess.run(["ip", *words], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"ip {' '.join(words)}: {done.stderr.strip()} (namespaces need root and iproute2)")


class Cluster:
    """A scheduler and its workers, each in a namespace of its own."""

    def __init__(self, switch: Switch, folder: Path, stack: ExitStack) -> None:
        self.switch, self._folder, self._stack = switch, folder, stack
        self.workers: list[psutil.Popen] = []
        self.cpu_s: dict[int, float] = {}
        self._start(switch.hub, "scheduler", "--host", HUB, "--port", str(PORT), "--no-dashboard")

    def add_worker(self) -> None:
        """Let a machine with one worker join; without a nanny, which would start a killed one again."""
        namespace, address = self.switch.machine()
        words = ("--host", address, "--nthreads", "1", "--no-nanny", "--no-dashboard")
        local = ("--local-directory", str(self._folder / namespace))
        self.workers.append(self._start(namespace, "worker", f"{HUB}:{PORT}", *words, *local))

    def note(self) -> None:
        """Note what CPU the workers that live have taken."""
        for k, worker in enumerate(self.workers):
            if worker.is_running() and worker.status() != psutil.STATUS_ZOMBIE:
                self.cpu_s[k] = round(sum(worker.cpu_times()[:2]), 1)

    def _start(self, namespace: str, *words: str) -> psutil.Popen:
        log = self._stack.enter_context((self._folder / f"{namespace}-{words[0]}.log").open("w"))
        command = [
            "ip",
            "netns",
            "exec",
            namespace,
            sys.executable,
            "-m",
            "distributed.cli.dask_" + words[0],
            *words[1:],
        ]
        process = psutil.Popen(command, stdout=log, stderr=subprocess.STDOUT)
        self._stack.callback(_end, process)
        return process


def _end(process: psutil.Popen) -> None:
    if process.poll() is None:
        process.kill()
    process.wait(START_S)


def command(options: argparse.Namespace, out: Path, *where: str) -> list[str]:
    """Return the sweep's command."""
    knobs = [word for knob in options.vary for word in ("--vary", knob)]
    named = (options.mission, *knobs, "--seeds", str(options.seeds), "--out", str(out))
    return [str(Path(sys.executable).with_name("mrslam")), "sweep", *named, *where]


def on_cluster(options: argparse.Namespace, folder: Path, runs: int) -> dict[str, object]:
    """Run the sweep on a cluster that loses a worker and gets another one; return what came of it."""
    out = folder / "cluster"
    with ExitStack() as stack:
        switch = Switch()
        stack.callback(switch.close)
        cluster = Cluster(switch, folder, stack)
        for _ in range(2):
            cluster.add_worker()
        begun_s, killed_after = time.monotonic(), None
        there = command(options, out, "--scheduler", f"tcp://{HUB}:{PORT}")
        sweep = psutil.Popen(["ip", "netns", "exec", switch.hub, *there], stdout=sys.stderr)
        stack.callback(_end, sweep)
        while sweep.poll() is None:
            cluster.note()
            done = len(list((out / "points").glob("*")))
            if killed_after is None and done >= runs / 4:
                killed_after = done
                cluster.workers[0].kill()
                cluster.add_worker()
            if time.monotonic() - begun_s > END_S:
                raise SystemExit(f"the sweep has not ended after {END_S:.0f} s; logs are in {folder}")
            time.sleep(0.2)
        if sweep.returncode != 0:
            raise SystemExit(f"the sweep ended with {sweep.returncode}")
    wall_s = round(time.monotonic() - begun_s, 1)
    return {"killed_after": killed_after, "wall_s": wall_s, "cpu_s": list(cluster.cpu_s.values())}


def main() -> None:
    """Run the sweep twice, and compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mission", default="arena1")
    parser.add_argument("--vary", action="append", help="a knob, as mrslam sweep takes it")
    parser.add_argument("--seeds", type=int, default=4)
    options = parser.parse_args()
    options.vary = options.vary or ["comms.link_threshold=0.2,0.5"]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        begun_s = time.monotonic()
        subprocess.run(command(options, folder / "local", "--workers", "1"), check=True, stdout=sys.stderr)
        local_s = round(time.monotonic() - begun_s, 1)
        table = (folder / "local" / "sweep.csv").read_bytes()
        runs = table.count(b"\n") - 1
        row = on_cluster(options, folder, runs)
        same = (folder / "cluster" / "sweep.csv").read_bytes() == table
    print(json.dumps({"what": "cluster", "runs": runs, "local_s": local_s, **row, "same_table": same}))


if __name__ == "__main__":
    main()
