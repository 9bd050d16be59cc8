"""A foreign process throws 10 MB/s at a robot that maps in real time: how old its scans get, and what it believes.

    python bench/hostile.py LOG [--seconds 60] [--rate 10] [--keys]

Twice the same log is played to ``mrslam agent``, in peace and under fire. On an open team the attacker joins the
network and sends mutated messages (three in four with a right checksum) and random bytes on every lane, as itself and
in a teammate's name; ``--keys``: the team has keys, and the attacker, who has none, throws bytes at the port. One JSON
line: percentiles of the scans' age in both, what was thrown and dropped, and who was believed (nobody should be).
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import fuzz_codec  # beside this file; must come before the next line
import numpy as np

from mrslam.comms import CommsNode, Incoming, MemoryNetwork, Send, make_team_keys

HERE = Path(__file__).resolve().parent

TEAM, VICTIM, MATE = fuzz_codec.TEAM, "r1", "r2"
MUTANTS = 2000


def messages() -> list[bytes]:
    """Return what robots of this team say to each other."""
    network, heard, maps = MemoryNetwork(1), [], {}
    nodes = {robot: CommsNode(robot, TEAM, 7, fuzz_codec.CONFIG, seed=1) for robot in (VICTIM, MATE)}
    ends = {robot: network.attach(robot) for robot in nodes}
    rng = np.random.default_rng(0)
    for step in range(1, 80):
        now_ns = step * fuzz_codec.STEP_NS
        network.advance(now_ns)
        for robot, node in nodes.items():
            maps[robot] = fuzz_codec.grow(maps.get(robot), rng)
            node.publish(maps[robot], now_ns)
            effects = []
            for item in ends[robot].poll():
                if isinstance(item, Incoming):
                    heard.append(item.payload)
                    effects += node.on_message(item.payload, now_ns, item.sender)
                else:
                    effects += node.on_peer_joined(item.peer, now_ns)
            for peer in nodes.keys() - {robot}:
                effects += node.set_link_quality(peer, 1.0, now_ns)
            for effect in (*effects, *node.on_tick(now_ns)):
                if isinstance(effect, Send):
                    ends[robot].send(effect)
    return heard


def ammunition(rng: np.random.Generator) -> list[bytes]:
    """Return broken messages, and bytes that never were one."""
    real = messages()
    broken = [
        fuzz_codec.mutated(real[int(rng.integers(len(real)))], real[int(rng.integers(len(real)))], rng)
        for _ in range(MUTANTS)
    ]
    sizes = rng.integers(1, 60_000, MUTANTS // 4).tolist()
    noise = [rng.integers(0, 256, size, dtype=np.uint8).tobytes() for size in sizes]
    return [*(body for body in broken if body not in real), *noise]


def attack(address: str, rate_mb_s: float) -> None:
    """Join the network of an open team and fire until told to stop; print how many bytes were sent."""
    import zenoh

    config = zenoh.Config()
    config.insert_json5("connect/endpoints", json.dumps([address]))
    config.insert_json5("scouting/multicast/enabled", "false")
    session = zenoh.open(config)
    rng = np.random.default_rng(1)
    rounds = ammunition(rng)
    lanes = [f"{sender}/{to}/{lane}" for sender in ("mallory", MATE) for to in ("all", f"to/{VICTIM}")
             for lane in ("beacon", "control", "bulk", "nonsense")]  # fmt: skip
    fire(rate_mb_s, rounds, rng, lambda body: session.put(f"mrslam/{TEAM}/{lanes[rng.integers(len(lanes))]}", body))
    session.close()


def attack_port(address: str, rate_mb_s: float) -> None:
    """Throw bytes at a port that asks for a certificate."""
    host, port = address.split("/")[1].split(":")
    rng = np.random.default_rng(1)
    lines: list[socket.socket] = []

    def throw(body: bytes) -> None:
        try:
            if not lines:
                lines.append(socket.create_connection((host, int(port)), timeout=1.0))
            lines[0].sendall(body)
        except OSError:
            for line in lines:
                line.close()
            lines.clear()

    fire(rate_mb_s, ammunition(rng), rng, throw)


def fire(rate_mb_s: float, rounds: list[bytes], rng: np.random.Generator, throw) -> None:
    """Throw at this rate until SIGTERM."""
    told: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, frame: told.append(number))
    begun_s, sent, count = time.monotonic(), 0, 0
    while not told:
        body = rounds[int(rng.integers(len(rounds)))]
        throw(body)
        sent, count = sent + len(body), count + 1
        ahead_s = sent / (rate_mb_s * 1e6) - (time.monotonic() - begun_s)
        if ahead_s > 0.005:
            time.sleep(ahead_s)
    seconds = time.monotonic() - begun_s
    print(json.dumps({"mb_s": round(sent / 1e6 / seconds, 2), "messages_s": round(count / seconds)}), flush=True)


def free_port() -> int:
    """Return a port nobody listens on."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def play(options: argparse.Namespace, folder: Path, name: str, under_fire: bool) -> dict[str, object]:
    """Play the log to an agent once; return its figures."""
    address, out = f"{'tls' if options.keys else 'tcp'}/127.0.0.1:{free_port()}", folder / name
    command = [sys.executable, "-c", "from mrslam.sim_driver.cli import main; main()", "agent", VICTIM, "--team", TEAM,
               "--no-multicast", "--listen", address, "--log", str(options.log), "--out", str(out),
               "--duration", str(options.seconds)]  # fmt: skip
    if options.keys:
        command += ["--keys", str(folder / "keys" / VICTIM)]
    agent = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    thrown: dict[str, object] = {}
    if under_fire:
        while not (out / "events.jsonl").exists():  # it is up
            time.sleep(0.1)
        mine = [sys.executable, __file__, "--attack-port" if options.keys else "--attack", address]
        attacker = subprocess.Popen([*mine, "--rate", str(options.rate)], stdout=subprocess.PIPE, text=True)
        agent.wait()
        attacker.send_signal(signal.SIGTERM)
        thrown = json.loads(attacker.communicate()[0])
    agent.wait()
    robot = json.loads((out / "robot.json").read_text())
    usage = json.loads((out / "usage.json").read_text())
    events = [json.loads(line) for line in (out / "events.jsonl").read_text().splitlines()]
    dropped = {event["kind"]: event["count"] for event in events if event["event"] == "dropped"}  # told at 1, 2, 4, ...
    believed = sum(event["event"] in ("map_updated", "merged", "exchange_done") for event in events)
    return {**usage, "scans": robot["scans"], "placed": sorted(robot["placed"]), "maps_believed": believed,
            "dropped_at_least": dropped, "exit_code": agent.returncode, **thrown}  # fmt: skip


def main() -> None:
    """Play in peace, then under fire."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=Path, nargs="?")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--rate", type=float, default=10.0, help="MB a second")
    parser.add_argument("--keys", action="store_true")
    parser.add_argument("--attack", help=argparse.SUPPRESS)
    parser.add_argument("--attack-port", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.attack or options.attack_port:
        (attack if options.attack else attack_port)(options.attack or options.attack_port, options.rate)
        return
    if options.log is None:
        parser.error("a log to play is needed")
    os.environ["PYTHONPATH"] = f"{HERE.parent}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"
    with tempfile.TemporaryDirectory() as folder:
        if options.keys:
            make_team_keys(Path(folder) / "keys", TEAM, [VICTIM, MATE])
        peace = play(options, Path(folder), "peace", under_fire=False)
        war = play(options, Path(folder), "war", under_fire=True)
    ages = {name: run["scan_age_ms"]["p99"] for name, run in (("peace", peace), ("war", war))}
    change = round(100 * (ages["war"] / ages["peace"] - 1), 1)
    print(json.dumps({"what": "hostile", "p99_change_percent": change, "peace": peace, "war": war,
                      "keys": options.keys, "load": round(os.getloadavg()[0], 2)}))  # fmt: skip


if __name__ == "__main__":
    main()
