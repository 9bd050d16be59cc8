"""What the exchange of maps costs, against sending whole maps: ``python bench/comms.py [LOG] [--every 30]``.

Plays a recorded log as two robots, cut at ``--cut`` of its scans, each mapping its part from time 0, that meet every
``--every`` seconds of mission time on the in-memory network. Full maps are what each robot would have sent at each of
these meetings: its cropped grid as one LZ4 block (mrgs' way), or raw. The table has the columns of mrgs' Table 1.
Beacons are counted too, over all of mission time. Without a log: two maps that grow by themselves. The last line is
JSON.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path

import lz4.block
import numpy as np

from mrslam.comms import CommsConfig, CommsNode, ExchangeDone, MemoryNetwork, Send, warm_up
from mrslam.rbpf import Mapper, MapperConfig
from mrslam.sim_driver.feeds.carmen import CarmenFeed
from mrslam.spatial import Keyframes, LocalMap, OccupancyGrid, TiledMap

STEP_NS = 50_000_000
IDLE_STEP_NS = 250_000_000
"""Between two meetings there are only beacons."""
SECOND = 1_000_000_000


def recorded(readings: list, every_s: float, particles: int, seed: int) -> Iterator[LocalMap]:
    """Yield a robot's map every so many seconds of its log; the log's time may step backward, which takes none."""
    mapper = Mapper(MapperConfig(particles=particles, threads=1), seed=seed)
    latest, elapsed_s, due_s = None, 0.0, every_s
    for reading in readings:
        stamp = reading.scan.stamp_ns
        if latest is not None and stamp > latest:
            elapsed_s += (stamp - latest) / 1e9
        latest = stamp if latest is None else max(latest, stamp)
        while elapsed_s >= due_s:
            yield mapper.snapshot()
            due_s += every_s
        mapper.update(reading.scan, reading.T_odom_base)
    yield mapper.snapshot()


def grown(meetings: int, seed: int) -> Iterator[LocalMap]:
    """Yield a map of rooms that grows by one room at a time, its newest cells still unsure."""
    rng = np.random.default_rng(seed)
    cells = np.full((800, 800), -1, dtype=np.int8)
    before: TiledMap | None = None
    poses: list[list[float]] = []
    for k in range(1, meetings + 1):
        row, col = (int(v) for v in rng.integers(0, 680, size=2))
        height, width = (int(v) for v in rng.integers(40, 120, size=2))
        cells[row : row + height, col : col + width] = 0
        cells[[row, row + height - 1], col : col + width] = 100
        cells[row : row + height, [col, col + width - 1]] = 100
        noisy = rng.random((height, width)) < 0.01
        cells[row : row + height, col : col + width][noisy] = rng.choice(np.array([25, 50, 75], np.int8), noisy.sum())
        poses += [[0.05 * col, 0.05 * row, 0.1 * k]] * 15
        new = TiledMap.from_grid(OccupancyGrid(cells.copy(), 0.05), revision=k)
        if before is not None:
            same = {i: t for i, t in before.tiles.items() if np.array_equal(t.cells, new.tiles[i].cells)}
            new = TiledMap(0.05, {**new.tiles, **same}, k)
        before = new
        yield LocalMap(new, Keyframes(np.arange(len(poses), dtype=np.int64) * SECOND, np.array(poses)))


def mission(maps: dict[str, Iterator[LocalMap]], every_s: float) -> dict[str, object]:
    """Let the robots meet every so many seconds until all have finished; return sums over all exchanges."""
    config = CommsConfig(exchange_timeout_s=0.5 * every_s, link_source="trace")
    network = MemoryNetwork(0)
    nodes = {robot: CommsNode(robot, "bench", k + 1, config) for k, robot in enumerate(maps)}
    ends = {robot: network.attach(robot) for robot in maps}
    newest: dict[str, LocalMap] = {}
    rows: list[tuple[int, int, float]] = []  # per map: whole, as LZ4, milliseconds
    done: list[ExchangeDone] = []
    cpu_s, now_ns, running = 0.0, 0, True
    while running:
        running = False
        for robot, source in maps.items():
            local = next(source, None)
            if local is not None:
                newest[robot], running = local, True
        if not running:
            break
        for robot, local in newest.items():
            nodes[robot].publish(local, now_ns)
            cells = local.map.to_grid().cells.tobytes()
            begun = time.process_time()
            packed = len(lz4.block.compress(cells, store_size=False))
            rows.append((len(cells), packed, 1e3 * (time.process_time() - begun)))
        met: set[str] = set()
        step_ns = STEP_NS
        end_ns = now_ns + round(every_s * SECOND)
        begun = time.process_time()
        while now_ns < end_ns:
            now_ns += step_ns
            network.advance(now_ns)
            for robot, node in nodes.items():
                effects = []
                for item in ends[robot].poll():
                    effects += node.on_event(item, now_ns)
                for peer in nodes:
                    if peer != robot:
                        effects += node.set_link_quality(peer, float(step_ns == STEP_NS), now_ns)
                effects += node.on_tick(now_ns)
                for effect in effects:
                    if isinstance(effect, Send):
                        ends[robot].send(effect)
                    elif isinstance(effect, ExchangeDone):
                        done.append(effect)
                        met.add(robot)
            if step_ns == STEP_NS and len(met) == len(nodes):
                step_ns = IDLE_STEP_NS
                cpu_s += time.process_time() - begun
        if len(met) < len(nodes):
            raise SystemExit(f"an exchange was not completed at {now_ns / SECOND:.0f} s")
    whole, packed = sum(row[0] for row in rows), sum(row[1] for row in rows)
    sent = sum(effect.costs.bytes_sent for effect in done)
    print("mrgs' Table 1, for these maps       N  mean ratio      total       sent      saved  processing ms")
    ratio = float(np.mean([row[0] / row[1] for row in rows if row[1]]))
    line = "{:<32s}{:5d}{:12.1f}{:11d}{:11d}{:10.1f} %{:15.2f}"
    lz4_ms = sum(row[2] for row in rows)
    print(line.format("whole maps, LZ4", len(rows), ratio, whole, packed, 100 * (1 - packed / whole), lz4_ms))
    print(line.format("mrslam", len(rows), whole / sent, whole, sent, 100 * (1 - sent / whole), 1e3 * cpu_s))
    beacons = sum(node.bytes_sent["beacon"] for node in nodes.values())
    full_lz4, full_raw = sum(e.costs.bytes_full_lz4 for e in done), sum(e.costs.bytes_full_raw for e in done)
    return {
        "meetings": len(done) // 2,
        "bytes_sent": sent,
        "bytes_full_lz4": full_lz4,
        "bytes_full_raw": full_raw,
        "lz4_over_sent": round(full_lz4 / sent, 2),
        "raw_over_sent": round(full_raw / sent, 1),
        "bytes_beacons": beacons,
        "lz4_over_all": round(full_lz4 / (sent + beacons), 2),
        "raw_over_all": round(full_raw / (sent + beacons), 1),
        "mission_s": now_ns // SECOND,
        "cpu_ms_per_exchange": round(1e3 * cpu_s / max(len(done) // 2, 1), 2),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", nargs="?", type=Path, help="a CARMEN log, plain or gzip")
    parser.add_argument("--cut", type=float, default=0.24, help="share of the scans that robot r1 gets")
    parser.add_argument("--every", type=float, default=30.0, help="seconds of mission time between meetings")
    parser.add_argument("--particles", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    warm_up()
    if args.log is None:
        maps = {"r1": grown(60, args.seed), "r2": grown(60, args.seed + 1)}
    else:
        readings = list(CarmenFeed(args.log).readings)
        cut = round(args.cut * len(readings))
        parts = {"r1": readings[:cut], "r2": readings[cut:]}
        maps = {name: recorded(part, args.every, args.particles, args.seed) for name, part in parts.items()}
    print(json.dumps(mission(maps, args.every)))


if __name__ == "__main__":
    main()
