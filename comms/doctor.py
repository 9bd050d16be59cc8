"""Checks of this machine's network as a robot uses it; each finding says what is wrong and what to do."""

from __future__ import annotations

import shutil
import socket
import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from mrslam.comms.effects import Send
from mrslam.comms.transport.base import Incoming, Transport
from mrslam.comms.zenoh.transport import ZenohTransport
from mrslam.spatial import InputError

Level = Literal["ok", "warning", "error"]
MULTICAST = ("224.0.0.224", 7446)
"""Zenoh's scouting group."""
WORKS = (
    "a datagram to oneself came back; whether the network carries it to other machines shows only with a robot there"
)
PROBE_BYTES = 20_000
"""Size of a message of the throughput check, bytes: about that of a map chunk (``comms.chunk_bytes``)."""
PROBES = 100
"""Messages of the throughput check: 2 MB, well below the outbox's bound."""


@dataclass(frozen=True)
class Finding:
    """The result of one check."""

    level: Level
    topic: str
    words: str
    """What was found, with numbers, and what to do where something is wrong."""


def examine(listen: Sequence[str] = (), connect: Sequence[str] = (), *, with_multicast: bool = True) -> list[Finding]:
    """Return findings about interfaces, ports, multicast, the clock and the throughput of this machine."""
    findings = [interfaces(), *(port(endpoint) for endpoint in listen), *(reachable(endpoint) for endpoint in connect)]
    if with_multicast:
        findings.append(multicast())
    return [*findings, clock(), throughput()]


def interfaces() -> Finding:
    """Look for a network interface other than loopback."""
    names = [name for _, name in socket.if_nameindex() if name != "lo"]
    if not names:
        return Finding(
            "warning", "interfaces", "only loopback: robots on other machines cannot be reached; connect a network"
        )
    return Finding("ok", "interfaces", f"{len(names)} beside loopback: {', '.join(names)}")


def port(endpoint: str) -> Finding:
    """Look whether an endpoint such as ``tcp/0.0.0.0:7447`` can be listened on."""
    protocol, host, number = _split(endpoint)
    kind = socket.SOCK_DGRAM if protocol in ("udp", "quic") else socket.SOCK_STREAM
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, kind) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, number))
        except OSError as error:
            return Finding("error", "port", f"{endpoint} cannot be listened on: {error.strerror}; choose another")
    return Finding("ok", "port", f"{endpoint} is free")


def reachable(endpoint: str, timeout_s: float = 2.0) -> Finding:
    """Look whether somebody answers at an endpoint; datagrams cannot be checked without a robot there."""
    protocol, host, number = _split(endpoint)
    if protocol in ("udp", "quic"):
        return Finding("ok", "peer", f"{endpoint} goes by datagrams: start the robot to see whether it answers")
    begun = time.perf_counter()
    try:
        with socket.create_connection((host, number), timeout=timeout_s):
            took_ms = 1e3 * (time.perf_counter() - begun)
    except OSError as error:
        reason = error.strerror or str(error)
        return Finding("error", "peer", f"{endpoint} does not answer: {reason}; is the robot up, a firewall between?")
    return Finding("ok", "peer", f"{endpoint} answers in {took_ms:.1f} ms")


def multicast(timeout_s: float = 1.0) -> Finding:
    """Send a datagram to the scouting group and wait for it."""
    token = f"mrslam doctor {time.monotonic_ns()}".encode()
    try:
        with (
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
        ):
            receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            receiver.bind(("", MULTICAST[1]))
            membership = socket.inet_aton(MULTICAST[0]) + socket.inet_aton("0.0.0.0")
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
            receiver.settimeout(timeout_s)
            sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
            sender.sendto(token, MULTICAST)
            end = time.monotonic() + timeout_s
            while time.monotonic() < end:
                if receiver.recv(2048) == token:
                    return Finding("ok", "multicast", WORKS)
    except OSError as error:
        reason = error.strerror or "nothing came back"
        return Finding("warning", "multicast", f"does not work ({reason}): give addresses with --listen and --connect")
    return Finding(
        "warning", "multicast", "does not work (nothing came back): give addresses with --listen and --connect"
    )


def clock() -> Finding:
    """Look whether something keeps this machine's clock right: logs are compared by it, exchanges do without."""
    tool = shutil.which("chronyc") or shutil.which("timedatectl")
    if tool is None:
        return Finding(
            "warning", "clock", "nothing found that keeps it right (chrony, timesyncd): logs may not line up"
        )
    command = [tool, "tracking"] if tool.endswith("chronyc") else [tool, "show", "--property=NTPSynchronized"]
    try:
        answer = subprocess.run(command, capture_output=True, text=True, timeout=3, check=False).stdout
    except (OSError, subprocess.TimeoutExpired):
        answer = ""
    for line in answer.splitlines():
        if line.startswith("System time"):
            return Finding("ok", "clock", line.split(":", 1)[1].strip())
        if line == "NTPSynchronized=yes":
            return Finding("ok", "clock", "kept by the network")
    return Finding("warning", "clock", "not kept by the network: logs of several robots may not line up")


def throughput() -> Finding:
    """Send chunks between two ends on loopback: what the software can do, without the radio."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    try:
        giver = ZenohTransport("giver", "doctor", listen=[endpoint])
    except InputError as error:
        return Finding("error", "throughput", str(error))
    taker: Transport = ZenohTransport("taker", "doctor", connect=[endpoint])
    try:
        # Each must have seen the other: what is sent to one whose subscription has not come yet is lost.
        if not (_wait(taker, 1, 5.0) and _wait(giver, 1, 5.0)):
            return Finding("error", "throughput", "two ends on this machine do not find each other")
        begun = time.perf_counter()
        for _ in range(PROBES):
            giver.send(Send("taker", b"\0" * PROBE_BYTES, "bulk"))
        got = _wait(taker, PROBES, 10.0)
        took_s = time.perf_counter() - begun
    finally:
        taker.close()
        giver.close()
    if got < PROBES:
        return Finding("error", "throughput", f"{got} of {PROBES} chunks arrived on loopback")
    return Finding("ok", "throughput", f"{8e-6 * PROBES * PROBE_BYTES / took_s:.0f} Mbit/s on loopback")


def _wait(end: Transport, count: int, deadline_s: float) -> int:
    """Return how many arrivals came, up to ``count``, within the deadline (messages where more than one is awaited)."""
    got, until = 0, time.monotonic() + deadline_s
    while got < count and time.monotonic() < until:
        got += sum(count == 1 or isinstance(item, Incoming) for item in end.poll(0.1))
    return got


def _split(endpoint: str) -> tuple[str, str, int]:
    protocol, _, address = endpoint.partition("#")[0].partition("/")
    host, colon, number = address.rpartition(":")
    if not colon or not number.isdigit() or int(number) > 65535:
        raise InputError(f"endpoint must look like tcp/192.168.1.5:7447, got {endpoint!r}")
    return protocol, host.strip("[]"), int(number)
