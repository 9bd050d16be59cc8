"""What many robots in range of each other cost: ``python bench/crowd.py [--robots 100]``.

All hear each other for 30 s of virtual time. One JSON line: the time of a tick, and the bytes of beacons.
"""

from __future__ import annotations

import argparse
import json
import time

import numpy as np

from mrslam.comms import CommsConfig, CommsNode, ExchangeDone, MemoryNetwork, Send, warm_up

SECOND = 1_000_000_000


def crowd(count: int) -> dict[str, object]:
    """Let so many robots hear each other for 30 s of virtual time; return the cost of a tick and of beacons."""
    config = CommsConfig(exchange_timeout_s=10.0)
    network = MemoryNetwork(0)
    nodes = {f"r{k:03d}": CommsNode(f"r{k:03d}", "bench", k + 1, config, seed=k) for k in range(count)}
    ends = {robot: network.attach(robot) for robot in nodes}
    ticks_ms: list[float] = []
    now_ns, exchanges = 0, 0
    while now_ns < 30 * SECOND:
        now_ns += 100_000_000
        network.advance(now_ns)
        for robot, node in nodes.items():
            effects = []
            for item in ends[robot].poll():
                effects += node.on_event(item, now_ns)
            begun = time.process_time()
            effects += node.on_tick(now_ns)
            ticks_ms.append(1e3 * (time.process_time() - begun))
            for effect in effects:
                if isinstance(effect, Send):
                    ends[robot].send(effect)
                exchanges += isinstance(effect, ExchangeDone)
    beacons = [node.bytes_sent["beacon"] / 30 for node in nodes.values()]
    return {
        "peers": count - 1,
        "tick_ms_mean": round(float(np.mean(ticks_ms)), 3),
        "tick_ms_p99": round(float(np.percentile(ticks_ms, 99)), 3),
        "beacon_bytes_per_robot_and_second": round(float(np.mean(beacons)), 1),
        "exchanges": exchanges // 2,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, default=100)
    args = parser.parse_args()
    warm_up()
    print(json.dumps(crowd(args.robots)))


if __name__ == "__main__":
    main()
