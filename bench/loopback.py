"""What an exchange takes over Zenoh on this machine: ``python bench/loopback.py [--keys FOLDER]``.

One 1000 x 1000 map goes from one session to another, then again with nothing new. One JSON line.
"""

from __future__ import annotations

import argparse
import json
import socket
import threading
import time
from pathlib import Path

import numpy as np

from mrslam.comms import CommsConfig, CommsNode, ExchangeDone, MapSeal, Send, load_keys, warm_up
from mrslam.comms.zenoh import ZenohTransport
from mrslam.spatial import Keyframes, LocalMap, OccupancyGrid, TiledMap


def signed_node(robot: str, config: CommsConfig, keys: Path | None) -> CommsNode:
    """Return a node, with the team's keys where there are any."""
    node = CommsNode(robot, "bench", time.time_ns(), config)
    if keys is not None:
        node.seal_maps(MapSeal.load(load_keys(keys / robot, robot, "bench"), "bench", robot))
    return node


def loopback(keys: Path | None) -> dict[str, object]:
    """Exchange one 1000 x 1000 map between two Zenoh sessions, then again with nothing new; two threads, wall time."""
    config = CommsConfig(exchange_timeout_s=0.3, link_source="model", beacon_period_s=0.1)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"{'tcp' if keys is None else 'tls'}/127.0.0.1:{probe.getsockname()[1]}"
    nodes = {robot: signed_node(robot, config, keys) for robot in ("a", "b")}
    nodes["a"].publish(rooms(1000), 0)
    loaded = {robot: None if keys is None else load_keys(keys / robot, robot, "bench") for robot in nodes}
    ends = {
        "a": ZenohTransport("a", "bench", listen=[endpoint], keys=loaded["a"]),
        "b": ZenohTransport("b", "bench", connect=[endpoint], keys=loaded["b"]),
    }
    done: list[ExchangeDone] = []
    until = time.monotonic() + 15

    def live(robot: str, peer: str) -> None:
        node, end = nodes[robot], ends[robot]
        while time.monotonic() < until and len(done) < 12:
            effects = []
            for item in end.poll(0.01):
                effects += node.on_event(item, time.monotonic_ns())
            effects += node.set_link_quality(peer, 1.0, time.monotonic_ns()) + node.on_tick(time.monotonic_ns())
            for effect in effects:
                if isinstance(effect, Send):
                    end.send(effect)
                elif isinstance(effect, ExchangeDone) and robot == "a":
                    done.append(effect)

    threads = [threading.Thread(target=live, args=pair) for pair in (("a", "b"), ("b", "a"))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for end in ends.values():
        end.close()
    if len(done) < 3:
        raise SystemExit("the two sessions did not exchange")
    repeats = [1e3 * effect.costs.seconds for effect in done[1:]]
    return {
        "link": endpoint.split("/")[0],
        "first_ms": round(1e3 * done[0].costs.seconds, 1),
        "first_bytes": done[0].costs.bytes_sent + done[0].costs.bytes_received,
        "repeat_ms_median": round(float(np.median(repeats)), 2),
        "repeat_ms_max": round(max(repeats), 2),
        "repeat_bytes": done[-1].costs.bytes_sent + done[-1].costs.bytes_received,
    }


def rooms(cells: int) -> LocalMap:
    """Return a map of many rooms, ``cells`` on a side."""
    rng = np.random.default_rng(0)
    grid = np.full((cells, cells), -1, dtype=np.int8)
    for _ in range(60):
        r, c = (int(v) for v in rng.integers(0, cells - 120, size=2))
        grid[r : r + 100, c : c + 110] = 0
        grid[r, c : c + 110] = grid[r : r + 100, c] = 100
    drive = np.cumsum(rng.normal(scale=0.01, size=(500, 3)), axis=0)
    return LocalMap(TiledMap.from_grid(OccupancyGrid(grid, 0.05), 1), Keyframes(np.arange(500) * 1_000_000_000, drive))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--keys", type=Path, help="key folders of robots a and b of team bench")
    args = parser.parse_args()
    warm_up()
    print(json.dumps(loopback(args.keys)))


if __name__ == "__main__":
    main()
