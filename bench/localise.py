"""What tracking in a known map costs beside mapping, and how near it comes to it: one JSON line a log.

    python bench/localise.py [--data DIR] [--seed 1] slam/aces.clf.gz slam/intel.clf.gz

A log is mapped whole, with one thread; then it is played again to a localiser that has nothing but the grid of that
map, and begins 0.2 m and 3 degrees off. off_m, off_deg : median, 95th percentile and most of its poses, as told at
each scan, against the finished trajectory of the mapper. map_s, track_s : CPU seconds of both, without compiling;
share : of the two. matched : scans that were matched, of all.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from pathlib import Path
from typing import Any

import numpy as np

from mrslam.rbpf import FixedMap, Localiser, Mapper, MapperConfig
from mrslam.sim_driver.feeds import open_feed
from mrslam.sim_driver.kernels import load_kernels
from mrslam.spatial import se2

OFF = np.array([0.2, 0.1, 0.05])
"""How far off the localiser begins, metres and radians."""


def localised(log: Path, seed: int) -> dict[str, Any]:
    """Return the row of one log."""
    readings, config = list(open_feed(log).readings), MapperConfig(threads=1)
    mapper = Mapper(config, seed=seed)
    begun_s = time.process_time()
    for reading in readings:
        mapper.update(reading.scan, reading.T_odom_base)
    map_s = time.process_time() - begun_s
    way = mapper.trajectory()
    localiser = Localiser(FixedMap(mapper.snapshot().map.to_grid(), config.resolution_m), config)
    assert localiser.begin(readings[0].scan, readings[0].T_odom_base, way.T_map_base[0] + OFF)
    told, lost = {}, 0
    begun_s = time.process_time()
    for reading in readings[1:]:
        localiser.update(reading.scan, reading.T_odom_base)
        told[reading.scan.stamp_ns] = localiser.T_map_base
        lost += localiser.fit.is_lost
    track_s = time.process_time() - begun_s
    off = np.array(
        [se2.between(T, told[k]) for k, T in zip(way.stamps_ns.tolist(), way.T_map_base, strict=True) if k in told]
    )
    away = {"off_m": np.hypot(off[:, 0], off[:, 1]), "off_deg": np.degrees(np.abs(off[:, 2]))}
    return {
        "log": log.name, "map_s": round(map_s, 2), "track_s": round(track_s, 2), "share": round(track_s / map_s, 2),
        "matched": localiser.stats.processed, "of": len(readings), "lost": lost,
        **{name: [round(float(q), 3) for q in np.percentile(values, [50, 95, 100])] for name, values in away.items()},
    }  # fmt: skip


def main() -> None:
    """Play every log asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", nargs="+")
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("MRSLAM_DATA", "../shared/data")))
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    load_kernels(["rbpf", "sim_driver.feeds"])
    for log in options.logs:
        print(json.dumps(localised(options.data / log, options.seed)), flush=True)


if __name__ == "__main__":
    main()
