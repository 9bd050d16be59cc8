"""Robots in processes of their own, over Zenoh, told what to do through a pipe."""

from __future__ import annotations

import contextlib
import multiprocessing as mp
import os
import signal
import socket
import time
from pathlib import Path

from mrslam.comms import CommsConfig, CommsNode, MapSeal, Send, load_keys, status_report, warm_up
from mrslam.comms.zenoh import ZenohTransport
from tests.comms.bad_link import enter
from tests.comms.team import fingerprint

DEADLINE_S = 300.0
"""Longest wait for what must come, seconds: where many processes share a core one may need a minute to come up."""


def free_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def run_robot(pipe, robot, team, boot, config, local_map, endpoints, keys, namespace) -> None:
    """Be a robot until told to stop; report every effect but messages, and the digest when it changes."""
    if namespace is not None:
        enter(namespace)
    warm_up()
    node = CommsNode(robot, team, boot, config)
    if keys is not None:
        node.seal_maps(MapSeal.load(keys, team, robot))
    transport = ZenohTransport(robot, team, keys=keys, **endpoints)
    if local_map is not None:
        node.publish(local_map, 0)
    pipe.send(("up", os.getpid(), None))
    last, told, now = None, 0, time.monotonic_ns
    while True:
        effects = []
        for item in transport.poll(0.02):
            effects += node.on_event(item, now())
        effects += node.on_tick(now())
        for effect in effects:
            if isinstance(effect, Send):
                transport.send(effect)
            else:
                pipe.send(("effect", time.monotonic(), effect))
        if now() >= told + 1_000_000_000:
            told = now()
            transport.send(status_report(node, told))
        digest = node.store.digest()
        if digest != last:
            last = digest
            pipe.send(("digest", time.monotonic(), digest))
            content = {robot: fingerprint(local) for robot, local in node.store.maps.items()}
            pipe.send(("content", time.monotonic(), content))
        while pipe.poll():
            order, argument = pipe.recv()
            if order == "stop":
                for effect in node.leave():
                    transport.send(effect)
                transport.close()
                pipe.send(("down", time.monotonic(), None))
                return
            if order == "publish":
                node.publish(argument, now())
            elif order == "send":
                transport.send(argument)


class Robot:
    """One such process, as the test sees it."""

    def __init__(
        self,
        robot,
        *,
        team="team",
        boot=None,
        config=None,
        local_map=None,
        listen=(),
        connect=(),
        keys=None,
        mode="peer",
        namespace=None,
        multicast=False,
    ) -> None:
        warm_up()  # compiled once, here, not in every process
        self.robot = robot
        context = mp.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        endpoints = {"listen": list(listen), "connect": list(connect), "mode": mode, "multicast": multicast}
        boot = time.time_ns() if boot is None else boot
        args = (theirs, robot, team, boot, config or CommsConfig(), local_map, endpoints, keys, namespace)
        self.process = context.Process(target=run_robot, args=args, daemon=True)
        self.process.start()
        theirs.close()
        self.heard: list[tuple[str, float, object]] = []

    def wait(self, condition, what: str, deadline_s: float = DEADLINE_S):
        """Return the first report that meets the condition, among those heard already or to come."""
        end = time.monotonic() + deadline_s
        seen = 0
        while True:
            for report in self.heard[seen:]:
                if condition(report):
                    return report
            seen = len(self.heard)
            if not self._receive(max(0.0, min(0.2, end - time.monotonic()))) and time.monotonic() >= end:
                raise AssertionError(
                    f"{self.robot}: {what} did not come within {deadline_s} s; heard {self.heard[-8:]}"
                )

    def effect(self, kind, deadline_s: float = DEADLINE_S, **fields):
        def matches(report):
            return (
                report[0] == "effect"
                and isinstance(report[2], kind)
                and all(getattr(report[2], name) == value for name, value in fields.items())
            )

        return self.wait(matches, f"{kind.__name__} {fields}", deadline_s)

    def up(self) -> Robot:
        self.wait(lambda report: report[0] == "up", "start")
        return self

    def drain(self, seconds: float) -> list:
        """Listen for a while, in order to see that something does not come."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._receive(max(0.0, end - time.monotonic()))
        return self.heard

    def _receive(self, timeout_s: float) -> bool:
        try:
            if not self.pipe.poll(timeout_s):
                return False
            self.heard.append(self.pipe.recv())
        except (EOFError, OSError):
            time.sleep(min(timeout_s, 0.05))
            return False
        return True

    def tell(self, order: str, argument=None) -> None:
        self.pipe.send((order, argument))

    def freeze(self) -> float:
        """Stop the process without ending it: its sockets stay open and silent."""
        os.kill(self.process.pid, signal.SIGSTOP)
        return time.monotonic()

    def kill(self) -> float:
        self.process.kill()
        return time.monotonic()

    def stop(self) -> None:
        if self.process.is_alive():
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.process.pid, signal.SIGCONT)
            with contextlib.suppress(OSError):
                self.tell("stop")
            end = time.monotonic() + DEADLINE_S
            while self.process.is_alive() and time.monotonic() < end:
                self._receive(0.1)  # else one that has much to report waits for room in the pipe, and never ends
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        self.pipe.close()


def robot_keys(folder: Path, robot: str, team: str = "team"):
    return load_keys(folder / robot, robot, team)
