"""A switch of network namespaces, and a Dask cluster whose machines they are. Needs root."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import psutil

HUB, PORT = "10.78.0.1", 8786
START_S = 60.0
"""How long a process may take to end, seconds."""


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
        self.address = f"tcp://{HUB}:{PORT}"

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
        dask = (sys.executable, "-m", f"distributed.cli.dask_{words[0]}", *words[1:])
        return start_in(namespace, [*dask], self._stack, stdout=log, stderr=subprocess.STDOUT)


def start_in(namespace: str, command: list[str], stack: ExitStack, **files: Any) -> psutil.Popen:
    """Start a process in a namespace; it is killed when the stack ends."""
    process = psutil.Popen(["ip", "netns", "exec", namespace, *command], **files)
    stack.callback(_end, process)
    return process


def _end(process: psutil.Popen) -> None:
    if process.poll() is None:
        process.kill()
    process.wait(START_S)
