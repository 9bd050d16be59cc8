"""Throws broken messages at a robot in the middle of its exchanges: ``python bench/fuzz_codec.py [--count 1000000]``.

Every message of a running team is also delivered mutated, several times, before it is delivered whole. Most mutants are
framed anew, with a right checksum, so that they reach the decoders behind it. Reports exceptions (there must be none),
the slowest message, and how far memory grew. Every second team has keys, and signs its maps. Statuses are thrown at a
watcher likewise. The last line is JSON.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import numpy as np

from mrslam.comms import (
    CommsConfig,
    CommsNode,
    Incoming,
    MapSeal,
    MemoryNetwork,
    Send,
    Sighting,
    TeamView,
    load_keys,
    make_team_keys,
    status_report,
    warm_up,
)
from mrslam.comms.wire.frames import HEADER, frame, team_tag
from mrslam.sim_driver.missions.usage import peak_kb
from mrslam.spatial import Keyframes, KeyScans, LocalMap, Tile, TiledMap

STEP_NS = 250_000_000
TEAM = "fuzz"
IDS = ["r1", "r2", "r3"]
CONFIG = CommsConfig(
    exchange_timeout_s=1.0, link_source="model", beacon_period_s=1.0, backoff_s=0.2, window_tiles=5, chunk_bytes=2000
)
EDGES = np.array([0, 1, 0x7F, 0x80, 0x81, 0xC0, 0xC1, 0xC4, 0xC6, 0xCB, 0xCF, 0xD3, 0xDB, 0xDD, 0xDF, 0xFF], np.uint8)
"""Bytes that mean much in MessagePack: lengths, types, limits."""


@dataclass
class Report:
    """What came of it."""

    mutants: int = 0
    slowest_ms: float = 0.0
    slowest: str = ""
    dropped: Counter[str] = field(default_factory=Counter)
    exchanges: int = 0
    memory_growth_mb: float = 0.0


def mutated(payload: bytes, other: bytes, rng: np.random.Generator) -> bytes:
    """Return a broken version of a message; three in four bear a right checksum."""
    body = bytearray(payload[HEADER.size :])
    if rng.random() < 0.4:
        return frame(_with_other_fields(payload[HEADER.size :], rng), team_tag(TEAM))
    for _ in range(int(rng.integers(1, 4))):
        kind, at = int(rng.integers(7)), int(rng.integers(len(body))) if body else 0
        if not body:
            break
        if kind == 0:
            body[at] ^= 1 << int(rng.integers(8))
        elif kind == 1:
            body[at] = int(rng.integers(256))
        elif kind == 2:
            body[at] = int(rng.choice(EDGES))
        elif kind == 3:
            del body[at:]
        elif kind == 4:
            body[at:at] = rng.integers(0, 256, int(rng.integers(1, 9)), dtype=np.uint8).tobytes()
        elif kind == 5:
            del body[at : at + int(rng.integers(1, 9))]
        else:
            donor = other[HEADER.size :]
            start = int(rng.integers(len(donor))) if donor else 0
            body[at : at + 8] = donor[start : start + 8]
    if rng.random() < 0.75:
        return frame(bytes(body), team_tag(TEAM))
    broken = bytearray(payload[: HEADER.size] + bytes(body))
    broken[int(rng.integers(HEADER.size))] ^= 1 << int(rng.integers(8))
    return bytes(broken[: int(rng.integers(len(broken) + 1))])


def _with_other_fields(body: bytes, rng: np.random.Generator) -> bytes:
    """Return a message of the right types in which one field says something else."""
    fields = msgspec.msgpack.decode(body)
    at = int(rng.integers(2, len(fields)))
    fields[at] = _other(fields[at], rng)
    return msgspec.msgpack.encode(fields)


def _other(value: object, rng: np.random.Generator) -> object:
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return abs(int(rng.choice([value + 1, value - 1, 0, 2 * value, int(rng.integers(2**31)), 2**31 - 1])))
    if isinstance(value, float):
        return float(rng.choice([value * 2, 0.001, 99.0, float("nan"), float("inf"), -1.0]))
    if isinstance(value, bytes):
        broken = bytearray(value or b"\0")
        broken[int(rng.integers(len(broken)))] ^= 1 << int(rng.integers(8))
        return bytes(broken) if rng.random() < 0.7 else bytes(broken[: int(rng.integers(len(broken) + 1))])
    if isinstance(value, str):
        return str(rng.choice(["r1", "r2", "r3", "r9", value + "x"]))
    if isinstance(value, list) and value:
        at = int(rng.integers(len(value)))
        kind = int(rng.integers(3))
        if kind == 0:
            return value[:at] + value[at + 1 :]
        if kind == 1:
            return [*value[:at], value[at], *value[at:]]
        return [*value[:at], _other(value[at], rng), *value[at + 1 :]]
    return value


def grow(local: LocalMap | None, rng: np.random.Generator) -> LocalMap:
    """Return the next state of a small map."""
    tiles = {} if local is None else dict(local.map.tiles)
    revision = 1 if local is None else local.map.revision + 1
    for _ in range(6):
        index = (int(rng.integers(-3, 3)), int(rng.integers(-3, 3)))
        cells = np.full((64, 64), -1, np.int8) if index not in tiles else tiles[index].cells.copy()
        row, col = (int(v) for v in rng.integers(0, 56, size=2))
        cells[row : row + 8, col : col + 8] = rng.choice(np.array([-1, 0, 25, 100], np.int8), size=(8, 8))
        tiles[index] = Tile(revision, cells)
    count = min(20 * revision, 400)
    keyframes = Keyframes(np.arange(count, dtype=np.int64) * 10**8, rng.normal(size=(count, 3)))
    scans = KeyScans.empty() if local is None else local.key_scans
    new = [rng.uniform(-20.0, 20.0, (int(rng.integers(60)), 2)) for _ in range(count - len(scans))]
    scans = scans.append(KeyScans.of_points(new, np.zeros((len(new), 2))))
    return LocalMap(TiledMap(0.05, tiles, revision), keyframes, scans)


def fuzz(count: int, seed: int = 0, per_message: int = 20) -> Report:
    """Deliver ``count`` mutants; any exception gets out."""
    warm_up()
    rng = np.random.default_rng(seed)
    report = Report()
    with tempfile.TemporaryDirectory() as folder:
        make_team_keys(Path(folder), TEAM, IDS)
        seals = {r: MapSeal.load(load_keys(Path(folder) / r, r, TEAM), TEAM, r) for r in IDS}
    before_kb = peak_kb()
    generation = 0
    while report.mutants < count:
        generation += 1
        _one_life(count, report, rng, per_message, generation, seals if generation % 2 else {})
    report.memory_growth_mb = (peak_kb() - before_kb) / 1024
    return report


def _one_life(
    count: int, report: Report, rng: np.random.Generator, per_message: int, boot: int, seals: dict[str, MapSeal]
) -> None:
    """Run a fresh team of three for a while; mutants that look right may spoil its knowledge, not its working."""
    network = MemoryNetwork(boot)
    nodes = {robot: CommsNode(robot, TEAM, boot, CONFIG, seed=boot) for robot in IDS}
    for robot, seal in seals.items():
        nodes[robot].seal_maps(seal)
    ends = {robot: network.attach(robot) for robot in IDS}
    maps: dict[str, LocalMap | None] = dict.fromkeys(IDS)
    view = TeamView()
    last = b"\0" * 40
    now_ns = 0
    while now_ns < 30_000_000_000 and report.mutants < count:
        now_ns += STEP_NS
        network.advance(now_ns)
        for robot, node in nodes.items():
            if rng.random() < 0.1:
                maps[robot] = grow(maps[robot], rng)
                node.publish(maps[robot], now_ns)
            effects = []
            for item in ends[robot].poll():
                if not isinstance(item, Incoming):
                    effects += node.on_peer_joined(item.peer, now_ns)
                    continue
                # Some messages come unaccompanied, or no exchange would ever get far.
                for _ in range(per_message if rng.random() < 0.2 else 0):
                    mutant = mutated(item.payload, last, rng)
                    begun = time.process_time()
                    # What it answers to mutants is not sent, or they would be all the traffic there is.
                    node.on_message(mutant, now_ns, item.sender if rng.random() < 0.5 else None)
                    took_ms = 1e3 * (time.process_time() - begun)
                    if took_ms > report.slowest_ms:
                        report.slowest_ms, report.slowest = took_ms, f"{len(mutant)} bytes"
                    report.mutants += 1
                effects += node.on_message(item.payload, now_ns, item.sender)
                last = item.payload
            status = status_report(node, now_ns, [("r1", "r2", "not merged")])
            for _ in range(per_message if rng.random() < 0.05 else 0):
                view.take([Sighting(TEAM, robot, mutated(status.payload, last, rng))], 0.0)
                report.mutants += 1
            for peer in IDS:
                if peer != robot:
                    effects += node.set_link_quality(peer, 1.0, now_ns)
            effects += node.on_tick(now_ns)
            for effect in effects:
                if isinstance(effect, Send):
                    ends[robot].send(effect)
                elif type(effect).__name__ == "ExchangeDone":
                    report.exchanges += 1
    json.dumps(view.snapshot(0.0))
    report.dropped.update(view.dropped)
    for node in nodes.values():
        report.dropped.update(node.dropped)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    begun = time.process_time()
    report = fuzz(args.count, args.seed)
    row = {**vars(report), "dropped": dict(report.dropped), "cpu_s": round(time.process_time() - begun, 1)}
    print(json.dumps(row))


if __name__ == "__main__":
    main()
