"""Two network namespaces and a link between them that loses, delays and slows down what passes, as one likes.

Each namespace has a TUN interface; this process reads the packets of one and writes them to the other. Needs root.
"""

from __future__ import annotations

import ctypes
import fcntl
import heapq
import os
import select
import struct
import subprocess
import threading
import time
from pathlib import Path

import numpy as np

TUNSETIFF = 0x400454CA
IFF_TUN_NO_PI = 0x1001
CLONE_NEWNET = 0x40000000
QUEUE_S = 0.5
"""What would wait longer than this for a slow link is lost, as in a router's queue."""


def enter(namespace: str) -> None:
    """Move this process (call it before any thread is started) into a namespace."""
    with Path(f"/var/run/netns/{namespace}").open() as file:
        if ctypes.CDLL(None, use_errno=True).setns(file.fileno(), CLONE_NEWNET) != 0:
            raise OSError(ctypes.get_errno(), "setns")


class BadLink:
    """10.77.0.1 in ``namespaces[0]``, 10.77.0.2 in ``namespaces[1]``; raises ``OSError`` where that cannot be made."""

    def __init__(self, seed: int = 0) -> None:
        self.loss, self.delay_s, self.rate_bps, self.up = 0.0, 0.0, float("inf"), True
        self.namespaces = [f"mrslam{os.getpid()}{side}" for side in "ab"]
        self.addresses = ["10.77.0.1", "10.77.0.2"]
        self._rng = np.random.default_rng(seed)
        self._files: list[int] = []
        try:
            for side in (0, 1):
                self._files.append(self._make(side))
        except (OSError, subprocess.CalledProcessError) as error:
            self.close()
            raise OSError(str(error)) from error
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._relay, daemon=True)
        self._thread.start()

    def _make(self, side: int) -> int:
        name, namespace = f"mrs{os.getpid() % 100000}{side}", self.namespaces[side]
        run("ip", "netns", "add", namespace)
        file = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
        fcntl.ioctl(file, TUNSETIFF, struct.pack("16sH22x", name.encode(), IFF_TUN_NO_PI))
        run("ip", "link", "set", name, "netns", namespace)
        mine, theirs = self.addresses[side], self.addresses[1 - side]
        run("ip", "-n", namespace, "addr", "add", mine, "peer", theirs, "dev", name)
        run("ip", "-n", namespace, "link", "set", name, "up", "mtu", "1400")
        run("ip", "-n", namespace, "link", "set", "lo", "up")
        return file

    def _relay(self) -> None:
        waiting: list[tuple[float, int, int, bytes]] = []
        free, count = [0.0, 0.0], 0
        while not self._stop.is_set():
            timeout = 0.05 if not waiting else max(0.0, min(0.05, waiting[0][0] - time.monotonic()))
            for file in select.select(self._files, [], [], timeout)[0]:
                side = self._files.index(file)
                try:
                    packet = os.read(file, 65536)
                except OSError:
                    continue
                now = time.monotonic()
                start = max(now, free[side])
                if not self.up or self._rng.random() < self.loss or start - now > QUEUE_S:
                    continue
                free[side] = start + len(packet) * 8 / self.rate_bps
                count += 1
                heapq.heappush(waiting, (free[side] + self.delay_s, count, 1 - side, packet))
            now = time.monotonic()
            while waiting and waiting[0][0] <= now:
                _, _, side, packet = heapq.heappop(waiting)
                try:
                    os.write(self._files[side], packet)
                except OSError:
                    continue

    def close(self) -> None:
        if hasattr(self, "_thread"):
            self._stop.set()
            self._thread.join()
        for file in self._files:
            os.close(file)
        for namespace in self.namespaces:
            subprocess.run(["ip", "netns", "del", namespace], capture_output=True, check=False)


def run(*command: str) -> None:
    subprocess.run(command, check=True, capture_output=True)
